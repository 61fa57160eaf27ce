# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever ends a replay, what was matched is a bag, it says up to where, and can go on."""
import errno
from functools import partial
import json
import os
import signal

from command_output import contents
from fuzzed import examples
from fuzzy_stereo_ros.bags import writing as bag_writing
from fuzzy_stereo_ros.bags.writing import BagWriter, FORMATS, METADATA, UNFINISHED
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.pairs.disparity_files import write_disparity
from fuzzy_stereo_ros.replay import sinks as replay_sinks
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from fuzzy_stereo_ros.replay.report import ProgressBar
from fuzzy_stereo_ros.replay.sinks import BagSink, Outputs
from hypothesis import given, settings, strategies as st
from made_bags import (
    BEGIN, content, disparities, scene, stamps, STEP, TOPICS, write_bag, write_torn_bag)
import pytest
from replayed import (
    as_sent, assert_same, chatter, figures, in_segments, INTERRUPTED, matches, rejection, replay,
    restamp, run, sent)


@pytest.fixture
def bag(folder):
    write_bag(folder / 'bag')


@pytest.fixture
def interrupted(monkeypatch):
    """Return a function that runs a replay which gets a signal after so many pairs."""
    def interrupted(pairs, number=signal.SIGINT, code=INTERRUPTED, bag='bag', **options):
        steps = []

        def step(bar):
            steps.append(None)
            if len(steps) == pairs:
                os.kill(os.getpid(), number)

        with monkeypatch.context() as patch:
            patch.setattr(ProgressBar, 'step', step)
            assert replay(bag, **options) == code

    return interrupted


ROUND = 14      # pairs, after which a recording that loops begins again with its stamps
SIGNALS = {'interrupted': [signal.SIGINT, signal.SIGTERM], 'full disk': [],
           'killed': [signal.SIGKILL], 'interrupted with its workers': [signal.SIGINT]}
