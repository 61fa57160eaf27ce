# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Workers of Dask that match segments: what they are asked, and what becomes of it."""
from concurrent.futures import CancelledError, ThreadPoolExecutor, wait
from itertools import count
import time
import uuid

from fuzzy_stereo_ros.bags.reading import text_of
from fuzzy_stereo_ros.matching.kernels.keeping import note
from fuzzy_stereo_ros.replay.segment_matching import match_segment, SegmentOrder
from fuzzy_stereo_ros.saved_pairs.versions import versions

PACKAGE = 'fuzzy_stereo_ros'
LOOK_SECONDS = 0.1      # between two looks whether to stop
COUNT_SECONDS = 2.0     # between two counts of the workers
LOST_SECONDS = 30.0     # without any worker after which no other is hoped for


class ClusterFault(OSError):
    """Workers that are not there, that cannot match, or that went away; a sentence."""


class Cluster:
    """
    Workers that match segments; a worker that dies loses nothing, as another does its work.

    A context manager. config: MatcherConfig of the images as they are. name: of the scheduler,
    for sentences. workers: how many there were when they were counted last, 1 at least.
    """

    def __init__(self, client, name, config):
        """Take the workers that there are; client: a distributed.Client."""
        self._client, self.name, self.config = client, name, config
        self._keys = (f'segment-{uuid.uuid4().hex}-{number}' for number in count())
        self._answering, self._counting = (ThreadPoolExecutor(1, name) for name in (
            'answers', 'workers'))
        self._coming, self._counted, self._there = None, 0.0, time.monotonic()
        self.workers = max(1, len(client.nthreads()))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._client.close()    # lets go of all that is still asked, so that both threads end
        self._answering.shutdown()
        self._counting.shutdown()

    def warm_up(self):
        """Have each worker compile the kernels or load them from its cache; ClusterFault."""
        asked = [self._submit((), 0, workers=[address], allow_other_workers=True)
                 for address in self._client.nthreads()]
        for one in asked:
            self._answer_of(one)

    def ask(self, pairs, warming):
        """Have pairs matched, as of a SegmentOrder; return what `answer` takes, in its turn."""
        return self._answering.submit(self._answer_of, self._submit(pairs, warming))

    def answer(self, asked, stopped):
        """
        Wait for the SegmentAnswer of what was asked and return it; None where stopped() says so.

        Raises ClusterFault where there will be none.
        """
        while not wait([asked], LOOK_SECONDS).done:
            if stopped():
                return None
            self._count_workers()
        return asked.result()

    def _submit(self, pairs, warming, **where):
        """Return the distributed.Future of an order, which the scheduler keeps until then."""
        return self._client.submit(
            _match_on_worker, SegmentOrder(self.config, pairs, warming), versions()[PACKAGE],
            key=next(self._keys), **where)

    def _answer_of(self, future):
        from distributed.scheduler import KilledWorker
        try:
            answer = future.result()
            for remark in answer.remarks:
                note(remark)
            return answer
        except ClusterFault:
            raise
        except KilledWorker as error:
            raise ClusterFault(
                f'worker after worker of {self.name} ended over the same pairs, '
                f'{error.allowed_failures + 1} in all: see what they wrote last, and whether '
                'they have enough memory'
            ) from error
        except ImportError as error:
            raise unfit(f'a worker of {self.name}', error) from error
        except (CancelledError, OSError) as error:
            raise ClusterFault(f'{self.name} does not answer any more') from error
        finally:
            future.release()

    def _count_workers(self):
        """Count the workers from time to time; ClusterFault where there is none for long."""
        now = time.monotonic()
        if self._coming is None and now - self._counted > COUNT_SECONDS:
            self._coming, self._counted = self._counting.submit(self._client.nthreads), now
        elif self._coming is not None and self._coming.done():
            found = 0 if self._coming.exception() else len(self._coming.result())
            self._coming = None
            self.workers = max(1, found)
            self._there = now if found else self._there
            if now - self._there > LOST_SECONDS:
                raise ClusterFault(f'{self.name} has had no worker for {LOST_SECONDS:.0f} s')


def unfit(where, error):
    """Return the ClusterFault of a process in which the package fails, with what to do."""
    return ClusterFault(f'{where} cannot use {PACKAGE} ({text_of(error)}): install {PACKAGE} '
                        f'{versions()[PACKAGE]} there')


def check_version(found, where):
    """Raise ClusterFault where another version of the package was found than this one."""
    if found != versions()[PACKAGE]:
        raise ClusterFault(f'{where} has {PACKAGE} {found}, this is {versions()[PACKAGE]}: '
                           'install the same everywhere')


def _match_on_worker(order, version):
    """Match a segment in a thread of a worker, for a client of a version of this package."""
    from distributed import get_worker
    worker = get_worker()
    check_version(version, f'the replay that asks the worker {worker.address}')
    task = worker.state.tasks[worker.get_current_task()]
    return match_segment(order, worker.state.nthreads, lambda: task.state == 'executing')
