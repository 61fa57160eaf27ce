# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever ends a replay, what was matched is a bag, it says up to where, and can go on."""
from contextlib import contextmanager
import errno
import json
import os
import signal

from fuzzy_stereo_ros.bags import writing as bag_writing
from fuzzy_stereo_ros.bags.writing import BagWriter, UNFINISHED
from fuzzy_stereo_ros.commands import replay as command
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.replay import sinks as replay_sinks
from fuzzy_stereo_ros.replay.loop import interruption
from fuzzy_stereo_ros.replay.options import WARM_PAIRS
from fuzzy_stereo_ros.replay.report import ProgressBar
from fuzzy_stereo_ros.replay.sinks import BagSink
from fuzzy_stereo_ros.synthetic.scenes import make_sequence
from made_bags import (
    BEGIN, COLUMNS, content, DISPARITIES, disparities, ROWS, scene, stamps, STEP, TOPICS,
    write_bag, write_torn_bag)
import numpy as np
import pytest
from replayed import figures, INTERRUPTED, matches, rejection, replay, RESTRICTED, run, TERMINATED


@pytest.fixture
def bag(folder):
    write_bag(folder / 'bag')


@pytest.fixture
def interrupted(monkeypatch):
    """Return a function that runs a replay which gets a signal after so many pairs."""
    def interrupted(pairs, number=signal.SIGINT, code=INTERRUPTED, **options):
        steps = []

        def step(bar):
            steps.append(None)
            if len(steps) == pairs:
                os.kill(os.getpid(), number)

        with monkeypatch.context() as patch:
            patch.setattr(ProgressBar, 'step', step)
            assert replay('bag', **options) == code

    return interrupted


def chatter(bag, number, log_time):
    """Write what may be copied: two messages before each pair."""
    for part in range(2):
        bag.write('/chatter', bag.make('std_msgs/msg/Int32', data=2 * number + part), log_time)


def equal(one, other):
    """Return whether two {stamp: disparities} are the same bit for bit, in the same order."""
    return list(one) == list(other) and all(
        np.array_equal(one[stamp], other[stamp]) for stamp in one)


def chain(pairs, first):
    """Return what the matcher finds from a pair on, as the DisparityImages have it."""
    return [np.where(np.isnan(match.disparity), -1, np.maximum(match.disparity, 0))
            for match in matches(pairs[first:], stamps(len(pairs))[first:])]


@pytest.mark.parametrize(('storage', 'number', 'code'), [
    ('mcap', signal.SIGINT, INTERRUPTED), ('sqlite3', signal.SIGTERM, TERMINATED)])
def test_an_interrupted_replay_is_a_bag_and_continues_to_the_same_bits(
        folder, capsys, interrupted, storage, number, code):
    write_bag(folder / 'bag', pairs=scene(8), more=chatter)
    options = ['--format', storage, '--keep', '/chatter', '--with', 'confidence']
    assert replay('bag', output='whole', options=options) == 0
    interrupted(5, number, code, options=options)
    assert 'interrupted: out holds 5 pairs, up to 0.140 s into the bag; --resume continues' in \
        capsys.readouterr().err
    whole = disparities(folder / 'whole')
    assert equal(disparities(folder / 'out'), {stamp: whole[stamp] for stamp in stamps(5)})
    found = figures(capsys, 'bag', options=[*options, '--resume'])
    assert (found['pairs']['matched'], found['pairs']['matched_again']) == (3, 5)
    assert equal(disparities(folder / 'out'), whole)
    written, expected = (
        [(topic, log_time) for topic, log_time, _ in content(folder / name)]
        for name in ('out', 'whole'))
    assert written == expected


def test_a_resumed_replay_is_warm_from_a_few_pairs_before(folder, capsys, interrupted):
    pairs = scene(WARM_PAIRS + 8)
    write_bag(folder / 'bag', pairs=pairs)
    interrupted(WARM_PAIRS + 4)
    assert replay('bag', options=['--resume']) == 0
    assert f'4 pairs matched, {WARM_PAIRS} matched again to warm up' in \
        capsys.readouterr().out
    found = disparities(folder / 'out')
    assert list(found) == stamps(len(pairs))
    for values, expected in zip(list(found.values())[-4:], chain(pairs, 4)[-4:], strict=True):
        np.testing.assert_array_equal(values, expected)


