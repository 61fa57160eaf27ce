# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Cut a replay into segments and match them in parallel on the workers of Dask.

The results depend only on where the segments begin: not on the number of workers, on workers that
die, or on interruptions. If a worker dies, Dask gives its segment to another one; the scheduler
keeps a segment until its result has arrived.
"""
from collections import deque
from concurrent.futures import ThreadPoolExecutor, wait
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
DECIDE_BITS = 'python', 'numpy', 'numba', 'opencv', 'processor'    # versions, see _check_workers
SEGMENTS_PER_WORKER = 2     # submitted at a time: one is matched, the other one waits
CONNECT_SECONDS = 15        # limit for a scheduler to answer
POLL_SECONDS = 0.1          # between two checks whether to stop
NO_WORKER_SECONDS = 30.0    # without any worker, the first one too, after which it ends

_one_at_a_time = Lock()     # a process matches one segment, even if the worker has more threads


class ClusterError(OSError):
    """Workers are missing or cannot match; the text is a sentence for the user."""


class Segment(NamedTuple):
    """Consecutive Items: before, a list of those that only warm up; items, the others."""

    before: list
    items: list

    def pairs(self):
        """Return [(StereoPair, whether the matcher is reset first)], and how many warm up."""
        pairs, warming, went_back = [], 0, False
        for place, item in enumerate([*self.before, *self.items]):
            went_back |= item.went_back
            if isinstance(item.pair, StereoPair):
                pairs.append((item.pair, went_back))
                warming += place < len(self.before)
                went_back = False
        return pairs, warming


class SegmentResult(NamedTuple):
    """The results of a segment."""

    warming: tuple      # of the pairs that warmed up: matches, of these warm ones, milliseconds
    outcomes: list      # the Match or Rejection of each other pair


def cut_into_segments(items):
    """Yield the Segments of Items, with WARM_PAIRS Items before each."""
    before, own, place = [], [], None
    for item in items:
        if item.number is not None:
            last, place = place, item.number // SEGMENT_PAIRS
            if last not in (None, place):
                yield Segment(before, own)
                first = place * SEGMENT_PAIRS - WARM_PAIRS
                before = [one for one in (*before, *own)
                          if one.number is not None and one.number >= first]
                own = []
        own.append(item)
    if own:
        yield Segment(before, own)


def _up_to_damage(items, damage):
    """Yield Items; a DamagedBag that ends them is appended to a list."""
    try:
        yield from items
    except DamagedBag as error:
        damage.append(error)


def match_in_segments(items, cluster, stats, stopped):
    """Yield each Item with its Match, Rejection, or None, by a Cluster; errors: also its own."""
    waiting, damage = deque(), []
    for segment in cut_into_segments(_up_to_damage(items, damage)):
        new = any(isinstance(item.pair, StereoPair) and not item.written for item in segment.items)
        waiting.append((segment, cluster.submit(*segment.pairs()) if new else None))
        stats.workers = max(stats.workers, cluster.workers)
        while len(waiting) >= SEGMENTS_PER_WORKER * cluster.workers:
            yield from _outcomes(*waiting.popleft(), cluster, stats, stopped)
        if stopped():
            return
    while waiting and not stopped():
        yield from _outcomes(*waiting.popleft(), cluster, stats, stopped)
    if damage and not stopped():
        raise damage[0]


def _outcomes(segment, future, cluster, stats, stopped):
    """Yield what `match_in_segments` yields of one segment; nothing if it is stopped."""
    if future is None:      # all of it is written already
        yield from ((item, item.pair if isinstance(item.pair, Rejection) else None)
                    for item in segment.items)
        return
    result = cluster.result(future, stopped)
    if result is None:
        return
    rematched, warm, milliseconds = result.warming
    stats.segments, stats.rematched = stats.segments + 1, stats.rematched + rematched
    stats.warm, stats.milliseconds = stats.warm + warm, stats.milliseconds + milliseconds
    outcomes = iter(result.outcomes)
    for item in segment.items:
        yield item, next(outcomes) if isinstance(item.pair, StereoPair) else item.pair


class Cluster:
    """The workers of a Dask scheduler, which may join, leave and die; workers: their number."""

    def __init__(self, client, name, config):
        """Use the workers of a distributed.Client; config: MatcherConfig."""
        self._client, self.name, self._config = client, name, config
        self.workers, self._last_seen = 1, time.monotonic()
        self._waiting = ThreadPoolExecutor(1)       # ends with the futures, which the client ends
        self._count_workers()

    def warm_up(self):
        """Let each worker compile or load the kernels; raises ClusterError."""
        for future in [self.submit([], 0, workers=[address], allow_other_workers=True)
                       for address in self._client.nthreads()]:
            self.result(future, lambda: False)

    def submit(self, pairs, warming, **where):
        """Submit pairs to `match_segment`; return the Future of the SegmentResult."""
        return self._client.submit(_match_on_worker, self._config, pairs, warming, pure=False,
                                   **where)

    def result(self, future, stopped):
        """Wait for a SegmentResult and return it, None if stopped(); raises ClusterError."""
        from distributed.scheduler import KilledWorker

        # In a thread: with a limit, `future.result` would begin the transfer anew each time.
        result = self._waiting.submit(future.result)
        try:
            while not wait([result], POLL_SECONDS).done:
                if stopped():
                    return None
                self._count_workers()
            return result.result()
        except ClusterError:
            raise
        except KilledWorker as error:
            raise ClusterError(
                f'workers of {self.name} died over the same pairs, '
                f'{error.allowed_failures + 1} in all: check their logs and their memory'
            ) from error
        except Exception as error:      # noqa: B902  no worker can match
            raise ClusterError(f'{self.name} cannot match ({text_of(error)}): install {PACKAGE} '
                               f'{versions()[PACKAGE]} there') from error

    def _count_workers(self):
        """Count the workers; raises ClusterError after NO_WORKER_SECONDS without any."""
        now, found = time.monotonic(), len(self._client.nthreads())
        self.workers = max(1, found)
        self._last_seen = now if found else self._last_seen
        if now - self._last_seen > NO_WORKER_SECONDS:
            raise ClusterError(f'{self.name} has had no worker for {NO_WORKER_SECONDS:.0f} s')


@contextmanager
def opened_cluster(options, log):
    """Yield the Cluster; log(sentence): of versions; ValueError without Dask, or ClusterError."""
    opened = ExitStack()
    try:
        # Interrupted while it starts, Dask would leave processes or print tracebacks.
        with interruption() as interrupted:
            cluster = _open_cluster(options, log, opened)
        if interrupted():
            raise KeyboardInterrupt
        yield cluster
    finally:
        with interruption():
            opened.close()


def _open_cluster(options, log, opened):
    try:
        import dask
        from distributed import Client
        from distributed.comm import get_address_host_port
        from distributed.utils import silence_logging_cmgr
    except ImportError:
        raise ValueError("distributed is not installed: pip install '.[cluster]' in the folder of "
                         'the package') from None
    opened.enter_context(silence_logging_cmgr(logging.CRITICAL))
    # Segments are large on purpose: the scheduler keeps them in case a worker dies.
    opened.enter_context(
        dask.config.set({'distributed.admin.large-graph-warning-threshold': '1 PiB'}))
    if options.scheduler is None:
        name, local = 'this machine', _local_cluster(options.workers, opened)
        client = Client(local, set_as_default=False, direct_to_workers=True)
    else:
        name = options.scheduler
        try:
            get_address_host_port(name)     # a Client of a bad address would not close cleanly
            client = Client(name, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ClusterError(f'--scheduler is {name}, where no Dask scheduler answers: '
                               f'{text_of(error)}') from error
    opened.enter_context(client)
    _check_workers(client, name, log)
    return Cluster(client, name, options.scaled_config)


def _local_cluster(workers, opened):
    """Return a LocalCluster, closed by an ExitStack, whose processes Ctrl-C does not reach."""
    from distributed import LocalCluster

    folder = opened.enter_context(tempfile.TemporaryDirectory())
    resource_tracker.ensure_running()       # started later, it would unblock the signal
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
    import distributed

    try:
        client.wait_for_workers(1, timeout=NO_WORKER_SECONDS)
    except distributed.TimeoutError:    # before Python 3.11 not the one of Python
        raise ClusterError(f'{name} has no workers: start some with `dask worker {name}` where '
                           f'{PACKAGE} is installed') from None
    here = versions()
    for address, there in client.run(versions, on_error='return').items():
        fault = text_of(there) if isinstance(there, Exception) else there[PACKAGE]
        if fault != here[PACKAGE]:
            raise ClusterError(f'the worker {address} lacks {PACKAGE} {here[PACKAGE]} (it has '
                               f'{fault}): install the same version everywhere')
        different = [f'{what} {there[what]} (here {here[what]})' for what in DECIDE_BITS
                     if there[what] != here[what]]
        if different:
            log(f"the worker {address} has {', '.join(different)}: the last bits of its results "
                'may differ')


def _match_on_worker(config, pairs, warming):
    """Return the SegmentResult of pairs, matched with the threads of this Dask worker."""
    from distributed import get_worker

    threads = config.threads or get_worker().state.nthreads
    return match_segment(replace(config, threads=threads), pairs, warming)


def match_segment(config, pairs, warming):
    """Return the SegmentResult of `Segment.pairs`, independent of all that was matched before."""
    with _one_at_a_time:
        matcher, outcomes = _warm_matcher(config), []
        matcher.restore(None)
        for pair, reset in pairs:
            if reset:
                matcher.reset()
            outcomes.append(match_or_reject(pair, matcher))
    warmed = [one for one in outcomes[:warming] if not isinstance(one, Rejection)]
    return SegmentResult((len(warmed), sum(one.warm for one in warmed),
                          sum(one.times['total'] for one in warmed)), outcomes[warming:])


@lru_cache(maxsize=1)
def _warm_matcher(config):
    """Return the StereoMatcher of this process with its kernels compiled or loaded."""
    matcher = StereoMatcher(config)
    matcher.warm_up(*WARM_UP_SIZE)
    return matcher
