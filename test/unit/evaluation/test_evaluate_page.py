# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an evaluation needs no other file, and shows what was measured."""
import base64
from html import unescape
import json
import re
from types import SimpleNamespace

import cv2
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation import page
from fuzzy_stereo_ros.evaluation.ground_truth import GroundTruthPair
from fuzzy_stereo_ros.evaluation.measuring import FILLED, Result
from fuzzy_stereo_ros.evaluation.page import colour_error, Gallery, NO_DISPARITY, UNKNOWN_GREY
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
import numpy as np
import pytest
from written_scenes import COLUMNS, pair, ROWS, write_named

NAN = np.nan
EMPTY = {'meta', 'img', 'br', 'link', 'hr', 'input'}
MATCHERS = ['ours', 'opencv:bm', 'mine']


class Page:
    """A page: its tags, as far as they are open at the end, headings, images, cells, and links."""

    def __init__(self, text):
        self.text, self.words = text, words(text)
        self.open, self.headings, self.images = [], [], []
        for end, tag in re.findall(r'<(/?)(\w+)', text):
            if end:
                assert self.open.pop() == tag
            elif tag not in EMPTY:
                self.open.append(tag)
        self.links = re.findall(r'[ "](?:src|href|srcset|action|data)="([^"]*)"', text)
        self.cells = [words(cell) for cell in re.findall(r'<t[dh]\b.*?>(.*?)</t[dh]>', text, re.S)]
        for _, heading, below in re.findall(
                r'<h([123])\b.*?>(.*?)</h\1>(.*?)(?=<h[123]|$)', text, re.S):
            self.headings.append(words(heading))
            self.images += [dict(re.findall(r'(\w+)="([^"]*)"', image), under=self.headings[-1])
                            for image in re.findall('<img ([^>]*)>', below)]


def words(text):
    """Return what a reader sees of HTML."""
    return unescape(re.sub('<[^>]*>', '', text))


def picture_of(uri):
    """Return the picture of a data URI: uint8 (R, C, 3) BGR."""
    start = 'data:image/webp;base64,'
    assert uri.startswith(start)
    content = np.frombuffer(base64.b64decode(uri[len(start):], validate=True), np.uint8)
    return cv2.imdecode(content, cv2.IMREAD_COLOR)


@pytest.fixture(scope='module')
def evaluation(tmp_path_factory):
    """Evaluate three scenes into a page; return it and the records."""
    folder = tmp_path_factory.mktemp('page')
    (folder / 'mine').mkdir()
    for seed, name in enumerate(('a<b> & "c"', 'plain', 'third')):
        made = pair(seed)
        write_named(folder / 'data' / name, made)
        write_disparity(folder / 'mine' / f'{name}.pfm', made.truth + 1)
    assert main(['evaluate', str(folder / 'data'), '--matcher', *MATCHERS[:2], '--results',
                 str(folder / 'mine'), '--html', str(folder / 'page.html'), '--json',
                 str(folder / 'page.json')]) == 0
    return (Page((folder / 'page.html').read_text(encoding='utf-8')),
            json.loads((folder / 'page.json').read_text())['records'])


def test_the_page_is_well_formed_and_points_nowhere(evaluation):
    found, _ = evaluation
    assert found.open == []
    assert len(found.links) == len(found.images)
    assert all(link.startswith('data:image/webp;base64,') for link in found.links)
    assert not any(word in found.text for word in ('<script', '@import', 'url(', '://'))


def test_scenes_stand_above_the_figures_from_the_best_to_the_worst_with_their_figures(evaluation):
    found, records = evaluation
    shown = [record for record in records if (record['kind'], record['mask'], record['map'])
             == ('scene', 'nonocc', 'filled')]
    errors = {record['name']: record['bad_dense_1'] for record in shown
              if record['matcher'] == 'ours'}
    assert len(set(errors.values())) == 3
    headings = [heading.split(' left, right')[0] for heading in found.headings]
    assert headings[1:6] == ['Pairs', *sorted(errors, key=errors.get), 'Figures']
    assert all(f"bad-1: {record['bad_dense_1']:.2f} % dense" in found.words for record in shown)
    (mean,) = (record for record in records if record['matcher'] == 'opencv:bm' and (
        record['kind'], record['mask'], record['map']) == ('mean', 'nonocc', 'as it comes'))
    assert {f"{mean['bad_sparse_1']:.2f}", 'bad-0.5 [%]'} < set(found.cells)
    assert '<em>sparse</em>' in found.text


