# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The tasks of a search, which threads take one after the other until none is left.

They do so inside of a kernel: between kernels threads would wait for the interpreter's lock.
"""
from typing import NamedTuple

from fuzzy_stereo_ros.matching.kernels.addresses import (
    give_way, is_done, load_long, set_done, take_number)
from fuzzy_stereo_ros.matching.kernels.compiled import inlined, kernel
from fuzzy_stereo_ros.matching.kernels.scanlines.column_paths import (
    choose_of_targets, down_and_up)
from fuzzy_stereo_ros.matching.kernels.scanlines.row_paths import across
from fuzzy_stereo_ros.matching.kernels.scanlines.volume import Scratch, Search

ACROSS, COMPLETE, TARGETS = 0, 1, 2     # kinds
FIELDS = 5      # of a task


class Tasks(NamedTuple):
    """
    The tasks of a search; all but the number are addresses.

    A task is a kind; rows first .. last - 1, or for COMPLETE rows of tiles; the column of tiles;
    and how many of the first tasks must be done before it begins, all of which come before it.
    """

    number: int
    tasks: int               # of int64 (number, FIELDS)
    taken: int               # of int64, how many threads have taken
    done: int                # of uint8 (number,)


@inlined
def _wait(tasks, need, known):
    """Wait until the first `need` tasks are done; known, returned: how many of the first are."""
    while known < need:
        if is_done(tasks.done, known):
            known += 1
        else:
            give_way()
    return known


@kernel
def take_tasks(search, scratch, tasks, most):
    """
    Do up to so many tasks of a search.

    search, scratch, tasks: the fields of a Search, of a Scratch and of Tasks
    """
    search, scratch, tasks = Search(*search), Scratch(*scratch), Tasks(*tasks)
    known = 0
    for _ in range(most):
        task = take_number(tasks.taken)
        if task >= tasks.number:
            break
        at = FIELDS * task
        kind, first, last = (load_long(tasks.tasks, at), load_long(tasks.tasks, at + 1),
                             load_long(tasks.tasks, at + 2))
        known = _wait(tasks, load_long(tasks.tasks, at + 4), known)
        if kind == ACROSS:
            across(search, scratch, first, last)
        elif kind == COMPLETE:
            down_and_up(search, scratch, load_long(tasks.tasks, at + 3), first, last)
        else:
            choose_of_targets(search, scratch, first, last)
        set_done(tasks.done, task)
