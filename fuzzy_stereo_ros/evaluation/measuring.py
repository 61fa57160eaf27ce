# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What contestants reach: on scenes, each by itself, and on sequences, warm and cold."""
from dataclasses import dataclass, fields
from functools import partial
import math

from fuzzy_stereo_ros.evaluation.found import Found
from fuzzy_stereo_ros.evaluation.matchers import Task
from fuzzy_stereo_ros.evaluation.pair_files import MASKS
from fuzzy_stereo_ros.evaluation.scores import flicker, Score, score
from fuzzy_stereo_ros.matching import MatcherConfig
from fuzzy_stereo_ros.pairs.stereo_pair import width_by_height
import numpy as np

TRUTHS_LARGEST = "the truth's largest, rounded up"


class NoSequence(ValueError):
    """Numbered frames that do not follow one another; a sentence."""


@dataclass(frozen=True)
class Scores:
    """The `Score` of a map as it comes, and of the same map with its gaps filled."""

    found: Score
    filled: Score


@dataclass(frozen=True)
class Outcome:
    """
    What a contestant reached on a scene, or on a sequence from one start.

    scores: {mask: `Scores`}; on a sequence the means over its frames with a truth.
    milliseconds: a frame; None = not known. speed: million disparities tried per second.
    flickers: of the map as it comes and of the filled one, percent; None for a scene.
    covered: percent of all pixels of a sequence that have a disparity; None for a scene.
    """

    scores: dict
    milliseconds: float | None
    speed: float | None
    flickers: tuple | None = None
    covered: float | None = None


@dataclass(frozen=True)
class Result:
    """
    What was reached on a scene or a sequence.

    size: rows and columns. disparities: that were searched, from 0; told_by: who told it.
    frames: how many; truths: how many of them have one.
    outcomes: {(contestant's name, start): `Outcome`}, without those who have nothing.
    """

    found: Found
    size: tuple
    disparities: int
    told_by: str
    frames: int
    truths: int
    outcomes: dict

    @property
    def masks(self):
        """The names of the masks, the main one first."""
        return next((list(each.scores) for each in self.outcomes.values()), [])

    def main_error(self, name, start):
        """Return the percent of the main mask that is off by more than the limit, filled."""
        outcome = self.outcomes.get((name, start))
        if outcome is None or not outcome.scores:
            return None
        return outcome.scores[self.masks[0]].filled.bad_dense[self.found.limit]


def measure_scene(scene, contestants, disparities=None, repeats=1, show=None):
    """
    Return the `Result` of a scene.

    disparities: to search, from 0; None = as the scene tells. repeats: to take the time.
    show: called with the scene's `KnownPair`, its `Result` and {contestant's name: map}.
    """
    known = scene.files.read()
    disparities, told_by = searched(scene, [known.truth], disparities)
    size = known.left.shape[:2]
    outcomes, maps = {}, {}
    for contestant in contestants:
        task = Task(scene.family, disparities, size, repeats)
        start = contestant.starts[0]
        drawn = _played(contestant.name, contestant.player(task, start), scene.name, known)
        if drawn is not None:
            maps[contestant.name] = drawn.found
            outcomes[contestant.name, start] = Outcome(
                scored(known, drawn), drawn.milliseconds,
                speed(size, disparities, drawn.milliseconds))
    result = Result(scene, size, disparities, told_by, 1, 1, outcomes)
    if show is not None:
        show(known, result, maps)
    return result


def measure_sequence(sequence, contestants, disparities=None, repeats=1):
    """
    Return the `Result` of a sequence, from each start of each contestant.

    Raises NoSequence where its frames are not of one size.
    """
    with_truth = [files for files in sequence.frames.values() if files.truth is not None]
    size = next(iter(sequence.frames.values())).read().left.shape[:2]
    disparities, told_by = searched(sequence, (files.read().truth for files in with_truth),
                                    disparities)
    task = Task(sequence.family, disparities, size, repeats)
    outcomes = {}
    for contestant in contestants:
        for start in contestant.starts:
            outcome = _outcome(sequence, partial(
                _played, contestant.name, contestant.player(task, start)), task)
            if outcome is not None:
                outcomes[contestant.name, start] = outcome
    return Result(sequence, size, disparities, told_by, len(sequence.frames), len(with_truth),
                  outcomes)


def _played(who, play, name, known):
    """Return what a player says of a frame; its refusal names him and the frame."""
    try:
        return play(name, known)
    except ValueError as error:
        raise ValueError(f'{name}, {who}: {error}') from None


def _outcome(sequence, play, task):
    """Return the `Outcome` of one player; None where it has nothing for one of the frames."""
    scores, times, flickers, covered, before = [], [], [], [], None
    for number, files in sequence.frames.items():
        known = files.read()
        if known.left.shape[:2] != task.size:
            raise NoSequence(f'the frames of {sequence.name} are no sequence: {number} is '
                             f'{width_by_height(known.left)}, the first {task.size[1]}x'
                             f'{task.size[0]}')
        drawn = play(f'{sequence.name}/{number}', known)
        if drawn is None:
            return None
        if known.truth is not None:
            scores.append(scored(known, drawn))
        times.append(drawn.milliseconds)
        covered.append(100 * float(np.isfinite(drawn.found).mean()))
        if before is not None:
            flickers.append([flicker(*maps) for maps in zip(before[:2], drawn[:2])])
        before = drawn
    milliseconds = None if None in times else float(np.mean(times))
    return Outcome(
        mean_scores(scores), milliseconds, speed(task.size, task.disparities, milliseconds),
        tuple(map(float, np.mean(flickers, axis=0))), float(np.mean(covered)))


def searched(found, truths, given):
    """
    Return how many disparities are searched from 0 upwards, and who tells it.

    truths: float32 (R, C), pixels, NaN = unknown; what they reach counts where neither the
    user's number, given, nor the scene's own is there.
    """
    if given is not None:
        return given, '--disparities'
    if found.disparities is not None:
        return found.disparities, found.told_by
    largest = max((float(np.nanmax(truth)) for truth in truths if np.isfinite(truth).any()),
                  default=None)
    if largest is None:
        return MatcherConfig.disparities, 'the default'
    return max(math.ceil(largest) + 1, 1), TRUTHS_LARGEST


def scored(known, maps):
    """Return {mask: `Scores`} of `Maps` of a `KnownPair`."""
    found, filled = (known.as_scored(disparity) for disparity in maps[:2])
    return {name: Scores(score(found, known.truth, mask), score(filled, known.truth, mask))
            for name, mask in known.masks.items()}


def mean_scores(scores):
    """Return {mask: `Scores`}, the means of a list of such, each over those that have the mask."""
    means = {}
    for mask in MASKS:
        those = [each[mask] for each in scores if mask in each]
        if those:
            means[mask] = Scores(*(mean_score([getattr(each, kind) for each in those])
                                   for kind in ('found', 'filled')))
    return means


def mean_score(scores):
    """Return the `Score` whose figures are the means of others, and whose pixels the sum."""
    means = {}
    for figure in fields(Score):
        values = [getattr(each, figure.name) for each in scores]
        if figure.type is dict:
            means[figure.name] = {limit: float(np.mean([value[limit] for value in values]))
                                  for limit in values[0]}
        else:
            means[figure.name] = sum(values) if figure.type is int else float(np.mean(values))
    return Score(**means)


def speed(size, disparities, milliseconds):
    """Return million disparities tried per second; None where the time is not known."""
    if milliseconds is None:
        return None
    return size[0] * size[1] * disparities / milliseconds / 1000
