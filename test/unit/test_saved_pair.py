# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A saved pair is read as it was, matches to the same bits, and is there whole or not at all."""
from dataclasses import fields, replace
import json
import os
from pathlib import Path
import tempfile

from command_output import contents
from fuzzy_stereo_ros.matching import Match, MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.out_of_range import EXTRA_LABELS
from fuzzy_stereo_ros.matching.over_frames.state import LONGEST_GAP_NS
from fuzzy_stereo_ros.matching.realtime.still_scene import SETTLED
from fuzzy_stereo_ros.pair_matcher import camera_of
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.saved_pair import read_saved_pair, SavedPair, versions, write_saved_pair
import numpy as np
import pytest
from saved_scene import running

FILES = {'left.png', 'right.png', 'pair.json', 'arrays.npz', 'README.txt'}


def through_files(saved):
    with tempfile.TemporaryDirectory() as folder:
        write_saved_pair(Path(folder) / 'report', saved)
        return read_saved_pair(Path(folder) / 'report')


def assert_equal(one, two):
    """Assert that two values are equal, arrays to the last bit and dtype, as deep as they go."""
    assert type(one) is type(two)
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (two.dtype, two.shape)
        assert one.tobytes() == two.tobytes()
    elif hasattr(one, '__dataclass_fields__'):
        for part in fields(one):
            assert_equal(getattr(one, part.name), getattr(two, part.name))
    elif isinstance(one, tuple):
        for parts in zip(one, two):
            assert_equal(*parts)
    else:
        assert one == two


def matched_again(saved):
    """Return the match of a matcher that has seen nothing else."""
    matcher = StereoMatcher(saved.config)
    matcher.restore(saved.state, saved.rows)
    return matcher.match(saved.pair.left, saved.pair.right, stamp=saved.pair.stamp,
                         camera=camera_of(saved.pair))


def assert_same_bits(one, two):
    assert_equal(one.disparity, two.disparity)
    assert_equal(one.confidence, two.confidence)
    assert one.warm == two.warm


# ---- what is read and matched again ----


@pytest.mark.parametrize('frame', [0, 2])
@pytest.mark.parametrize('scene', [
    {}, *({'grey': side} for side in ('left', 'right', 'both')), {'grey': 'both', 'bits': 12},
    {'bits': 16}, {'profile': 'paper', 'population': 6, 'generations': 3},
    {'profile': 'paper_live'}, {'profile': 'quality', 'generations': 1}], ids=str)
def test_a_saved_pair_is_matched_to_the_bits_of_the_running_sequence(scene, frame):
    saved = running(**scene)[frame]
    assert saved.match.warm == (frame > 0 and saved.config.warm_start)
    again = through_files(saved)
    assert_equal(again, saved)
    assert_same_bits(matched_again(again), saved.match)


def test_the_previous_frame_is_given_on_where_it_took_no_part():
    """Too old: it may be what the report is about."""
    *_, saved = running()
    late = replace(saved.pair, stamp=saved.pair.stamp + 2 * LONGEST_GAP_NS)
    match = matched_again(replace(saved, pair=late, match=replace(saved.match, warm=False)))
    assert not match.warm
    again = through_files(replace(saved, pair=late, match=match))
    assert_equal(again.state, saved.state)
    assert_same_bits(matched_again(again), match)


def test_genes_of_more_than_256_disparities_are_read_back():
    *_, saved = running()
    config = replace(saved.config, disparities=300)
    wide = StereoPair(*(np.zeros((60, 320), np.uint8) for _ in range(2)), saved.pair.calibration,
                      saved.pair.stamp)
    own = saved.state.own
    state = saved.state._replace(config=config, own=own._replace(
        labels=own.labels.astype(np.uint16) + 270))
    maps = [np.zeros((60, 320), np.float32) for _ in range(2)]
    kept = SavedPair(wide, config, state, Match(*maps, [], {}, False))
    assert_equal(through_files(kept), kept)


# ---- the folder ----


def test_a_folder_holds_what_people_and_programs_look_for(tmp_path):
    *_, warm = running()
    write_saved_pair(tmp_path / 'warm', warm)
    assert set(os.listdir(tmp_path / 'warm')) == FILES
    lines = (tmp_path / 'warm' / 'README.txt').read_text(encoding='utf-8').splitlines()
    assert len(lines) == 3 and lines[2] == 'fuzzy-stereo match --saved .'
    record = json.loads((tmp_path / 'warm' / 'pair.json').read_text(encoding='utf-8'))
    assert (record['versions'], record['about']) == (versions(), warm.about)
    assert set(record['parameters']) == {one.name for one in fields(MatcherConfig)}


