# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Measure matchers on scenes, and on sequences warm and cold: flat records.

Without ground truth: density, confidence, flicker, and whether the map of the left image agrees
with that of the right one, which the matcher finds in the mirrored pair. A map that agrees with
itself may still be wrong.
"""
from dataclasses import dataclass
from itertools import islice
import math

from fuzzy_stereo_ros.evaluation.ground_truth import (
    at_matches, GroundTruthPair, MASKS, TOLERANCE)
from fuzzy_stereo_ros.evaluation.matchers import Task
from fuzzy_stereo_ros.evaluation.scores import flicker, mean, score, THRESHOLDS
from fuzzy_stereo_ros.matching.search_range import PAIRS, search_range
from fuzzy_stereo_ros.pairs.stereo_pair import takes_part, width_by_height
import numpy as np

TRUTHS_LARGEST, SEEN = "the truth's largest, rounded up", 'the first pairs'
RAW, FILLED = MAPS = 'as it comes', 'filled'
SCENE, SEQUENCE, MEAN = 'scene', 'sequence', 'mean'
FIGURES = ('density', *(f'bad_{kind}_{limit:g}' for kind in ('sparse', 'dense')
                        for limit in THRESHOLDS),
           'd1_sparse', 'd1_dense', 'average_error', 'rms_error')
ROWS = 'row_tilt', 'row_roll', 'row_zoom', 'row_yaw', 'row_doubt', 'row_advice'
COLUMNS = (
    'kind', 'name', 'layout', 'family', 'rows', 'columns', 'disparities', 'disparities_told_by',
    'frames', 'truths', 'matcher', 'start', 'milliseconds', 'mde_per_second', 'covered', 'flicker',
    'agree', 'confidence', *ROWS, 'hint', 'mask', 'map', 'pixels', *FIGURES)


class NoSequence(ValueError):
    """Numbered frames are no sequence; the text is a sentence for the user."""


@dataclass(frozen=True)
class Result:
    """The result of matchers on a scene or a sequence."""

    subject: object  # the `Scene` or `Sequence`
    size: tuple  # rows and columns
    disparities: int  # number searched from 0
    source: str  # of this number, in words
    records: list  # dicts by COLUMNS, one for each matcher, start, mask and map of MAPS

    @property
    def has_truth(self):
        """Whether a frame has a ground truth."""
        return any(files.truth is not None for files in self.subject.files.values())

    def record(self, name, kind=FILLED):
        """Return the record of a matcher in the most important mask, None without a result."""
        return next((one for one in self.records
                     if one['matcher'] == name and one['map'] == kind), None)

    def main_error(self, name):
        """Return the percentage of bad pixels of the filled map, None without one."""
        record = self.record(name)
        return record and record.get(f'bad_dense_{self.subject.limit:g}')


def measure(subject, matchers, disparities=None, repeats=1, show=None):
    """
    Return the `Result` of matchers on a `Scene`, or from each start on a `Sequence`.

    disparities: number to search from 0, None = see `disparities_of`. repeats: see `Task`.
    show: called with the last pair, the `Result` and {matcher's name: last `Maps`} of a scene, or
    of a sequence without ground truth.
    Raises NoSequence if the frames differ in size, ValueError if a frame cannot be matched.
    """
    files = subject.named_files
    single = len(files) == 1
    with_truth = [one for one in files.values() if one.truth is not None]
    first = next(iter(files.values())).read()
    disparities, source = disparities_of(subject, (
        first.truth if single else one.read().truth for one in with_truth), disparities)
    task = Task(subject.family, disparities, first.left.shape[:2], repeats)
    shared = {'kind': SCENE if single else SEQUENCE, 'name': subject.path,
              'layout': subject.layout, 'family': subject.family, 'rows': task.size[0],
              'columns': task.size[1], 'disparities': disparities, 'disparities_told_by': source,
              'frames': len(files), 'truths': len(with_truth)}
    records, shown = [], {}
    for matcher in matchers:
        for start in matcher.starts[:1] if single else matcher.starts:
            frames = ((name, first if single else one.read()) for name, one in files.items())
            found, pair, maps = _match_frames(frames, matcher, start, task, not with_truth)
            records += [{**shared, 'matcher': matcher.name, 'start': start, **record}
                        for record in found]
            if maps is not None:
                shown[matcher.name] = maps
    result = Result(subject, task.size, disparities, source, records)
    if show is not None and (single or not with_truth):
        show(first if single else pair, result, shown)
    return result


def _match_frames(frames, matcher, start, task, mirrored):
    """Return records by mask and map, the last pair and its `Maps`; [], None, None without."""
    match, match_mirrored = (matcher.begin(task, start) if used else None
                             for used in (True, mirrored))
    figures, rows, flickers, last, hints = {}, [], [], None, []
    for name, pair in frames:
        if pair.left.shape[:2] != task.size:
            raise NoSequence(f'{name} is {width_by_height(pair.left)}, the first frame '
                             f'{task.size[1]}x{task.size[0]}; frames of a sequence have one size')
        try:
            maps = match(name, pair)
            if maps is None:
                return [], None, None
            other = match_mirrored and match_mirrored(name, GroundTruthPair(*(
                np.ascontiguousarray(image[:, ::-1]) for image in (pair.right, pair.left)), None))
        except ValueError as error:
            raise ValueError(f'{name}, {matcher.name}: {error}') from None
        if getattr(pair, 'missing', None) is not None:
            unseen = takes_part(maps.raw, pair.missing)
            maps = maps._replace(raw=np.where(unseen, np.float32(np.nan), maps.raw))
        for mask, where in getattr(pair, 'masks', {}).items():
            for kind, disparity in zip(MAPS, maps):
                figures.setdefault((mask, kind), []).append(
                    figures_of(score(disparity, pair.truth, where)))
        rows.append((maps.milliseconds, *_own_figures(maps, other)))
        if last is not None:
            flickers.append([flicker(*two) for two in zip(last[:2], maps[:2])])
        if not hints and getattr(pair, 'calibration', None) is not None:
            hints += pair.calibration.remarks
        if maps.finding is not None and maps.finding.sentence not in hints:
            hints.append(maps.finding.sentence)
        last = maps
    milliseconds, covered, confidence, agree = (
        None if None in one else mean(one) for one in zip(*rows))
    estimates = task.size[0] * task.size[1] * task.disparities
    shared = {'milliseconds': milliseconds, 'covered': covered,
              'mde_per_second': milliseconds and estimates / milliseconds / 1000}
    if mirrored:
        shared.update(confidence=confidence, agree=agree)
    if last.misalignment is not None:
        found = last.misalignment
        shared.update(zip(ROWS, (*found[:4], max(found.doubts), found.advice)))
    if hints:
        shared['hint'] = '; '.join(hints)
    records = []
    for mask in [mask for mask in MASKS if (mask, RAW) in figures] or ['']:
        for place, kind in enumerate(MAPS):
            records.append({**shared, 'mask': mask, 'map': kind,
                            **mean_figures(figures.get((mask, kind), []))})
            if flickers:
                records[-1]['flicker'] = mean(one[place] for one in flickers)
    return records, pair, last


def _own_figures(maps, other):
    """Return density, mean confidence, and share that agrees with the mirrored pair; percent."""
    valid, confidence, agree = np.isfinite(maps.raw), maps.confidence, None
    if confidence is not None:
        confidence = float(confidence[valid].mean()) if valid.any() else math.nan
    if other is not None:
        apart = np.abs(maps.raw - at_matches(maps.raw, other.raw[:, ::-1]))
        known = np.isfinite(apart)
        agree = 100 * float(np.mean(apart[known] <= TOLERANCE)) if known.any() else math.nan
    return 100 * float(valid.mean()), confidence, agree


def figures_of(one):
    """Return the figures of a `Score`, {name of a column: value}, among others."""
    return {**vars(one), **{
        f'bad_{kind}_{limit:g}': percent
        for kind, percents in (('sparse', one.bad_sparse), ('dense', one.bad_dense))
        for limit, percent in percents.items()}}


def mean_figures(several):
    """Return the means of several figures and the sum of their pixels, {} of none."""
    if not several:
        return {}
    return {'pixels': sum(int(one['pixels']) for one in several),
            **{name: mean(one[name] for one in several) for name in FIGURES}}


def mean_records(results, matchers):
    """Return means of scenes by family, matcher, mask and map; of matchers with all scenes."""
    records = []
    for family, those in by_family(results).items():
        for matcher in matchers:
            every = [[one for one in result.records if one['matcher'] == matcher.name]
                     for result in those]
            if not all(every):
                continue
            times = [one[0]['milliseconds'] for one in every]
            estimates = sum(result.size[0] * result.size[1] * result.disparities
                            for result in those)
            known = None not in times
            shared = {'kind': MEAN, 'name': family, 'family': family, 'matcher': matcher.name,
                      'start': matcher.starts[0],
                      'milliseconds': float(np.mean(times)) if known else None,
                      'mde_per_second': estimates / sum(times) / 1000 if known else None}
            for mask in MASKS:
                for kind in MAPS:
                    same = [one for scene in every for one in scene
                            if (one['mask'], one['map']) == (mask, kind)]
                    if same:
                        records.append({**shared, 'frames': len(same), 'mask': mask, 'map': kind,
                                        **mean_figures(same)})
    return records


def by_family(results):
    """Return {family: its `Result`s}."""
    families = {}
    for result in results:
        families.setdefault(result.subject.family, []).append(result)
    return families


def disparities_of(subject, truths, given):
    """Return the number to search from 0, and who says so: user, scene, truths, or first pairs."""
    if given is not None:
        return given, '--disparities'
    if subject.disparities is not None:
        return subject.disparities, subject.source
    largest = max((float(np.nanmax(truth)) for truth in truths if np.isfinite(truth).any()),
                  default=None)
    if largest is None:
        pairs = [one.read() for one in islice(subject.files.values(), PAIRS)]
        return sum(search_range([(one.left, one.right) for one in pairs], 1)), SEEN
    return max(math.ceil(largest) + 1, 1), TRUTHS_LARGEST