def looped(number, messages):
    """Give the pairs of every other 20 the stamps of the first ones, as where a bag was looped."""
    stamp = BEGIN + number % 20 * STEP
    for message in messages.values():
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)


@pytest.mark.parametrize('in_segments', [False, True])
def test_a_looped_recording_goes_on_in_the_round_it_was_interrupted_in(
        folder, capsys, interrupted, in_segments):
    pairs = [pair for seed in range(3) for pair in make_sequence(
        ROWS, COLUMNS, DISPARITIES, 20, seed=seed, noise=6.0)]
    write_bag(folder / 'bag', pairs=pairs, change=looped)
    options = ['--files', 'npy', *(['--workers', 1] if in_segments else [])]
    forms = [], ['--format', 'none']
    for number, form in enumerate(forms):
        assert replay('bag', output=f'whole{number}', options=[*options, *form]) == 0
        interrupted(45, output=f'out{number}', options=[*options, *form])
        foreign = folder / f'out{number}' / 'disparity' / 'mine.npy'
        foreign.write_text("not a replay's")
        found = figures(capsys, 'bag', output=f'out{number}', options=[
            *options, *form, '--resume'])
        foreign.unlink()
        assert found['pairs']['matched'] == 15
        assert found['pairs']['matched_again'] >= WARM_PAIRS
        files, expected = (
            {path.name: path.read_bytes() for path in (folder / name / 'disparity').iterdir()}
            for name in (f'out{number}', f'whole{number}'))
        assert files == expected and len(files) == 60
    written, expected = (
        [(topic, log_time, bytes(message.image.data)) for topic, log_time, message
         in content(folder / name, '/disparity')] for name in ('out0', 'whole0'))
    assert written == expected and len(written) == 60


@pytest.mark.parametrize('content', ['{', '{}', '[1]', '[["a", 1]]', '[[1, 2, 3]]'])
def test_a_damaged_progress_of_files_is_rejected(folder, bag, capsys, interrupted, content):
    options = ['--files', 'npy', '--format', 'none']
    interrupted(3, options=options)
    (folder / 'out' / 'progress.json').write_text(content)
    assert 'progress.json is damaged' in rejection(capsys, 'bag', options=[*options, '--resume'])


def test_no_link_that_was_put_into_an_output_is_followed(folder, bag, capsys, interrupted):
    (folder / 'elsewhere').mkdir()
    (folder / 'elsewhere' / 'letter.txt').write_text('dear')
    for options, name in (['--files', 'npy'], 'disparity'), ([], UNFINISHED):
        interrupted(3, options=[*options, '--overwrite'])
        place = folder / 'out' / name
        if place.exists():
            place.rename(folder / 'before')
        place.symlink_to('../elsewhere')
        if name == UNFINISHED:
            assert replay('bag', options=['--resume']) == 0
            assert list(disparities(folder / 'out')) == stamps(6)
        else:
            assert rejection(capsys, 'bag', options=[*options, '--resume']) == (
                'out/disparity is a symbolic link, which is not followed; remove it, or start '
                'over with --overwrite')
    assert [path.name for path in (folder / 'elsewhere').iterdir()] == ['letter.txt']


def test_a_complete_replay_that_is_resumed_has_nothing_to_do(folder, bag, capsys):
    assert replay('bag') == 0
    before = [(path.name, path.stat().st_mtime_ns) for path in (folder / 'out').glob('*.mcap')]
    assert figures(capsys, 'bag', options=['--resume'])['pairs']['matched'] == 0
    assert [(path.name, path.stat().st_mtime_ns)
            for path in (folder / 'out').glob('*.mcap')] == before


def test_an_interruption_before_the_first_pair_leaves_nothing(folder, bag, capsys, monkeypatch):

    @contextmanager
    def interrupted():
        with interruption() as came:
            os.kill(os.getpid(), signal.SIGINT)
            yield came

    monkeypatch.setattr(command, 'interruption', interrupted)
    assert replay('bag') == INTERRUPTED
    assert 'interrupted before the first pair' in capsys.readouterr().err
    assert {path.name for path in folder.iterdir()} == {'bag'}


