# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A replay cut into segments that Dask's workers match at the same time.

The results depend on where the segments begin, and on nothing else: neither on how many workers
there are, nor on which of them dies, nor on whether the replay was interrupted. Where a worker
dies, Dask gives its segment to another one; the scheduler keeps it until it is answered.
"""
from collections import deque
from contextlib import contextmanager, ExitStack
from dataclasses import replace
from functools import lru_cache
import logging
from multiprocessing import resource_tracker
import signal
import tempfile
from threading import Lock
import time
from typing import NamedTuple

from fuzzy_stereo_ros.bags.reading import DamagedBag, text_of
from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.pairs.stereo_pair import StereoPair
from fuzzy_stereo_ros.replay.loop import interruption, match_or_reject
from fuzzy_stereo_ros.replay.options import SEGMENT_PAIRS, WARM_PAIRS
from fuzzy_stereo_ros.replay.source import Rejection
from fuzzy_stereo_ros.saved_pair import versions

PACKAGE = 'fuzzy_stereo_ros'
LOOPBACK = '127.0.0.1'
DECISIVE = 'python', 'numpy', 'numba', 'opencv', 'processor'    # for the bits of a result
AHEAD = 2               # segments on their way for each worker: one is matched, one lies ready
ANSWER_SECONDS = 5      # that a scheduler has to answer, and its first worker to be there
LOOK_SECONDS = 0.1      # between two looks whether to stop
LOST_SECONDS = 30.0     # without any worker, after which the replay ends

_turn = Lock()          # a process matches one segment at a time, whatever threads it has


class ClusterFault(OSError):
    """Workers that are missing or cannot match; a sentence."""


class Segment(NamedTuple):
    """Steps in a row: before, lists of those that warm up, and of those that count."""

    before: list
    steps: list

    @property
    def new(self):
        """Whether any of its pairs is not written yet."""
        return any(isinstance(step.pair, StereoPair) and not step.again for step in self.steps)

    def pairs(self):
        """Return [(StereoPair, whether it starts anew)], and how many of them warm up."""
        pairs, warming, went_back = [], 0, False
        for place, step in enumerate([*self.before, *self.steps]):
            went_back |= step.went_back
            if isinstance(step.pair, StereoPair):
                pairs.append((step.pair, went_back))
                warming += place < len(self.before)
                went_back = False
        return pairs, warming


class SegmentAnswer(NamedTuple):
    """
    The outcomes of a segment.

    warming: of the pairs that warmed up: (how many were matched, how many of these started from
    the pair before, milliseconds of matching). outcomes: of each other pair the Match or the
    Rejection.
    """

    warming: tuple
    outcomes: list


def cut(steps):
    """
    Yield the Segments of Steps: SEGMENT_PAIRS numbers each, from a multiple of that on.

    WARM_PAIRS numbers before them warm up. A DamagedBag is raised after the last Segment.
    """
    before, own, place = [], [], None
    try:
        for step in steps:
            if step.number is not None:
                last, place = place, step.number // SEGMENT_PAIRS
                if last not in (None, place):
                    yield Segment(before, own)
                    first = place * SEGMENT_PAIRS - WARM_PAIRS
                    before = [one for one in (*before, *own)
                              if one.number is not None and one.number >= first]
                    own = []
            own.append(step)
    except DamagedBag:
        if own:
            yield Segment(before, own)
        raise
    if own:
        yield Segment(before, own)


def match_in_segments(steps, cluster, stats, stopped):
    """
    Yield (Step, its Match, Rejection or None) of each Step, matched by a Cluster.

    stats: Stats, in which segments, workers and warming up are counted. stopped(): whether to
    end early. Raises DamagedBag, and ClusterFault where no worker answers.
    """
    waiting, damage = deque(), None
    try:
        for segment in cut(steps):
            waiting.append((segment, cluster.submit(*segment.pairs()) if segment.new else None))
            stats.workers = max(stats.workers, cluster.workers)
            while len(waiting) >= AHEAD * cluster.workers:
                yield from _outcomes(*waiting.popleft(), cluster, stats, stopped)
            if stopped():
                return
    except DamagedBag as error:
        damage = error
    while waiting and not stopped():
        yield from _outcomes(*waiting.popleft(), cluster, stats, stopped)
    if damage is not None and not stopped():
        raise damage


def _outcomes(segment, future, cluster, stats, stopped):
    """Yield what `match_in_segments` does, of one segment; nothing where it is stopped."""
    if future is None:      # it is written already
        yield from ((step, step.pair if isinstance(step.pair, Rejection) else None)
                    for step in segment.steps)
        return
    answer = cluster.answer(future, stopped)
    if answer is None:
        return
    again, warm, milliseconds = answer.warming
    stats.segments, stats.again = stats.segments + 1, stats.again + again
    stats.warm, stats.milliseconds = stats.warm + warm, stats.milliseconds + milliseconds
    outcomes = iter(answer.outcomes)
    for step in segment.steps:
        yield step, next(outcomes) if isinstance(step.pair, StereoPair) else step.pair


class Cluster:
    """
    Workers that match segments; a worker that dies loses nothing, as another does its work.

    name: of the scheduler, for sentences. workers: how many there were when they were counted
    last, 1 at least.
    """

    def __init__(self, client, name, config):
        """Take the workers that there are; client: a distributed.Client; config: MatcherConfig."""
        self._client, self.name, self._config = client, name, config
        self.workers, self._there = 1, time.monotonic()
        self._count_workers()

    def warm_up(self):
        """Have each worker compile the kernels or load them from its cache; ClusterFault."""
        for future in [self.submit([], 0, workers=[address], allow_other_workers=True)
                       for address in self._client.nthreads()]:
            self.answer(future, lambda: False)

    def submit(self, pairs, warming, **where):
        """Have pairs matched, as `match_segment` does; return the Future that `answer` takes."""
        return self._client.submit(_match_on_worker, self._config, pairs, warming, pure=False,
                                   **where)

    def answer(self, future, stopped):
        """
        Wait for a SegmentAnswer and return it; None where stopped() says so.

        Raises ClusterFault where there will be none.
        """
        import distributed
        from distributed.scheduler import KilledWorker

        try:
            while True:
                try:
                    return future.result(LOOK_SECONDS)
                except distributed.TimeoutError:
                    if stopped():
                        return None
                    self._count_workers()
        except ClusterFault:
            raise
        except KilledWorker as error:
            raise ClusterFault(
                f'worker after worker of {self.name} ended over the same pairs, '
                f'{error.allowed_failures + 1} in all: see what they wrote last, and whether '
                'they have enough memory') from error
        except Exception as error:      # noqa: B902  whatever it is, it cannot match
            raise ClusterFault(f'{self.name} cannot match ({text_of(error)}): install {PACKAGE} '
                               f'{versions()[PACKAGE]} there') from error

    def _count_workers(self):
        """Count the workers; ClusterFault where there is none for long."""
        now, found = time.monotonic(), len(self._client.nthreads())
        self.workers = max(1, found)
        self._there = now if found else self._there
        if now - self._there > LOST_SECONDS:
            raise ClusterFault(f'{self.name} has had no worker for {LOST_SECONDS:.0f} s')


@contextmanager
def opened_cluster(options, log):
    """
    Give the Cluster of ReplayOptions.

    log(sentence): called where workers run on other versions of what decides about bits.
    Raises ValueError without Dask, ClusterFault where no worker is there or one cannot match.
    """
    opened = ExitStack()
    try:
        # Started by halves, Dask would leave processes or log of it at length.
        with interruption() as came:
            cluster = _cluster(options, log, opened)
        if came():
            raise KeyboardInterrupt
        yield cluster
    finally:
        with interruption():
            opened.close()


def _cluster(options, log, opened):
    """Return the Cluster that is asked for, what it needs opened in an ExitStack."""
    try:
        import dask
        from distributed import Client
        from distributed.comm import get_address_host_port
        from distributed.utils import silence_logging_cmgr
    except ImportError:
        raise ValueError('distributed, which shares work among processes, is not installed: '
                         f"pip install '{PACKAGE}[cluster]'") from None
    opened.enter_context(silence_logging_cmgr(logging.CRITICAL))
    # Segments are large, and the scheduler is to keep them in case a worker dies.
    opened.enter_context(
        dask.config.set({'distributed.admin.large-graph-warning-threshold': '1 PiB'}))
    if options.scheduler is None:
        name, local = 'this machine', _local_cluster(options.workers, opened)
        client = Client(local, set_as_default=False, direct_to_workers=True)
    else:
        name = options.scheduler
        try:
            get_address_host_port(name)     # or else half a Client is left, which ends at length
            client = Client(name, timeout=ANSWER_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterFault(f'--scheduler is {name}, where no scheduler of Dask answers: '
                               f'{text_of(error)}') from error
    opened.enter_context(client)
    _check_workers(client, name, log)
    return Cluster(client, name, options.scaled_config)


def _local_cluster(workers, opened):
    """
    Return a LocalCluster of so many processes, opened in an ExitStack.

    Ctrl-C does not reach them: what a thread blocks, the threads and processes that it starts
    block too.
    """
    from distributed import LocalCluster

    folder = opened.enter_context(tempfile.TemporaryDirectory())
    resource_tracker.ensure_running()       # started later, it lets the interrupts through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return opened.enter_context(LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, memory_limit=0,
            host=LOOPBACK, dashboard_address=None, local_directory=folder,
            scheduler_kwargs={'dashboard_address': f'{LOOPBACK}:0'},
            silence_logs=logging.CRITICAL))
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _check_workers(client, name, log):
    """Raise ClusterFault where there is no worker, or one without this version of ours."""
    import distributed

    try:
        client.wait_for_workers(1, timeout=ANSWER_SECONDS)
    except distributed.TimeoutError:    # before Python 3.11 not the one of Python
        raise ClusterFault(f'{name} has no workers: start some with `dask worker {name}`, where '
                           f'{PACKAGE} is installed') from None
    here = versions()
    for address, there in client.run(versions, on_error='return').items():
        fault = text_of(there) if isinstance(there, Exception) else there[PACKAGE]
        if fault != here[PACKAGE]:
            raise ClusterFault(f'the worker {address} is without {PACKAGE} {here[PACKAGE]} '
                               f'(it has {fault}): install the same everywhere')
        different = [f'{what} {there[what]} (here {here[what]})' for what in DECISIVE
                     if there[what] != here[what]]
        if different:
            log(f"the worker {address} has {', '.join(different)}: the last bits of its results "
                'may differ')


def _match_on_worker(config, pairs, warming):
    """Match a segment in a thread of a worker, with as many threads as are the worker's."""
    from distributed import get_worker

    threads = config.threads or get_worker().state.nthreads
    return match_segment(replace(config, threads=threads), pairs, warming)


def match_segment(config, pairs, warming):
    """
    Return the SegmentAnswer of pairs, which depends on nothing that was matched before.

    config: MatcherConfig. pairs: [(StereoPair, whether it starts anew)]. warming: so many of
    them, the first, only warm up.
    """
    with _turn:
        matcher, outcomes = _warm_matcher(config), []
        matcher.reset()
        for pair, starts_anew in pairs:
            if starts_anew:
                matcher.reset()
            outcomes.append(match_or_reject(pair, matcher))
    warmed = [one for one in outcomes[:warming] if not isinstance(one, Rejection)]
    return SegmentAnswer((len(warmed), sum(one.warm for one in warmed),
                          sum(one.times['total'] for one in warmed)), outcomes[warming:])


@lru_cache(maxsize=1)
def _warm_matcher(config):
    """Return the StereoMatcher of this process, its kernels compiled or loaded."""
    matcher = StereoMatcher(config)
    matcher.warm_up(*WARM_UP_SIZE)
    return matcher
