# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a command cannot do is one sentence and code 2, told before the work, nothing written."""
import re
import sys

from bench.__main__ import main as bench
from command_output import rejection
from fuzzy_stereo_ros.commands import evolve, match
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.camera_files import centred_calibration, write_middlebury_calibration
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.pairs.image_files import write_image
from fuzzy_stereo_ros.synthetic.scenes import make_pair
import numpy as np
import pytest
from written_scenes import pair, write_images, write_named

MATCH, EVOLVE = (f'{name} left.png right.png --disparities ' for name in ('match', 'evolve'))
TAKEN = '--saved has the images and the number of disparities; leave out LEFT, RIGHT and --dispa'
ROSBAGS = 'rosbags', 'rosbags.rosbag2', 'rosbags.typesys'
SENTENCES = [
    # ---- what is mistyped, and gets what was meant ----
    ('mach', '(did you mean match?)'),
    ('match a b --disparites=64', 'fuzzy-stereo match: unrecognized arguments: --disparites (did '
     'you mean --disparities?)'),
    (MATCH + '8 --xyzzy 3', 'fuzzy-stereo match: unrecognized arguments: --xyzzy 3\n'),
    # ---- match, suggest ----
    (MATCH + 'many', "'many' is no whole number, nor auto"),
    (MATCH + '16 --mutation-rate 2', 'mutation_rate is 2.0; allowed are numbers from 0'),
    (MATCH + 'auto --min-disparity 3', 'leave out --min-disparity'),
    (MATCH + '81', '81 disparities are more than the 80 columns'),
    # What a terminal would obey is escaped.
    ('match left.png \x1b[31mé.png', 'fuzzy-stereo: \\x1b[31mé.png cannot be read: No such file'),
    ('match left.png small.png', 'left.png is 80x48 and small.png is 79x48'),
    ('match frames/left frames/right', 'fuzzy-stereo replay frames/left frames/right --output'),
    (MATCH + '16 --output folder.pfm', 'folder.pfm is a folder; name a file'),
    (MATCH + '16 --output left.png', 'which is also an input'),
    (MATCH + '16 --ground-truth small.png --ground-truth-scale 4',
     'small.png is 79x48, the images are 80x48'),
    (MATCH + '16 --depth depth.pfm', '--depth needs a baseline: give --calibration, or --focal'),
    (MATCH + '16 --points a.ply --focal 100 --baseline 1 --reference right',
     '--points is of the left image; leave out --reference'),
    (MATCH + '16 --mask visible.png', '--mask needs --ground-truth'),
    (MATCH + '16 --rectify', '--rectify and --crop need the calibration of both'),
    ('match left.png --saved report', TAKEN), ('match --disparities 24 --saved report', TAKEN),
    ('suggest left.png right.png --unit mm', '--unit is that of the lengths in --calibration'),
    # ---- evolve ----
    (EVOLVE + '16 --picture there.png', '--picture is there.png, which exists; give --overwrite'),
    ('evolve frames/left frames/right --picture frames/left/left_0.png --overwrite',
     'frames/left/left_0.png, which is also an input'),
    (EVOLVE + '16 --picture out.jpg', 'allowed are .png, .pdf, .svg'),
    (EVOLVE + '81 --video a.mp4 --picture a.png', '81 disparities are more than the 80 columns'),
    # ---- benchmark, synthesise ----
    ('benchmark --repeats 0', '--repeats is 0; allowed are 1 and more'),
    ('synthesise --output scene2 --columns 20', 'disparities is 64; allowed are 1 to the 20 col'),
    ('synthesise --output no/scene', 'but there is no folder'),
    ('synthesise --output a.npy', 'which is a file; name a folder'),
    # ---- convert ----
    ('convert a.npy b.pfm --to depth', 'depth from disparity needs the cameras: give --focal and '
     '--baseline, or --calibration with'),
    ('convert a.npy b.ply --focal 0 --baseline 1', '--focal is 0; allowed are numbers above 0'),
    ('convert a.npy b.ply --calibration calib.txt --focal 3',
     '--focal is part of --calibration already'),
    ('convert a.npy b.ply --calibration calib.txt',
     'calib.txt is of 9x5 pixels, but the images have 4x2'),
    ('convert a.npy b.ply --focal 1 --baseline 1 --image small.png',
     'small.png is 79x48, but there are'),
    ('convert a.npy b.pfm --image small.png', '--image is for the colours of .ply, but b.pfm'),
    ('convert a.npy depth.png --calibration calib.txt', '--calibration has no effect: depth.png '
     'is to hold disparity, as a.npy does; give --to depth, or leave it out'),
    ('convert a.npy b.ply --to depth', 'b.ply cannot hold depth'),
    ('convert a.ply b.npy', 'a.ply is a point cloud, which has no pixels; convert'),
    ('convert a.npy b.tiff', "b.tiff has the suffix '.tiff'; allowed are .pfm, .npy, .png, and "
     '.ply for points'),
    ('convert a.npy no/b.npy', 'no/b.npy cannot be written: there is no folder no'),
    ('convert a.npy there.png', 'there.png exists; give --overwrite to replace it'),
    ('convert a.npy ./a.npy --overwrite', 'a.npy is an input too'),
    ('convert a.npy b.pfm --scale 4', 'a.npy holds values already; a scale is for images'),
    ('convert small.png b.pfm --from depth',
     'small.png has 8 bits: give the scale, the grey levels of one metre'),
    ('convert far.npy b.png', 'a disparity of 300 px does not fit into a KITTI .png'),
    # ---- evaluate ----
    ('evaluate scene --matcher magic', "matcher is 'magic'; allowed are ours, ours:realtime"),
    ('evaluate scene --matcher', 'no matcher is named'),
    ('evaluate scene --truth-scale -2', '--truth-scale is -2.0; allowed are numbers above 0'),
    ('evaluate scene --csv out.txt', "out.txt has the suffix '.txt'; allowed are .csv"),
    ('evaluate scene --results no', '--results names no, but there is no such folder'),
    ('evaluate scene --results empty', 'empty has no result of any scene; name the one of scene '
     'empty/scene.pfm, .npy or .png'),
    ('evaluate scene --results short', 'short/scene.pfm is 72x39, the images of scene are 72x40'),
    ('evaluate scene --results grey', 'grey/scene.png has 8 bits; results are'),
    ('evaluate scene --results many', 'many/scene has 2 files that end with .npy'),
    ('evaluate scene --results ours=good', "two matchers have the name 'ours'"),
    # ---- replay: topics, parts and cameras of a bag ----
    ('replay bag --output out --left nothing', '--left is /nothing, which is no topic of images '
     'in bag; there are /left/image_rect, /right/image_rect'),
    ('replay bag --output out --keep /nothing', '--keep names /nothing, which is not in bag; '
     'there are /left/camera_info, /left/image_rect, /right/camera_info, /right/image_rect'),
    ('replay bag --output out --start 5', '--start is 5; bag is 0.167 s long'),
    ('replay bag --output out --start -1', '--start is -1; bag is 0.167 s long'),
    ('replay bag --output out --duration 0', '--duration is 0; allowed are numbers above 0'),
    ('replay bag --output out --every 0', '--every is 0; allowed are whole numbers from 1'),
    ('replay bag --video video.avi', '--output is missing; give a new folder for the results'),
    ('replay bare --output out --with depth', 'bare, without camera_info beside /left/image_rect '
     'and /right/image_rect, needs the cameras: give --focal and --baseline, or --calibration '
     'with a calibration file'),
    ('replay bag --output out --focal 200', 'a calibration that is not that of the bag needs the '
     'cameras: give --baseline'),
    ('replay bare --output out --focal 200 --baseline 1 --rectify', '--rectify and --crop need '
     'the calibration of both raw cameras: those of a bag, or --calibration with files of both'),
    # ---- replay: outputs and values ----
    ('replay bag --output out --format none', '--format none leaves no output; give --files or '
     '--video'),
    ('replay bag --output out --format none --files npy --keep', '--keep copies topics into a '
     'bag, but --format none writes none; leave one of the two out'),
    ('replay bag --output out --format none --files npy --with points2', '--with adds topics to a '
     'bag, but --format none writes none; leave one of the two out'),
    ('replay bag --output out --files png --min-disparity -3', '--files png holds 0 to 255 px'),
    ('replay bag --output out --files png --min-disparity 250', '--files png holds 0 to 255 px'),
    ('replay bag --output out --video before.avi', '--video is before.avi, which exists; give '
     'another file, or --overwrite'),
    ('replay film.mp4 --format none --video film.mp4 --overwrite', '--video is film.mp4, which is '
     'of the input film.mp4; give another file'),
    ('replay frames --output out --video frames/left/left_0.png --overwrite', '--video '
     'is frames/left/left_0.png, which is of the input frames; give another file'),
    ('replay bag --output out --video before.avi --resume', '--resume cannot continue before.avi; '
     'leave out --video, or start over with --overwrite'),
    ('replay bag --output out --format none --video a.avi --resume', '--resume continues a bag or '
     '--files; there is neither'),
    ('replay bag --output out --scale 0.3', 'scale is 0.3; allowed are 1, 0.5, 0.25'),
    # ---- replay: frames and workers ----
    ('replay frames/left names --output out', 'frames/left and names: names as left_0 and a do '
     'not tell which images belong together; give those of a pair one name, number or time'),
    ('replay names --output out', 'names has no folders left and right, and no images that are '
     'named by their camera (left_0.png and right_0.png); name two folders'),
    ('replay frames/left frames/right names --output out', 'two folders, videos or patterns in '
     'quotes'),
    ('replay film.mp4 --output out', 'film.mp4 is not a video that OpenCV can read'),
    ('replay film.mp4 frames/left --output out', 'one is a video, the other is not'),
    ('replay frames/left no*.png --output out', 'no*.png has no images (.png, '),
    ('replay frames --output out --keep', '--keep names topics of a bag'),
    ('replay frames --output out --rate 0', '--rate is 0; allowed are 0.001 to 100000'),
    ('replay frames --output out --rate 1e-300', '--rate is 1e-300; allowed are 0.001 to'),
    ('replay frames --output out --rate inf', '--rate is inf; allowed are 0.001 to 100000'),
    ('replay bag --output out --workers 2 --scheduler tcp://127.0.0.1:1', '--workers starts '
     'workers, --scheduler uses those of a cluster: give one of them'),
    # ---- python -m bench ----
    ('bench fast', 'invalid choice'), ('bench speed --quick --repeats 0', '--repeats is 0'),
    ('bench speed --quick --only middv2', "--only is 'middv2'"),
    ('bench speed --quick --python no_python', "--python is 'no_python'"),
    ('bench accuracy --only nothing', "--only is 'nothing'"),
    ('bench accuracy --data nowhere', 'no folder nowhere'),
    ('bench accuracy --output page.html', 'suffix'),
    ('bench accuracy --population 0', 'population is 0')]


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return a folder with what the commands read, and with what is in the way."""
    made_bags = pytest.importorskip('made_bags', reason='rosbags is not installed')
    folder, made, scene = tmp_path_factory.mktemp('files'), make_pair(48, 80, 16, seed=3), pair()
    for name in ('folder.pfm', 'folder.csv', 'empty', 'good', 'short', 'grey', 'many/scene'):
        (folder / name).mkdir(parents=True)
    write_images(folder, made, 'left.png', 'right.png')
    for name, image in {'small': made.right[:, :-1], 'visible': 255 * made.visible,
                        'grey/scene': np.zeros(scene.truth.shape)}.items():
        write_image(folder / f'{name}.png', image.astype(np.uint8))
    for name, disparity in {
            'a.npy': np.ones((2, 4)), 'far.npy': np.full((2, 4), 300.0),
            'good/scene.pfm': scene.truth, 'short/scene.pfm': scene.truth[1:],
            'many/scene/a.npy': scene.truth, 'many/scene/b.npy': scene.truth}.items():
        write_disparity(folder / name, disparity)
    write_middlebury_calibration(
        folder / 'calib.txt', centred_calibration(1.0, 1.0, 0.0, 5, 9), (5, 9), 0, 8)
    write_named(folder / 'scene', scene)
    for name in ('film.mp4', 'before.avi', 'there.png'):
        (folder / name).write_text('the one before')
    made_bags.write_bag(folder / 'bag')
    made_bags.write_bag(folder / 'bare', infos=False)
    for number, frame in enumerate(made_bags.scene(2)):
        write_images(folder / 'frames', frame, *(
            f'{side}/{side}_{number}.png' for side in ('left', 'right')))
    (folder / 'names').mkdir()
    write_image(folder / 'names' / 'a.png', np.zeros((4, 4), np.uint8))
    return folder


@pytest.mark.parametrize('words, sentence', SENTENCES, ids=[words for words, _ in SENTENCES])
def test_what_makes_no_sense_is_rejected_in_one_sentence(
        files, monkeypatch, capsys, words, sentence):
    monkeypatch.chdir(files)
    for command in (evolve, match):
        monkeypatch.setattr(command, 'StereoMatcher', None)
    name, *rest = words.split()
    told = rejection(capsys, *(rest if name == 'bench' else [name, *rest]),
                     run=bench if name == 'bench' else main)
    assert sentence in told


# What is not installed, a command that needs it, its extra, and a command that does not.
@pytest.mark.parametrize('names, words, extra, others', [
    (['pandas'], 'evaluate scene', 'evaluate', ''),
    (['jinja2'], 'evaluate scene --html page.html', 'evaluate',
     'evaluate scene --repeats 1 --matcher opencv:bm'),
    (['matplotlib'], EVOLVE + '16 --picture a.png', 'matplotlib', EVOLVE + '16'),
    (['distributed'], 'replay bag --output out --workers 2', 'cluster', ''),
    (ROSBAGS, 'replay bag --output out', 'bags', ''),
    (ROSBAGS, 'replay frames --output out', 'bags',
     'replay frames --format none --output {} --files npy --disparities 16'),
    (ROSBAGS, 'synthesise --output out --format bag', 'bags', 'synthesise --output {} --rows 9')])
def test_a_library_that_is_not_installed_is_asked_for_where_it_is_needed_alone(
        files, tmp_path, monkeypatch, capsys, names, words, extra, others):
    monkeypatch.chdir(files)
    for name in ('summary', 'report'):      # imported anew
        monkeypatch.delitem(sys.modules, f'fuzzy_stereo_ros.evaluation.{name}', raising=False)
    for name in names:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(evolve, 'find_spec', {'matplotlib': None}.get)
    assert main(words.split()) == 2
    assert re.search(f'not installed: pip install .*{extra}', capsys.readouterr().err)
    assert not others or main(others.format(tmp_path / 'out').split()) == 0