def test_an_interruption_while_kernels_are_compiled_ends_at_once(folder, bag, monkeypatch):
    monkeypatch.setattr(StereoMatcher, 'warm_up',
                        lambda *arguments: os.kill(os.getpid(), signal.SIGINT))
    assert replay('bag') == INTERRUPTED
    assert {path.name for path in folder.iterdir()} == {'bag'}


def test_a_second_interruption_ends_at_once_and_leaves_a_bag(folder, bag, capsys, monkeypatch):

    def step(bar):
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(ProgressBar, 'step', step)
    assert replay('bag') == INTERRUPTED
    assert list(disparities(folder / 'out')) == stamps(1)


def test_interruptions_while_the_last_pair_is_written_leave_a_bag(folder, bag, monkeypatch):
    add, added = BagSink.add, []

    def interrupting(sink, matched, log_time):
        added.append(None)
        if len(added) >= 3:
            os.kill(os.getpid(), signal.SIGINT)
        add(sink, matched, log_time)

    monkeypatch.setattr(BagSink, 'add', interrupting)
    assert replay('bag') == INTERRUPTED
    assert not (folder / 'out' / UNFINISHED).exists()
    assert list(disparities(folder / 'out')) == stamps(len(added))


def test_an_interruption_while_the_command_is_loaded_is_no_traceback(folder):
    ended = run(LOADING, 'fuzzy_stereo_ros.commands.replay', 'bag')
    assert (ended.returncode, ended.stderr) == (INTERRUPTED, '')


@pytest.mark.parametrize(('form', 'length'), [
    ('ros1', 60_000), ('mcap', 60_000), ('sqlite3', 9000)])
def test_a_damaged_bag_is_matched_up_to_the_damage(folder, capsys, form, length):
    path = folder / ('bag.bag' if form == 'ros1' else 'bag')
    write_torn_bag(path, scene(60, rows=120, columns=240), 30, form, skipped=9000, length=length)
    sentence = rejection(capsys, path.name)
    found = disparities(folder / 'out')
    assert 10 < len(found) <= 30
    assert list(found) == stamps(len(found))
    assert sentence.startswith(f'{path.name} is damaged: ')
    seconds = (STEP * (len(found) - 1) + 3) / 1e9
    assert sentence.endswith(f'; out holds {len(found)} pairs, up to {seconds:.3f} s into the bag')


@pytest.mark.parametrize(('form', 'name'), [
    ('ros1', 'bag.bag'), ('mcap', 'bag/bag.mcap'), ('sqlite3', 'bag/bag.db3')])