STRUCK = """\
import os, sys
from fuzzy_stereo_ros.bags import writing
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.replay.report import ProgressBar
steps = []
def step(bar):
    steps.append(None)
    if len(steps) == int(sys.argv[1]):
        os.killpg(0, %d)
if __name__ == '__main__':
    ProgressBar.step = step
    writing.PART_BYTES = 2**18
    sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize('how', SIGNALS)
def test_whatever_ends_a_replay_what_was_matched_is_a_bag_and_continues_to_what_the_rest_would_be(
        folder, capsys, monkeypatch, interrupted, how):
    """Copies, files and the confidence too; in segments bit for bit, else warm again."""
    segmented, others = 'workers' in how, how in ('killed', 'interrupted with its workers')
    every = scene(SEGMENT_PAIRS + 20 if segmented else 2 * ROUND - 6)
    monkeypatch.setattr(bag_writing, 'PART_BYTES', 2**18)       # of several pairs
    times = {'bag': stamps(len(every)), 'looped': [
        BEGIN + number % ROUND * STEP for number in range(len(every))]}

    def stamped(name, number, messages):
        restamp(messages, times[name][number])

    for name in times:
        write_bag(folder / name, pairs=every, more=chatter, change=partial(stamped, name))

    def written(name):
        found = content(folder / name) if (folder / name / METADATA).exists() else []
        return [one[:2] for one in found], sent(folder / name) if found else []

    def end(name, pairs, options):
        if others:
            return run(STRUCK % SIGNALS[how][0], pairs, name, *options, *segmented * (
                '--workers', 2)).stderr
        if how == 'full disk':
            write, room = BagWriter._write, iter(range(5 * pairs))

            def limited(*given):
                if next(room, None) is None:
                    raise OSError(errno.ENOSPC, 'No space left on device')
                write(*given)

            with monkeypatch.context() as patch:
                patch.setattr(BagWriter, '_write', limited)
                return rejection(capsys, name, options=options)
        for number in SIGNALS[how]:
            interrupted(pairs, number, 128 + number, bag=name, options=options)
        return capsys.readouterr().err

    @settings(examples(2 if others else 4), deadline=None)
    @given(st.sampled_from(FORMATS), st.sampled_from([*times]), st.integers(2, len(every) - 1),
           st.sampled_from([[], ['--files', 'npy']]))
    def ends(storage, name, pairs, files):
        options = ['--format', storage, '--keep', '/chatter', '--with', 'confidence', *files]
        assert replay(name, output='whole', options=[*options, '--overwrite']) == 0
        (topics, whole), said = written('whole'), end(name, pairs, [*options, '--overwrite'])
        left = len(written('out')[1])
        assert (left <= pairs) if how in ('killed', 'full disk') else left == pairs
        if how != 'killed' and left:
            assert f'out holds {left} pairs, up to ' in said
        if how == 'full disk':
            assert 'out cannot be written any further: No space left on device' in said
        found = figures(capsys, name, options=[
            *options, *segmented * ('--workers', 1), '--resume' if left else '--overwrite'])
        assert found['pairs']['matched'] == len(every) - left
        again, values = written('out')
        first = max(left - WARM_PAIRS, 0)
        expected = in_segments(every, times[name]) if segmented else whole[:left] + as_sent(
            matches(every[first:], times[name][first:]))[left - first:]
        assert again == topics and len(values) == len(every)
        assert_same(values, expected)
        assert not files or len([*(folder / 'out' / 'disparity').iterdir()]) == len(every)

    ends()


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


@pytest.mark.parametrize(('owner', 'name', 'first', 'words'), [
    (StereoMatcher, 'warm_up', 1, ''),      # while kernels are compiled
    (Outputs, 'written_positions', 1, 'interrupted before the first pair'),
    (BagSink, 'add', 3, '')], ids=['before', 'first pair', 'last pair and again'])
def test_interruptions_leave_a_bag_of_what_was_matched_or_nothing(
        folder, bag, capsys, monkeypatch, owner, name, first, words):
    work, calls = getattr(owner, name), []

    def interrupting(*given):
        calls.append(None)
        if len(calls) >= first:
            os.kill(os.getpid(), signal.SIGINT)
        return work(*given)

    monkeypatch.setattr(owner, name, interrupting)
    assert replay('bag') == INTERRUPTED
    assert words in capsys.readouterr().err
    if owner is BagSink:
        assert not (folder / 'out' / UNFINISHED).exists()
        assert list(disparities(folder / 'out')) == stamps(len(calls))
    else:
        assert {path.name for path in folder.iterdir()} == {'bag'}


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


def test_a_recording_that_was_cut_off_is_matched_and_it_is_told(folder, capsys):
    """How far, of each kind: see test_cut_off.py."""
    write_bag(folder / 'bag', pairs=scene(60, rows=120, columns=240))
    whole = (folder / 'bag' / 'bag.mcap').read_bytes()
    (folder / 'bag' / 'bag.mcap').write_bytes(whole[:len(whole) // 2])
    assert replay('bag') == 0
    found, printed = disparities(folder / 'out'), capsys.readouterr()
    assert 16 <= len(found) <= 30     # 18 pairs make a chunk
    assert [*found] == stamps(60)[:len(found)]
    loss, = figures(capsys, 'bag', output='other')['losses']
    assert loss.startswith('bag/bag.mcap was cut off: its ')
    assert loss in printed.err.splitlines() and loss in printed.out.splitlines()


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_damaged_output_is_not_continued(folder, capsys, interrupted, storage):
    write_bag(folder / 'bag', pairs=scene(20))
    interrupted(15, options=['--format', storage])
    file, = (folder / 'out').glob('out_0.*')
    whole = file.read_bytes()
    file.write_bytes(whole[:len(whole) * 3 // 4])
    assert rejection(capsys, 'bag', options=['--format', storage, '--resume']).endswith(
        '; start over with --overwrite')


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


def test_a_replay_is_continued_with_its_options_in_its_bag_to_the_end(
        folder, bag, capsys, interrupted):
    interrupted(3)
    record = json.loads((folder / 'out' / 'replay.json').read_text())
    assert (record['bags'], record['left']) == (['bag'], TOPICS[0])
    assert rejection(capsys, 'bag', disparities=20, options=[
        '--resume', '--every', 2, '--queue-size', 9]) == (
            '--resume needs the options of the first run; different are every (1, now 2), '
            'queue_size (5, now 9), disparities (16, now 20)')
    (folder / 'other').mkdir()
    write_bag(folder / 'other' / 'bag', first=20)
    assert rejection(capsys, 'other/bag', options=['--resume']) == (
        '--resume: the last pairs in out are not in other/bag')
    assert list(disparities(folder / 'out')) == stamps(3)
    for matched in (3, 0):
        before = {path: path.stat().st_mtime_ns for path in (folder / 'out').glob('*.mcap')}
        found = figures(capsys, 'bag', options=['--resume', '--threads', 1])
        assert found['pairs']['matched'] == matched
    assert {path: path.stat().st_mtime_ns for path in (folder / 'out').glob('*.mcap')} == before


def test_an_output_is_replaced_only_where_it_is_one_and_that_is_asked_for(folder, bag, capsys):
    """And then what others put beside it stays."""
    write_bag(folder / 'short', pairs=scene(2))
    assert replay('bag', options=['--files', 'npy', '--format', 'sqlite3', '--keep']) == 0
    for place in ('mine', 'out/notes'):
        (folder / place).mkdir()
        (folder / place / 'letter.txt').write_text('dear')
    for words, sentence in (
            ('short', 'out exists; give another folder, --overwrite or --resume'),
            ('bag --output mine', 'mine exists'), ('bag --output mine --overwrite', 'mine exists'),
            ('bag --output mine --resume', 'mine exists'),
            ('bag --output new --resume', '--resume finds nothing to continue in new'),
            ('bag --resume --overwrite', 'give one of them'),
            ('bag --output missing/out', 'there is no folder missing'),
            ('out --overwrite', '--output is out, which holds the input out'),
            ('out/out_0.db3 --overwrite', '--output is out, which holds the input out/out_0.db3')):
        name, *options = words.split()
        before = contents()
        assert sentence in rejection(capsys, name, options=options), words
        assert contents() == before
    assert replay('short', options=['--files', 'npy', '--overwrite']) == 0
    assert (folder / 'out' / 'notes' / 'letter.txt').read_text() == 'dear'
    assert {path.name for path in (folder / 'out').iterdir()} == {
        'calibration.json', 'disparity', 'metadata.yaml', 'notes', 'out_0.mcap', 'replay.json'}
    assert len(list((folder / 'out' / 'disparity').iterdir())) == 2
    (folder / 'mine' / 'letter.txt').unlink()
    assert replay('bag', output='mine') == 0


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
