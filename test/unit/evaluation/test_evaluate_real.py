# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""On real pairs `evaluate` finds what is there, and says what the benchmarks say of it."""
import json

from bench.datasets import available_scenes
from bench.request import Request
from bench.scoring import bad_percent
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.evaluation.baselines import dense, TUNED
from fuzzy_stereo_ros.synthetic.scenes import ScenePair
from real_pairs import motorcycle
from written_scenes import write_2014

LIMIT = {'Middlebury': 'bad_dense_1', 'KITTI': 'bad_dense_3'}


def evaluated(capsys, *words):
    """Return the records that `evaluate ... --json` prints."""
    assert main(['evaluate', *map(str, words), '--repeats', '1', '--json']) == 0
    return json.loads(capsys.readouterr().out)['records']


def assert_says_what_the_benchmark_says(records, scene, name, mask):
    """Check the dense errors of ours and of HH4 against the functions behind the benchmark."""
    known = scene.read()
    baseline = next(one for one in TUNED if one.algorithm == 'HH4')
    ours = Request().ours.matcher(scene.disparities)
    maps = {'ours': ours.match(known.left, known.right).disparity,
            'opencv:hh4:tuned': dense(baseline.matcher(scene.family, scene.disparities).match(
                known.left, known.right))}
    for matcher, disparity in maps.items():
        (record,) = [record for record in records
                     if (record['kind'], record['name'], record['matcher'], record['mask'],
                         record['map']) == ('scene', name, matcher, mask, 'filled')]
        assert record['disparities'] == scene.disparities
        assert record[LIMIT[scene.family]] == bad_percent(disparity, known, scene.limit)


def of_benchmark(name, data=None):
    """Return a scene of the benchmarks."""
    return next(scene for scene in available_scenes(data)[0] if scene.path == name)


def test_motorcycle_in_the_layout_of_2014_has_the_figures_of_the_benchmark(tmp_path, capsys):
    pair = motorcycle()
    write_2014(tmp_path / 'Motorcycle', ScenePair(*pair[:4]), ndisp=64)
    records = evaluated(capsys, tmp_path, '--matcher', 'ours', 'opencv:hh4:tuned')
    assert_says_what_the_benchmark_says(records, of_benchmark('midd2014/Motorcycle'),
                                        'Motorcycle', 'nonocc')