def test_an_empty_folder_or_a_link_to_one_is_taken_and_is_as_open_to_others_as_any_new_one(
        folder):
    (folder / 'empty').mkdir()
    (folder / 'link').symlink_to('empty')
    for name in ('link', 'new'):
        write_saved_pair(name, running()[0])
        assert set(os.listdir(name)) == FILES
    assert (folder / 'link').is_symlink()
    assert sorted(os.listdir()) == ['empty', 'link', 'new']
    (folder / 'plain').mkdir()
    assert (folder / 'new').stat().st_mode == (folder / 'plain').stat().st_mode


def rejected(folder, reason):
    """Assert that nothing is written to a folder, for a reason, and what is around stays."""
    before = contents()
    with pytest.raises(OSError, match=f'{reason}; give a missing or empty folder'):
        write_saved_pair(folder, running()[0])
    assert contents() == before


def test_a_folder_that_is_taken_is_rejected_and_stays_as_it_is(folder):
    (folder / 'full').mkdir()
    (folder / 'full' / 'file').write_text('kept')
    rejected('full', 'Directory not empty')
    rejected('full/file', 'Not a directory')
    rejected('none/report', 'No such file or directory')


def test_a_disk_without_room_leaves_no_part_of_a_folder(folder, limit_files):
    limit_files(2000)
    rejected('report', 'File too large')


# ---- damage ----


def rewritten(folder, change):
    path = folder / 'pair.json'
    record = json.loads(path.read_text(encoding='utf-8'))
    change(record)
    path.write_text(json.dumps(record), encoding='utf-8')


def restored(folder, **changes):
    np.savez(folder / 'arrays.npz', **{**np.load(folder / 'arrays.npz'), **changes})


@pytest.mark.parametrize('damage, words', [
    (lambda folder: rewritten(folder, lambda record: record['parameters'].pop('mutation_rate')),
     'parameters is .*; needed'),       # of an older version
    (lambda folder: write_image(folder / 'right.png', np.zeros((60, 99), np.uint8)),
     'the left image is 100 x 60, the right one 99 x 60'),
    (lambda folder: restored(folder, disparity=np.zeros((60, 99), np.float32)),
     r'disparity is float32 \(60, 99\); needed is float32 \(60, 100\)'),
    (lambda folder: rewritten(folder, lambda record: record.update(state=None)),
     'the previous frame took part in the match, but the state is missing'),
    (lambda folder: rewritten(folder, lambda record: record['state'].update(stamp=2**60)),
     'took part in the match, but the state is of another frame'),
    (lambda folder: restored(
        folder, labels=np.full((60, 100), 24 + EXTRA_LABELS, np.uint8)), 'labels out of range'),
    (lambda folder: restored(folder, census=np.zeros((0, 0), np.uint32),
                             survived=np.zeros((0, 0), np.uint8)),
     r'census of the state is uint32 \(0, 0\); needed is uint32 \(60, 100\)')])
def test_what_does_not_belong_together_is_rejected_with_a_sentence(tmp_path, damage, words):
    report = tmp_path / 'report'
    write_saved_pair(report, running()[2])
    damage(report)
    with pytest.raises(ValueError, match=words) as caught:
        read_saved_pair(report)
    assert str(caught.value).startswith(str(report)) and '\n' not in str(caught.value)
    assert str(caught.value).endswith('use the version of fuzzy_stereo_ros that wrote it')


def test_what_could_not_be_read_again_is_not_written():
    saved, paper = running()[-1], running('paper', population=6, generations=3)[-1]
    state, own, genes = saved.state, paper.state.own, paper.state.own.genes
    assert genes.shape[0] == 6
    for pair, words, changes in (
            (saved, 'the state is of the right image, the match of the left',
             {'config': replace(state.config, reference='right')}),
            (saved, 'still_disparity of the state is float32 .0, 0.; needed',
             {'own': state.own._replace(still=SETTLED)}),
            *((paper, words, {'own': own._replace(genes=found)}) for found, words in (
                (genes + np.uint16(24), 'the state has genes out of range'),
                (genes[:0], 'the state has genes out of range'),
                (genes.astype(np.uint8), r'genes of the state is uint8 \(6, 60, 100\); needed')))):
        with pytest.raises(ValueError, match=words):
            replace(pair, state=pair.state._replace(**changes))
