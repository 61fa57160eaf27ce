# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What `fuzzy-stereo suggest` and `--disparities auto` find in pairs."""
import re

from command_output import printed, rejection
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.matching import MatcherConfig, search_range as automatic, StereoMatcher
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.matching.search_range import search_range
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest
import yaml

LARGEST = 40
MAKE = 'synthesise', '--frames', 2, '--rows', 120, '--columns', 240, '--output'


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp('sequence') / 'made'
    assert main([*map(str, MAKE), str(folder), '--disparities', str(LARGEST)]) == 0
    return folder


@pytest.fixture
def folder(folder, made):
    """Work in a folder with a synthetic sequence."""
    (folder / 'made').symlink_to(made)
    return folder


def test_suggested_parameters_are_a_file_for_the_node_whose_range_holds_the_truth(folder, capsys):
    text = printed(capsys, 'suggest', 'made')
    found = yaml.safe_load(text)['/**']['ros__parameters']
    assert set(found) == {'min_disparity', 'disparity_range', 'align_rows', 'profile', 'scale'}
    assert found['min_disparity'] == 0 and LARGEST - 2 <= found['disparity_range'] <= 2 * LARGEST
    for reason in ('are seen', 'reach from infinity to', 'row offset', 'pixels are black',
                   'ms a pair on this computer, recorded at 10 pairs/s'):
        assert reason in text
    assert 'noise' not in text


def test_suggested_parameters_have_the_options_by_which_the_pairs_were_made(folder, capsys):
    text = printed(capsys, 'suggest', 'made', '--crop', '--approximate', '--tolerance', '0.01',
                   '--queue-size', 7)
    found = yaml.safe_load(text)['/**']['ros__parameters']
    assert {'crop': True, 'approximate_sync': True, 'queue_size': 7,
            'approximate_sync_tolerance_seconds': 0.01}.items() <= found.items()
    assert 'rectify' not in found


@pytest.mark.parametrize('bits', ['8', '12'])
def test_noise_is_told_where_texture_does_not_hide_it(folder, capsys, bits):
    printed(capsys, *MAKE, 'noisy', '--noise', 4, '--contrast', 0.1, '--bits', bits)
    level, advice = re.search(r'# noise of (.+) grey levels or more(.*)',
                              printed(capsys, 'suggest', 'noisy')).groups()
    assert 2.5 < float(level) < 4.5 and advice.startswith(': more light')


def test_an_automatic_range_is_the_suggested_one_and_no_option_is_needed(folder, capsys):
    words = ['match', 'made/left/0000.png', 'made/right/0000.png', '--output', 'a.npy', '--json',
             '--overwrite']
    auto = '--disparities', 'auto'
    default, found = (printed(capsys, *words, *options)['disparities']
                      for options in ((), auto))
    assert default == 64 and LARGEST - 2 <= found <= 2 * LARGEST
    replay = 'replay', 'made', *auto, '--output'
    assert f'0 to {found - 1} px at focal length' in printed(capsys, *replay, 'out')
    half = re.search('0 to (.*) px at focal', printed(capsys, *replay, 'half', '--scale', 0.5))
    assert int(half[1]) >= LARGEST - 2


@pytest.mark.parametrize('seen', [(30, 38), (50, 60)])
def test_no_hint_proposes_another_range_than_the_automatic_one(seen, monkeypatch):
    monkeypatch.setattr(automatic, 'seen_disparities', lambda *_: seen)
    pair = make_pair(240, 320, 80, noise=2.0)
    first, count = search_range([(pair.left, pair.right)])
    config = MatcherConfig(min_disparity=first, disparities=count)
    match = StereoMatcher(config).match(pair.left, pair.right)
    finding = PlausibilityCheck().add(pair.left, pair.right, match, config, 0.0)
    assert finding is None or not finding.needed
    assert first <= np.nanmin(pair.truth) and np.nanmax(pair.truth) < first + count


def test_verged_cameras_get_a_range_below_0_and_blank_images_the_default():
    pair = make_pair(120, 240, LARGEST)
    moved = np.roll(pair.right, 12, axis=1)     # all disparities are 12 px less
    first, count = search_range([(pair.left, moved)])
    low, high = (end(pair.truth) - 12 for end in (np.nanmin, np.nanmax))
    assert low - 16 < first <= low < 0 and high < first + count < 1.2 * high + 32
    blank = np.zeros((60, 90), np.uint8)
    assert search_range([(blank, blank)]) == (0, 64)


def test_two_images_alone_are_matched_and_what_was_assumed_is_said(folder, capsys):
    words = 'match', 'made/left/0000.png', 'made/right/0000.png'
    told = printed(capsys, *words)
    assert told.startswith('disparity.pfm: 240x120 pixels') and 'disparity.png: the same' in told
    assert 'searched: 0 to 63 px, the default; --disparities auto finds the range' in told
    before = (folder / 'disparity.pfm').read_bytes()
    assert (f"without --output the result is written to {folder / 'disparity.pfm'} and "
            f"{folder / 'disparity.png'}, which there is already; give --overwrite to replace it, "
            'or --output') in rejection(capsys, *words)
    printed(capsys, *words, '--disparities', 16, '--overwrite')
    assert (folder / 'disparity.pfm').read_bytes() != before