def test_the_pictures_are_image_truth_and_the_disparity_and_error_of_each_matcher(evaluation):
    found, _ = evaluation
    assert [image['alt'] for image in found.images] == 3 * [
        'left image', 'truth', *(word for name in MATCHERS
                                 for word in (f'disparity by {name}', f'error of {name}'))]
    assert all(picture_of(image['src']).shape == (ROWS, COLUMNS, 3) for image in found.images)


def test_a_scene_of_which_nobody_has_a_result_is_shown_without_figures(tmp_path):
    for seed, name in enumerate('ab'):
        write_named(tmp_path / 'data' / name, pair(seed))
    (tmp_path / 'mine').mkdir()
    write_disparity(tmp_path / 'mine' / 'a.pfm', pair(0).truth)
    assert main(['evaluate', str(tmp_path / 'data'), '--matcher', '--results',
                 str(tmp_path / 'mine'), '--html', str(tmp_path / 'page.html')]) == 0
    found = Page((tmp_path / 'page.html').read_text(encoding='utf-8'))
    with_result, without = (heading for heading in found.headings if 'left, right' in heading)
    assert with_result.endswith('disparities, figures: nonocc')
    assert without.endswith('disparities')
    assert [image['alt'] for image in found.images if image['under'] == without] == [
        'left image', 'truth']


def test_a_gallery_that_is_full_lets_go_of_what_cannot_be_ranked_and_then_of_the_middle(
        monkeypatch):
    monkeypatch.setattr(page, 'MOST_SCENES', 4)
    known = GroundTruthPair(*(np.zeros((4, 5), np.uint8),) * 2, np.ones((4, 5), np.float32))
    gallery = Gallery('ours')
    for name, error in (('a', 3.0), ('b', None), ('c', 1.0), ('d', 9.0), ('e', 5.0), ('f', 4.0),
                        ('g', 0.5)):
        subject = SimpleNamespace(path=name, family='family', limit=1.0, layout='')
        gallery.show(known, Result(subject, (4, 5), 8, '', [] if error is None else [
            {'matcher': 'ours', 'map': FILLED, 'mask': 'all', 'bad_dense_1': error}]), {})
    assert {'g', 'd'} < set(gallery.shown)
    assert len(gallery.shown) == 4 and 'b' not in gallery.shown
    assert (gallery.ranked()[0], gallery.ranked()[-1]) == ('g', 'd')
    assert gallery.order().endswith(
        'to the largest: bad-1 of family. 3 in between have no pictures.')


def test_an_error_is_black_where_right_bright_where_wrong_blue_where_nothing_was_found():
    """Each point of a sparse truth is a disc; what has no truth is grey."""
    truth = np.full((21, 81), NAN, np.float32)
    points, found = np.s_[10:11, 10::20], np.full_like(truth, 5)
    truth[points], found[points] = 5, (5, 7, 5 + 3 * ERROR_LIMIT, NAN)
    picture = colour_error(found, truth)
    colours = right, middle, wrong, nothing = picture[points][0].astype(int)
    assert right.sum() < 10 < middle.sum() < 500 < wrong.sum()
    assert tuple(nothing) == NO_DISPARITY
    for place, colour in enumerate(colours):
        rows, columns = np.nonzero((picture == colour).all(axis=2))
        assert len(rows) >= 13 and abs(rows - 10).max() <= 2
        assert abs(columns - 10 - 20 * place).max() <= 2
    assert (picture[:, 20::20] == UNKNOWN_GREY).all()
    found[points][0, 0], truth[points][0, 0] = 5, NAN       # a dense truth
    assert colour_error(found[points], truth[points])[0].tolist() == [
        [UNKNOWN_GREY] * 3, *picture[points][0, 1:].tolist()]
