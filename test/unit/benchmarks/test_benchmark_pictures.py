# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the pictures of the benchmarks show is what the tables of their report say."""
import re
from xml.etree import ElementTree

from fuzzy_stereo_ros.benchmarks import ablation, accuracy, page, warm
from fuzzy_stereo_ros.benchmarks.page import as_svg
from fuzzy_stereo_ros.evaluation.report import Table
import pytest

pytest.importorskip('matplotlib', reason='pictures need matplotlib')
SVG = '{http://www.w3.org/2000/svg}'


def texts(content):
    """Return the words of an SVG file."""
    return [''.join(element.itertext()) for element in ElementTree.fromstring(content).iter(
        f'{SVG}text')]


def test_the_bars_of_accuracy_are_as_high_as_the_errors_of_the_groups_where_there_are_some():
    rows = [('made (1)', *[2.0, 3.0, 4.5, 5.0, 6.0, 7.0, 8.0]), ('kitti (2)', None, *[3.5] * 6)]
    panel, = accuracy.draw_accuracy([Table('Groups', ('', *accuracy.BARS), rows)]).axes
    drawn = {bars.get_label().removeprefix('OpenCV '): [bar.get_height() for bar in bars]
             for bars in panel.containers}
    assert drawn == {name: [error for error in errors if error is not None]
                     for name, *errors in zip(accuracy.BARS, *(row[1:] for row in rows))}
    places = [bar.get_x() for bars in panel.containers for bar in bars]
    assert len({round(place, 6) for place in places}) == 13
    assert [label.get_text() for label in panel.get_xticklabels()] == ['made\n(1)', 'kitti\n(2)']


def test_the_marks_of_the_warm_start_are_errors_and_flickers_and_a_line_joins_cold_and_warm():
    measured = [{'kind': kind, 'path': kind, '3WAY': 8.0 + place, 'cold': 4.0, 'warm': 3.0 - place,
                 'flicker, 3WAY': 7.0, 'flicker, cold': 5.0 + place, 'flicker, warm': 1.0}
                for place, kind in enumerate(('still', 'moving'))]
    for panel, start in zip(warm.draw_warm(warm.tables(measured)).axes, ('', 'flicker, ')):
        *joined, baseline, cold, warmed = (list(line.get_xdata()) for line in panel.lines)
        expected = [[one[start + name] for one in measured] for name in ('3WAY', 'cold', 'warm')]
        assert [baseline, cold, warmed] == expected
        assert joined == [list(ends) for ends in zip(*expected[1:])]


def ablation_report():
    """Return small tables as the ablation has them: of scenes, sequences and times."""
    return [
        Table('Scenes: mean error of', ('', 'mean of groups'), [
            ('as it is', 2.0), ('no crossover', 2.5), ('grey classes', 40.0),
            ('3WAY tuned', 4.0)]),
        Table('Scenes: mean time of', ('', 'of that as it is'), [
            ('as it is', 1.0), ('no crossover', 7.5)]),
        Table('Sequences: mean error in', ('', 'mean of kinds'), [
            ('as it is', 3.0), ('no frames', 6.0), ('grey classes', 9.0)])]


def test_the_bars_of_the_ablation_are_as_long_as_the_figures_and_what_is_too_long_is_cut():
    figure = ablation.draw_ablation(ablation_report())
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == ['as it is', 'no frames', 'no crossover', 'grey classes', '3WAY tuned']
    lengths = [{names[round(bar.get_y() + bar.get_height() / 2)]: bar.get_width()
                for bars in panel.containers for bar in bars} for panel in figure.axes]
    room = ablation.ROOM
    assert lengths == [
        {'as it is': 2.0, 'no crossover': 2.5, 'grey classes': 2 * room, '3WAY tuned': 4.0},
        {'as it is': 3.0, 'no frames': 6.0, 'grey classes': 3 * room},
        {'as it is': 1.0, 'no crossover': 7.5}]
    told = [text.get_text() for panel in figure.axes for text in panel.texts]
    assert [word for word in told if '\N{BLACK RIGHT-POINTING TRIANGLE}' in word] == [
        '40.00 \N{BLACK RIGHT-POINTING TRIANGLE}', '9.00 \N{BLACK RIGHT-POINTING TRIANGLE}']
    assert told.count('not measured') == 1 + 2 + 3


def test_without_sequences_the_ablation_shows_scenes_and_times():
    figure = ablation.draw_ablation(ablation_report()[:2])
    assert [panel.get_title(loc='left') for panel in figure.axes] == [
        'error on scenes [%]', 'time on scenes, as it is: 1']


def test_a_picture_is_the_same_file_every_time_and_its_words_are_text():
    first, again = (as_svg('ablation.svg', lambda: ablation.draw_ablation(ablation_report()))
                    for _ in range(2))
    assert first == again
    (content,) = first[0].values()
    assert first[1] == []
    assert {'no crossover', '40.00 \N{BLACK RIGHT-POINTING TRIANGLE}', '7.50'} <= set(
        texts(content))
    assert not re.search(rb'\d{4}-\d\d-\d\dT', content)


def test_without_matplotlib_the_picture_is_said_to_be_missing(monkeypatch):
    monkeypatch.setattr(page, 'find_spec', lambda name: None)
    assert as_svg('warm.svg', None) == ({}, ['warm.svg: matplotlib is not installed'])