def test_of_a_recording_that_was_cut_off_all_pairs_before_that_are_matched(
        folder, capsys, form, name):
    pairs = scene(60, rows=120, columns=240)
    path = write_bag(folder / name.split('/')[0], form, pairs)
    whole = (folder / name).read_bytes()
    (folder / name).write_bytes(whole[:len(whole) // 2])
    assert replay(path.name) == 0
    found, printed = disparities(folder / 'out'), capsys.readouterr()
    assert 28 <= len(found) <= 30
    assert equal(found, dict(zip(stamps(60), chain(pairs[:len(found)], 0))))
    words = f'{name} was cut off: its '
    assert words in printed.err and words in printed.out
    loss, = figures(capsys, path.name, output='other')['losses']
    assert loss in printed.err.splitlines() and loss in printed.out.splitlines()


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_damaged_output_is_not_continued(folder, capsys, interrupted, storage):
    write_bag(folder / 'bag', pairs=scene(20))
    interrupted(15, options=['--format', storage])
    file, = (folder / 'out').glob('out_0.*')
    whole = file.read_bytes()
    file.write_bytes(whole[:len(whole) * 3 // 4])
    assert rejection(capsys, 'bag', options=['--format', storage, '--resume']).endswith(
        'any later ones are lost; start over with --overwrite')


LOADING = """\
import os, signal, sys
class Finder:
    def find_spec(name, path, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder)
from fuzzy_stereo_ros.commands.command_line import main
sys.exit(main(sys.argv[2:]))
"""
KILLED = """\
import os, signal, sys
from fuzzy_stereo_ros.bags import writing
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.replay.report import ProgressBar
steps = []
def step(bar):
    steps.append(None)
    if len(steps) == int(sys.argv[1]):
        os.kill(os.getpid(), signal.SIGKILL)
ProgressBar.step = step
writing.PART_BYTES = 2**20
main(sys.argv[2:])
"""


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_full_disk_is_reported_and_the_replay_continues_later(
        folder, capsys, monkeypatch, storage):
    write, written = BagWriter._write, []

    def limited(writer, *arguments):
        written.append(None)
        if len(written) > 40:
            raise OSError(errno.ENOSPC, 'No space left on device')
        write(writer, *arguments)

    pairs = scene(30, rows=120, columns=240)
    write_bag(folder / 'bag', pairs=pairs)
    options = ['--format', storage]
    monkeypatch.setattr(bag_writing, 'PART_BYTES', 2**20)
    monkeypatch.setattr(BagWriter, '_write', limited)
    sentence = rejection(capsys, 'bag', options=options)
    left = len(disparities(folder / 'out'))
    assert 10 < left < 20
    assert sentence.startswith('out cannot be written any further: No space left on device')
    assert f'; out holds {left} pairs, up to ' in sentence
    monkeypatch.setattr(BagWriter, '_write', write)
    assert replay('bag', options=[*options, '--resume']) == 0
    assert list(disparities(folder / 'out')) == stamps(30)
    assert len(content(folder / 'out', '/preview')) == 30


def test_a_replay_that_was_killed_early_continues(folder, bag):
    assert run(KILLED, 3, 'bag').returncode == -signal.SIGKILL
    assert replay('bag', options=['--resume']) == 0
    assert list(disparities(folder / 'out')) == stamps(6)


def test_a_killed_replay_continues_after_its_last_complete_part(folder, capsys):
    pairs = scene(30, rows=120, columns=240)
    write_bag(folder / 'bag', pairs=pairs, more=chatter)
    assert run(KILLED, 20, 'bag', '--keep', '/chatter').returncode == -signal.SIGKILL
    assert (folder / 'out' / UNFINISHED).exists()
    found = figures(capsys, 'bag', options=['--resume', '--keep', '/chatter'])
    assert found['pairs']['matched_again'] == WARM_PAIRS
    written = content(folder / 'out')
    assert list(disparities(folder / 'out')) == stamps(30)
    for topic, number in (('/disparity', 30), ('/preview', 30), ('/chatter', 60)):
        times = [log_time for name, log_time, _ in written if name == topic]
        assert len(times) == number, topic
        assert times == sorted(times)
    assert [message.data for name, _, message in written if name == '/chatter'] == list(range(60))


def test_a_disk_that_is_full_for_files_ends_it_with_a_sentence(folder, bag, capsys):
    ended = run(RESTRICTED, 10_000, 'bag', '--files', 'npy', '--format', 'none')
    assert ended.returncode == 2
    *before, last = ended.stderr.splitlines()
    assert [line for line in before if 'compiled kernels' not in line] == []
    assert last == 'fuzzy-stereo: File too large; 0 pairs were written to out'
    assert list((folder / 'out').glob('disparity/*')) == []


@pytest.mark.parametrize(('options', 'suffix'), [
    (['npy'], 'npy'), (['npy', 'pfm', '--format', 'none'], 'pfm')])
def test_a_pair_that_lacks_a_file_is_matched_again(
        folder, bag, capsys, monkeypatch, options, suffix):
    def without_room(path, disparity):
        if path.suffix == f'.{suffix}' and path.stem == f'{stamps()[3]:019d}':
            raise OSError(errno.ENOSPC, 'No space left on device')
        write_disparity(path, disparity)

    monkeypatch.setattr(replay_sinks, 'write_disparity', without_room)
    assert 'No space left on device' in rejection(capsys, 'bag', options=['--files', *options])
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert replay('bag', options=['--files', *options, '--resume']) == 0
    assert sorted(path.stem for path in (folder / 'out').glob(f'disparity/*.{suffix}')) == [
        f'{stamp:019d}' for stamp in stamps()]


def test_options_that_differ_from_those_of_before_are_rejected(folder, bag, capsys, interrupted):
    interrupted(3)
    record = json.loads((folder / 'out' / 'replay.json').read_text())
    assert (record['bags'], record['left']) == (['bag'], TOPICS[0])
    sentence = rejection(capsys, 'bag', disparities=20, options=[
        '--resume', '--every', 2, '--queue-size', 9])
    assert sentence == ('--resume needs the options of the first run; different are every (1, '
                        'now 2), queue_size (5, now 9), disparities (16, now 20)')
    assert figures(capsys, 'bag', options=['--resume', '--threads', 1])['pairs']['matched'] == 3


def test_a_bag_in_which_the_last_pairs_are_missing_is_rejected(folder, bag, capsys, interrupted):
    interrupted(3)
    (folder / 'other').mkdir()
    write_bag(folder / 'other' / 'bag', first=20)
    assert rejection(capsys, 'other/bag', options=['--resume']) == (
        '--resume: the last pairs in out are not in other/bag')
    assert list(disparities(folder / 'out')) == stamps(3)


def test_an_output_is_replaced_only_where_it_is_one_and_that_is_asked_for(folder, bag, capsys):
    write_bag(folder / 'short', pairs=scene(2))
    assert replay('bag') == 0
    assert rejection(capsys, 'short') == (
        'out exists; give another folder, --overwrite or --resume')
    assert len(disparities(folder / 'out')) == 6
    assert replay('short', options=['--overwrite']) == 0
    assert len(disparities(folder / 'out')) == 2
    (folder / 'mine').mkdir()
    (folder / 'mine' / 'letter.txt').write_text('dear')
    for options in ([], ['--overwrite'], ['--resume']):
        assert 'mine exists' in rejection(capsys, 'bag', output='mine', options=options)
    assert (folder / 'mine' / 'letter.txt').read_text() == 'dear'
    (folder / 'mine' / 'letter.txt').unlink()
    assert replay('bag', output='mine') == 0
    assert '--resume finds nothing to continue in new' in rejection(
        capsys, 'bag', output='new', options=['--resume'])
    assert 'give one of them' in rejection(capsys, 'bag', options=['--resume', '--overwrite'])
    assert 'there is no folder missing' in rejection(capsys, 'bag', output='missing/out')


def test_replacing_an_output_leaves_alone_what_others_put_beside_it(folder, bag):
    write_bag(folder / 'short', pairs=scene(2))
    options = ['--files', 'npy', '--overwrite']
    assert replay('bag', options=[*options, '--format', 'sqlite3']) == 0
    (folder / 'out' / 'notes').mkdir()
    (folder / 'out' / 'notes' / 'letter.txt').write_text('dear')
    assert replay('short', options=options) == 0
    assert (folder / 'out' / 'notes' / 'letter.txt').read_text() == 'dear'
    assert {path.name for path in (folder / 'out').iterdir()} == {
        'calibration.json', 'disparity', 'metadata.yaml', 'notes', 'out_0.mcap', 'replay.json'}
    assert len(list((folder / 'out' / 'disparity').iterdir())) == 2


@pytest.mark.parametrize('output', ['.', '../link'])
def test_an_output_may_be_the_folder_one_is_in_or_a_link(folder, bag, capsys, monkeypatch, output):
    write_bag(folder / 'bad', change=lambda number, messages: setattr(
        messages[TOPICS[0]], 'encoding', 'nonsense'))
    (folder / 'place').mkdir()
    (folder / 'link').symlink_to('place')
    monkeypatch.chdir(folder / 'place')
    rejection(capsys, '../bad', output=output)
    assert list((folder / 'place').iterdir()) == []
    for options in ([], ['--overwrite'], ['--resume']):
        assert replay('../bag', output=output, options=options) == 0
        assert {path.name for path in (folder / 'place').iterdir()} == {
            'metadata.yaml', 'place_0.mcap', 'replay.json'}
        assert list(disparities(folder / 'place')) == stamps()


def test_an_output_never_replaces_an_input(folder, bag, capsys):
    assert replay('bag', options=['--keep']) == 0
    assert rejection(capsys, 'out', options=['--overwrite']) == (
        '--output is out, which holds the input out')
    assert rejection(capsys, 'out/out_0.mcap', options=['--overwrite']) == (
        '--output is out, which holds the input out/out_0.mcap')


@pytest.mark.parametrize('content', ['{', '[1]', '[' * 100_000])
def test_a_damaged_record_is_rejected(folder, bag, capsys, content):
    assert replay('bag') == 0
    (folder / 'out' / 'replay.json').write_text(content)
    assert 'replay.json is damaged; start over with --overwrite' in rejection(
        capsys, 'bag', options=['--resume'])
