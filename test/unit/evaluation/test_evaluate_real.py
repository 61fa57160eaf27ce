# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""On a real pair `evaluate` says what the benchmarks say of it."""
import json

from bench.datasets import available_scenes
from bench.request import Request
from bench.scoring import bad_percent
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation.baselines import dense, TUNED
from fuzzy_stereo_ros.synthetic.scenes import ScenePair
from real_pairs import motorcycle
from written_scenes import write_2014


def test_motorcycle_in_the_layout_of_2014_has_the_figures_of_the_benchmark(tmp_path, capsys):
    write_2014(tmp_path / 'Motorcycle', ScenePair(*motorcycle()[:4]), ndisp=64)
    assert main(['evaluate', str(tmp_path), '--matcher', 'ours', 'opencv:hh4:tuned', '--repeats',
                 '1', '--json']) == 0
    records = json.loads(capsys.readouterr().out)['records']
    scene = next(one for one in available_scenes(None)[0] if one.path == 'midd2014/Motorcycle')
    known = scene.read()
    baseline = next(one for one in TUNED if one.algorithm == 'HH4')
    maps = {'ours': Request().ours.matcher(scene.disparities).match(
                known.left, known.right).disparity,
            'opencv:hh4:tuned': dense(baseline.matcher(scene.family, scene.disparities).match(
                known.left, known.right))}
    for matcher, disparity in maps.items():
        (record,) = [one for one in records if (
            one['kind'], one['matcher'], one['mask'], one['map']) == (
                'scene', matcher, 'nonocc', 'filled')]
        assert record['disparities'] == scene.disparities
        assert record['bad_dense_1'] == bad_percent(disparity, known, scene.limit)
