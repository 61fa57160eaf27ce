# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A soak sees every promise that is broken, and each is kept in a short one."""
from contextlib import contextmanager
import os
import subprocess
import sys
import threading
from types import SimpleNamespace

from node_process import ROOT, START
import pytest
from soak_figures import (
    broken_sums, promises_of, Run, Sample, Threads, threads_of)
from soak_script import KINDS, TOPICS

LIMITS = {'memory': 1.0, 'resident': 5.0, 'work': 20.0}
SENT = dict.fromkeys(TOPICS, 30)
COUNTS = {'pairs synchronised': 28, 'pairs matched': 20, 'pairs dropped': 5, 'pairs rejected': 3,
          'pairs waiting': 0, 'rejected: size': 2, 'rejected: encoding': 1, 'queue_size': 5,
          **{f'received {topic}': 30 for topic in TOPICS},
          **{f'unmatched {topic}': 2 for topic in TOPICS},
          **{f'lost {topic}': 0 for topic in TOPICS}}
UNMATCHED = ', '.join(f'2 unmatched {topic}' for topic in TOPICS)
LOG = f"""\
[INFO] [1.5] [disparity_node]: ready: the kernels are warm after 2.0 s
[INFO] [2.5] [disparity_node]: 1 pairs dropped since the last report (newer ones came)
[ERROR] [3.5] [disparity_node]: pair rejected: the left image is 2x3, the right one 4x3
[INFO] [3.6] [disparity_node]: 3 pairs rejected since the last report (see the errors)
[INFO] [9.6] [disparity_node]: 4 pairs dropped since the last report (newer ones came)
[INFO] [9.6] [disparity_node]: {UNMATCHED} since the last report (their stamps)"""
SAMPLES = [Sample(100.0, 9000, 150.0, 20.0)] * 6


def broken_promises(samples=SAMPLES, counts=COUNTS, log=LOG, broken=(), code=0, left=()):
    """Return the names of the promises that are broken, by their first two words."""
    run = Run(samples, counts, log, list(broken), code, SimpleNamespace(left=left))
    promises = promises_of(run, LIMITS)
    return [' '.join(one.name.split()[:2]) for one in promises if not one.kept]


def test_a_sound_node_keeps_every_promise():
    assert broken_sums(COUNTS, SENT) == []
    assert broken_promises() == []


@pytest.mark.parametrize('changes, sentence', [
    ({'pairs dropped': 4}, 'do not add up'),
    ({'pairs waiting': 1}, 'do not add up'),
    ({'rejected: size': 1}, 'rejected by reason are 2, in all 3'),
    ({'received left/image_rect': 29, 'unmatched left/image_rect': 1},
     'left/image_rect: 30 sent, 29 received, 0 lost'),
    ({'lost left/image_rect': 1}, 'left/image_rect: 30 sent, 30 received, 1 lost'),
    ({'unmatched right/camera_info': 3}, 'right/camera_info: 30 received, but 3 unmatched'),
    ({'received left/camera_info': 38, 'unmatched left/camera_info': 4}, '30 sent, 38 received'),
])
def test_a_count_that_is_wrong_is_told(changes, sentence):
    assert sentence in '; '.join(broken_sums({**COUNTS, **changes}, SENT))


def test_what_waits_for_others_is_not_lost_but_never_more_than_the_queue():
    sent = dict.fromkeys(TOPICS, 35)
    received = {f'received {topic}': 35 for topic in TOPICS}
    assert broken_sums({**COUNTS, **received}, sent) == []
    assert len(broken_sums({**COUNTS, **received, 'queue_size': 4}, sent)) == len(TOPICS)


def test_a_message_that_the_middleware_lost_counts_and_needs_its_line():
    counts = {**COUNTS, 'lost left/image_rect': 3, 'received left/image_rect': 30}
    assert broken_sums(counts, {**SENT, 'left/image_rect': 33}) == []
    line = '[INFO] [1.0] [disparity_node]: 3 lost left/image_rect since the last report (they'
    assert broken_promises(counts=counts) == ['every loss']
    assert broken_promises(counts=counts, log=f'{LOG}\n{line}') == []


def grown(**figures):
    """Return samples the last third of which has other figures."""
    return {'samples': [*SAMPLES, *3 * [SAMPLES[0]._replace(**figures)]]}


def without_line(place):
    lines = LOG.splitlines()
    del lines[place]
    return {'log': '\n'.join(lines)}


@pytest.mark.parametrize('changes, names', [
    *((without_line(place), ['every loss']) for place in (1, 3, 4, 5)),
    *(({'log': f'{LOG}\n{line}'}, ['nothing is']) for line in (
        'Traceback (most recent call last):',
        '[FATAL] [1.0] [disparity_node]: kernel warm-up failed',
        '[ERROR] [1.0] [disparity_node]: cannot be prepared: disparity_range',
        '[ERROR] [1.0] [disparity_node]: pair rejected: internal error: KeyError')),
    (grown(megabytes=100.9, objects=9080, resident=157.0, work=23.0), []),
    (grown(megabytes=101.1), ['memory in']), (grown(objects=9100), ['memory in']),
    (grown(resident=158.0), ['resident memory']),
    (grown(work=25.0), ["a pair's"]),
    ({'left': ['python (since save)']}, ['no thread']),
    ({'broken': ['round 3: 30 sent'], 'code': 1}, ['sent =', 'SIGINT ends'])])
def test_what_is_not_as_promised_breaks_its_promise(changes, names):
    assert broken_promises(**changes) == names


@contextmanager
def running():
    """Have a thread in this process; give {id: name} of it."""
    end = threading.Event()
    thread = threading.Thread(target=end.wait, name='waits')
    thread.start()
    try:
        yield {thread.native_id: thread.name}
    finally:
        end.set()
        thread.join()
        while thread.native_id in threads_of(os.getpid()):
            os.sched_yield()    # the system's thread ends a little after Python's


def test_a_thread_that_comes_later_is_left_over_unless_it_takes_the_place_of_another():
    threads, later = Threads(os.getpid()), Threads(os.getpid())
    assert later.left_over({}) == []
    with running() as names:
        assert threads.left_over(names) == []
    with running() as names:
        later.note('save')
        assert later.left_over(names) == ['waits (since save)']
        assert threads.left_over(names) == []


SHORT = ('--minutes', '0', '--rows', '240', '--columns', '320', '--disparities', '16',
         '--between', '0.3')
# Three rounds do not level what is kept for the next message, nor what other programs take.
PATIENT = '--work', '400', '--memory', '2', '--resident', '15'


@pytest.mark.alone
@pytest.mark.timeout(2 * START)
def test_in_a_short_soak_every_promise_is_kept(ros, tmp_path):
    log = tmp_path / 'node.log'
    done = subprocess.run(
        [sys.executable, '-m', 'soak', *SHORT, *PATIENT, '--verbose', '--log', str(log)],
        cwd=ROOT, capture_output=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(
            str(ROOT / 'test' / folder) for folder in ('soak', 'support'))},
        text=True, check=False)
    assert done.returncode == 0, f'{done.stdout}{done.stderr}'
    assert all(f': {kind} ' in done.stdout for kind in KINDS)
    assert done.stdout.count('kept: ') == 8
    assert 'BROKEN' not in done.stdout
    assert 'ready: the kernels are warm' in log.read_text(encoding='utf-8')
