# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Bands and parts of rows, and the threads that share them.

Bands depend on the image size only. Parts depend on the number of threads too: stages that use
them have the same result however rows are cut.
"""
from collections import deque
from contextlib import suppress
import ctypes
from functools import lru_cache
import os
from queue import SimpleQueue
from statistics import median
import sys
from threading import get_ident, Thread
import time
from weakref import finalize

_FEWEST_ROWS = 64   # below this a band is mostly overlap
_LEAST_ROWS, MOST_PARTS = 30, 32    # see cut_parts
SHORT = 0.5         # parts of a short stage for each thread, see cut_parts
_TRIAL = 12         # frames at each place in a trial
_REST = 48          # frames from a trial to the next, if times change in between
_LONGEST_REST = 384     # frames from a trial to the next, if they do not
_CHANGED = 1.25     # factor between times that means that they changed
_FASTER = 0.97      # factor of the time in use below which the other place is taken
_current_processor = ctypes.CDLL(None).sched_getcpu if sys.platform == 'linux' else lambda: None


def processors():
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else (
        os.cpu_count() or 1)


class HelperAffinity:
    """
    Whether helping threads may run on the caller's processor, by which is faster.

    In a virtual machine Linux may take an idle processor for a busy one: it wakes a helper on the
    caller's processor, and after a pause both share it for a whole frame. Where other programs are
    busy, a helper that may not run everywhere waits for them instead. So both are tried, frame by
    frame in turns, and the one with the lower median is kept. Tries are repeated, at once where
    times change, for example as other programs begin or end.

    apart: whether helpers are kept off the caller's processor in this frame
    """

    def __init__(self):
        """Begin with a trial."""
        self.apart, self._chosen, self._usual = True, True, 0.0
        self._times = {apart: deque(maxlen=_TRIAL) for apart in (True, False)}
        self._trial, self._rested = 2 * _TRIAL, 0

    def add(self, elapsed):
        """Add the time that a frame took, in any unit."""
        self._times[self.apart].append(elapsed)
        if self._trial:
            self._trial -= 1
            if not self._trial:
                self._choose()
        else:
            self._rested += 1
            if self._rested >= _LONGEST_REST or self._rested >= _REST and self._changed():
                self._trial = 2 * _TRIAL
        # In a trial two frames at each place: the second one finds the helpers where they belong.
        self.apart = self._chosen != bool(self._trial // 2 % 2)

    def _choose(self):
        times = {apart: median(found) for apart, found in self._times.items()}
        if times[not self._chosen] < _FASTER * times[self._chosen]:
            self._chosen = not self._chosen
        self._usual, self._rested = times[self._chosen], 0

    def _changed(self):
        now = median(self._times[self._chosen])
        return not self._usual / _CHANGED <= now <= self._usual * _CHANGED


class ThreadPool:
    """
    The threads of one matcher, with the calling thread as one of them.

    Kernels release the GIL while they run. An executor, with a future for each item, costs five
    times as much, and there are some twenty calls a frame. Nobody waits for a helping thread that
    has not begun; on a processor with other work it may wake long after all items are done.

    shared: ms spent in `run`; the rest of a frame runs in one thread. places: the `HelperAffinity`
    """

    def __init__(self, threads):
        """threads: their number, 0 for one per processor; helping ones start when needed."""
        self.threads, self.shared = threads or processors(), 0.0
        self._helpers, self._queues = [], []
        self._frame = None      # `shared` where the frame began
        self.places = HelperAffinity()
        self._end = finalize(self, _end, self._queues)

    def parts(self, rows, height=1, each=1):
        """Return the parts of an image for these threads, see `cut_parts`."""
        return cut_parts(rows, self.threads, height, each)

    def begin_frame(self):
        """Measure the frame that ends; choose where helping threads run in the next one."""
        if self._helpers and self._frame is not None:
            self.places.add(self.shared - self._frame)
        self._frame = self.shared

    def each(self, work, items, after=None, reach=None):
        """Call work(item) for every item; after, reach: as of a Chain, here nothing is before."""
        self.run(work, items, [0] * len(items))

    def mapped(self, function, items):
        """Return what a function returns for each item: a list."""
        found = list(items)

        def replace(number):
            found[number] = function(found[number])
        self.each(replace, range(len(found)))
        return found

    def run(self, work, items, needs):
        """
        Call work(item) for every item and return when all are done.

        An error or an interrupt in any of the threads ends the call: no further item begins, and
        it is raised here once those that have begun are done.

        needs: of each item, how many of the first items must be done before it begins
        """
        begun = time.perf_counter()
        try:
            if self.threads > 1:
                self._run_together(_Call(work, items, needs))
            else:       # each item needs items before it alone
                for item in items:
                    work(item)
        finally:
            self.shared += 1000 * (time.perf_counter() - begun)

    def _run_together(self, call):
        try:
            for queue in self._asked(min(self.threads, call.number) - 1):
                queue.put(call)
            call.run()
            call.join()
        except BaseException as error:      # an interrupt may come at any line above
            call.end(error)
            call.join()
            raise
        if call.errors:
            raise call.errors[0]

    def _asked(self, number):
        """Return the queues of some helpers, which run where `HelperAffinity` says."""
        self._helpers = [helper for helper in self._helpers if helper.is_alive()]
        while len(self._helpers) < number:
            helper = _Helper()
            self._queues.append(helper.calls)
            helper.start()
            self._helpers.append(helper)    # at last, whole: an interrupt may come before
        helpers = self._helpers[:max(number, 0)]
        if helpers and sys.platform == 'linux':
            allowed = os.sched_getaffinity(0)
            places = allowed - {_current_processor() if self.places.apart else None} or allowed
            for helper in helpers:
                if helper.places != places:
                    helper.places = places
                    with suppress(OSError):     # a processor was taken away meanwhile
                        os.sched_setaffinity(helper.native_id, places)
        return [helper.calls for helper in helpers]

    def close(self):
        """End the threads."""
        self._end()
        for helper in self._helpers:
            helper.join()


class Chain:
    """
    Stages that threads run in one call of `ThreadPool.run`, and so wait less for each other.

    A stage that calls `each` of a chain, in the place of a pool's, is run later. So methods take
    either as `pool`, or a Chain alone as `chain`; the mark that some return is that of their last
    stage, and their first one begins once the stage `after` is done.

    threads, parts: those of the pool
    """

    def __init__(self, pool):
        """Begin without stages of a ThreadPool."""
        self.threads, self.parts, self._pool = pool.threads, pool.parts, pool
        self._calls, self._needs = [], []

    def each(self, work, items, after=None, reach=None):
        """
        Add a stage: work(item) is called for every item; return its mark, for later stages.

        An item may begin once all stages before are done; with `after`, the mark of one of them,
        once that one is, and those before it (0: at once); with `reach`, where the stage just
        before has the same bands, once that is done with the item's own band and so many below.
        """
        before, number = len(self._calls), len(items)
        if reach is None:
            self._needs += [before if after is None else after] * number
        else:
            self._needs += [max(before - max(number - index - 1 - reach, 0), 0)
                            for index in range(number)]
        self._calls += [(work, item) for item in items]
        return len(self._calls)

    def run(self):
        """Run the stages, of each frame if the chain is kept; return when all are done."""
        self._pool.run(lambda call: call[0](call[1]), self._calls, self._needs)


class _Call:
    """
    A call of `run`: each thread takes the first item that may begin, so that few wait.

    An exception may come at any line. So nothing is locked, and a thread that waits looks after
    each wake whether what it waits for is so; each change of that is one step.

    number: of items; errors: what has ended the call before its time
    """

    def __init__(self, work, items, needs):
        """Take what `ThreadPool.run` takes."""
        self._work, self._items, self._needs, self.errors = work, items, needs, []
        self.number = len(items)
        self._left, self._done, self._first = set(range(self.number)), bytearray(self.number), 0
        self._helping, self._waiting = set(), set()     # threads; a queue of each that waits

    def run(self):
        """Do items until none is left, or until an error ends the call."""
        while self._left and not self.errors:
            index = self._take()
            if index is None:
                self._wait(lambda: self._may_begin() or not self._left or self.errors)
                continue
            if self._waiting and self._may_begin():
                self._wake()
            self._work(self._items[index])
            self._done[index] = 1
        self._wake()

    def assist(self):
        """Do the same in a helping thread; `run` of the pool raises its error."""
        try:
            self._helping.add(get_ident())      # before it takes an item: see join
            self.run()
            self._leave()
        except BaseException as error:
            self.end(error)
            self._leave()

    def end(self, error):
        """Let no further item begin."""
        self.errors.append(error)
        self._wake()

    def join(self):
        """Wait until nobody helps any more; who comes now finds nothing to do."""
        self._wait(lambda: not self._helping)

    def _leave(self):
        self._helping.discard(get_ident())
        self._wake()

    def _wait(self, is_met):
        if is_met():
            return
        bell = SimpleQueue()
        self._waiting.add(bell)     # first: a change now either is seen or rings
        while not is_met():
            bell.get()
        self._waiting.discard(bell)

    def _wake(self):
        for bell in list(self._waiting):    # a copy in one step, which tuple() is not
            bell.put(None)

    def _ready(self):
        """Return an iterator over the items left whose needs are done."""
        first = self._done.find(0, self._first)
        self._first = first = self.number if first < 0 else first
        return (index for index in range(first, self.number)
                if index in self._left and self._needs[index] <= first)

    def _may_begin(self):
        return next(self._ready(), None) is not None

    def _take(self):
        """Take the first item that may begin; return None where there is none."""
        for index in self._ready():
            with suppress(KeyError):    # another thread has taken it
                self._left.remove(index)
                return index
        return None


class _Helper(Thread):
    """A thread that does `calls`, a queue that None ends, on the processors `places`."""

    def __init__(self):
        super().__init__(name='pool', daemon=True)
        self.calls, self.places = SimpleQueue(), None

    def run(self):
        for call in iter(self.calls.get, None):
            call.assist()
            del call        # a waiting thread keeps no frame in memory


def widened(band, reach, rows):
    """
    Return the first row and the one behind the last of a band and of `reach` rows around it.

    Where a stage needs rows of its neighbours, each band computes them too: that costs less than
    waiting for all bands. Two threads then write the same numbers to the same rows.
    """
    return max(band[1] - reach, 0), min(band[2] + reach, rows)


def _end(queues):
    for queue in queues:
        queue.put(None)


def cut_bands(rows, height=1):
    """
    Return the bands of an image of a number of rows as (index, first, last) tuples.

    There are 1, 2, 4 or 8 of them: two from 128 rows, four from 640, eight from 1280; each but
    the last has a multiple of `height` rows.
    """
    return _cut(rows, height, 8 if rows >= 20 * _FEWEST_ROWS else 4 if rows >= 10 * _FEWEST_ROWS
                else 2 if rows >= 2 * _FEWEST_ROWS else 1)


@lru_cache(64)
def cut_parts(rows, threads, height=1, each=1):
    """
    Return the parts of an image for a number of threads, as `cut_bands` returns bands.

    For stages whose result is the same however rows are cut. There are `each` for each of several
    threads: of a long stage two, so that others do the part of a thread that wakes late or runs
    slowly; of a SHORT one half as many, since a thread wakes as slowly as that is done. Each part
    has 30 rows or more, and there are at most MOST_PARTS.
    """
    count = min(int(threads * each) if threads > 1 else 1, rows // _LEAST_ROWS)
    return _cut(rows, height, max(min(count, MOST_PARTS, -(-rows // height)), 1))


def _cut(rows, height, count):
    """Return `count` bands of about the same number of rows."""
    edges = [min(-(-rows * index // (count * height)) * height, rows)
             for index in range(count + 1)]
    return tuple((index, edges[index], edges[index + 1]) for index in range(count))
