# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A few pairs in a row, matched in whatever process they are sent to."""
from dataclasses import dataclass, replace
from functools import lru_cache
from threading import Lock

from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.matching.kernels.keeping import remarks
from fuzzy_stereo_ros.pair_matcher import Rig
from fuzzy_stereo_ros.pairs.pair_reader import PairReader

_turn = Lock()      # a process matches one segment at a time, whatever threads it has


@dataclass(frozen=True)
class SegmentOrder:
    """
    What is to be matched.

    config: MatcherConfig of the images as they are, reduced in scale; threads 0 takes those of
    whoever matches. pairs: (StereoPair, whether it starts anew) in a row. warming: so many of
    them, the first, only warm up.
    """

    config: MatcherConfig
    pairs: tuple
    warming: int = 0


@dataclass(frozen=True)
class SegmentAnswer:
    """
    What came of a SegmentOrder.

    warming: of the pairs that warmed up: (how many were matched, how many of these started from
    the pair before, milliseconds of matching). answers: of each other pair the Match, or the
    ValueError that says why it cannot be matched. remarks: sentences on what was done without
    where it was matched.
    """

    warming: tuple
    answers: tuple
    remarks: tuple = ()


def match_segment(order, threads, wanted=lambda: True):
    """
    Return the SegmentAnswer of a SegmentOrder, which depends on nothing that was matched before.

    threads: of the matcher, where the order names none. wanted(): whether to go on with the next
    pair; None is returned where not.
    """
    config = replace(order.config, threads=order.config.threads or threads)
    with _turn:
        rig = warm_rig(config)
        rig.forget()
        answers = []
        for pair, starts_anew in order.pairs:
            if not wanted():
                return None
            if starts_anew:
                rig.forget()
            try:
                answers.append(rig.match_pair(pair).match)
            except ValueError as error:
                answers.append(ValueError(str(error)))
    warming = [one for one in answers[:order.warming] if not isinstance(one, ValueError)]
    return SegmentAnswer(
        (len(warming), sum(one.warm for one in warming),
         sum(one.times['total'] for one in warming)), tuple(answers[order.warming:]),
        tuple(remarks()))


@lru_cache(maxsize=1)
def warm_rig(config):
    """Return the Rig of this process for a MatcherConfig, its kernels compiled or loaded."""
    rig = Rig(config, PairReader(), told=None)
    rig.warm_up()
    return rig
