# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The configuration of the matcher: every number declared once, with range, unit and sentence."""
from dataclasses import dataclass, field, fields, replace
import math
import numbers


@dataclass(frozen=True)
class Parameter:
    """What a value means and may be: of the matcher, the node, a scene, or a process."""

    name: str
    default: object
    sentence: str
    low: float | None = None    # range of the value
    high: float | None = None
    unit: str = ''
    choices: tuple = ()         # allowed values
    several: bool = False       # the value is a text of several choices, separated by blanks
    read_only: bool = False     # fixed when the node starts
    field: str = ''             # of MatcherConfig, '' for others

    @property
    def allowed(self):
        """The choices or the range as text; '' if any value is allowed."""
        if self.choices:
            return ', '.join(map(written, self.choices))
        if self.low is None:
            return ''
        return f'{written(self.low)} to {written(self.high)} {self.unit}'.strip()

    def described(self):
        """Return the sentence, followed by what is allowed."""
        return f'{self.sentence} [{self.allowed}]' if self.allowed else self.sentence

    def checked(self, value):
        """Return a value in the type of the default; ValueError if it is not allowed."""
        kind = type(self.default)
        wanted = {int: numbers.Integral, float: numbers.Real}.get(kind, kind)
        if (isinstance(value, wanted) and isinstance(value, bool) == (kind is bool)
                and (self.low is None or self.low <= value <= self.high)    # false for NaN, too
                and (not self.choices or {*(value.split() if self.several else [value])}
                     <= {*self.choices})):
            return kind(value)
        allowed = self.allowed or f'values like {self.default!r}'
        if self.low is not None:
            allowed = ('whole ' * (kind is int)
                       + f'numbers from {written(self.low)} to {written(self.high)}')
        raise ValueError(f'{self.name} is {value!r}; allowed are '
                         f"{'true and false' if kind is bool else allowed}")


def written(value):
    """Return a value as text: true instead of True, 54 instead of 54.0."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:.10g}' if isinstance(value, float) else str(value)


def _parameter(*facts, **more):
    row = Parameter('', *facts, **more)
    return field(default=row.default, metadata={'row': row})


@dataclass(frozen=True)
class MatcherConfig:
    """
    The configuration of a matcher, frozen; the defaults are those of the profile `realtime`.

    Where a sentence ends with profiles in brackets, the others ignore the parameter.
    Make changes with `dataclasses.replace`; a value that is not allowed raises a ValueError
    that says what was given and what is allowed.
    """

    disparities: int = _parameter(
        64, 'number of disparities searched, from min_disparity upwards', 1, 4096, 'px')
    min_disparity: int = _parameter(0, 'smallest disparity searched', -2048, 2048, 'px')
    reference: str = _parameter(
        'left', 'image the disparities belong to; ROS wants left, the paper matches from the '
        'right', choices=('left', 'right'))
    fill: bool = _parameter(
        False, 'fill rejected pixels from the background; a filled pixel has confidence 0. What '
        'was found to be nearer than the range stays invalid')
    fill_holes: int = _parameter(
        0, 'fill connected regions of at most so many rejected pixels, as fill does all; 0 fills '
        'none', 0, 1000000, 'px²')
    confidence_threshold: float = _parameter(
        0.0, 'pixels of less confidence are invalid', 0.0, 1.0)
    speckle_size: int = _parameter(
        100, 'connected regions smaller than this are rejected; 0 keeps all (realtime and '
        'quality)', 0, 1000000, 'px²')
    speckle_range: int = _parameter(
        1, 'largest step of disparity inside a connected region (realtime and quality)',
        0, 255, 'px')
    align_rows: bool = _parameter(
        True, 'undo the offset between the rows of both images, as it is measured')
    warm_start: bool = _parameter(
        True, 'average the pictures over frames, and begin with what the previous frame found: '
        'its best chromosome, or in paper all of its population')
    still_interval: int = _parameter(
        4, 'after 32 static frames match every n-th frame only, the others reuse the result; 1 '
        'matches every frame (realtime)', 1, 1000, 'frames')
    deadline_ms: float = _parameter(
        0.0, 'no operator starts after this time, nor, in realtime, one that would end after it; '
        '0 is no deadline, and only then are results the same on every run', 0.0, 3600000.0, 'ms')
    threads: int = _parameter(
        0, 'threads that match one pair, one for small images; 0 is one for each processor that '
        'the process may use; never changes the result', 0, 256)
    seed: int = _parameter(
        0, 'seed of the random numbers; equal seeds and input give equal output', 0, 2**31 - 1)
    population: int = _parameter(1, 'number of chromosomes (paper)', 1, 1000)
    generations: int = _parameter(
        1, 'largest number of generations in one frame; quality runs one where it begins with the '
        'map of the previous frame', 0, 1000000)
    algorithm: str = _parameter(
        'realtime', 'genetic algorithm, by the name of its profile',
        choices=('realtime', 'quality', 'paper'))
    planes: bool = _parameter(
        True, 'give planes to regions of weak texture, and take the median of similar pixels; '
        'without it is quicker and less exact (realtime)')
    mutation_rate: float = _parameter(
        0.4, 'share of the children that mutate (paper); in its literal reading the share of the '
        'cells, the least possible ones, that may mutate', 0.0, 1.0)
    reading: str = _parameter(
        'uniform', 'Eq. 1 to 4 as printed, or what the words of the paper allow: possibilities of '
        'the uniform cells around, and smoothness (paper)', choices=('literal', 'uniform'))
    initial_population: str = _parameter(
        'random', 'what evolution starts from: random genes, or the most possible ones (paper)',
        choices=('random', 'winner_takes_all'))
    neighbourhood: int = _parameter(
        25, 'side of the square N of Eq. 3 and, at the most, of mutated patches, odd (paper; the '
        'paper leaves it open)', 1, 31, 'px')

    def __post_init__(self):
        for row in ROWS:
            row.checked(getattr(self, row.name))
        if self.neighbourhood % 2 == 0:
            raise ValueError(
                f'neighbourhood is {self.neighbourhood}; allowed are odd numbers from 1 to 31')

    @classmethod
    def from_profile(cls, name='realtime', /, **changes):
        """
        Return the configuration of a profile with single values changed.

        name: one of `PROFILES`, or a MatcherConfig to be changed. Unknown profiles and parameters
        raise ValueError.
        """
        if not isinstance(name, cls):
            if not isinstance(name, str) or name not in PROFILES:
                raise ValueError(f"profile is '{name}'; allowed are {', '.join(PROFILES)}")
            name = cls(**PROFILES[name])
        unknown = set(changes) - {parameter.name for parameter in fields(cls)}
        if unknown:
            raise ValueError(
                f"no parameter is called {', '.join(sorted(unknown))}; "
                f"there are {', '.join(parameter.name for parameter in fields(cls))}")
        return replace(name, **changes)

    def at_scale(self, scale):
        """Return it for images at a scale above 0, up to 1: lengths, areas scaled; ValueError."""
        if not 0 < scale <= 1:
            raise ValueError(f'scale is {scale!r}; allowed are numbers above 0 up to 1')
        first = math.floor(self.min_disparity * scale)
        last = math.ceil((self.min_disparity + self.disparities - 1) * scale)
        scaled = {row.name: max(round(value * factor), min(value, 1))
                  for unit, factor in (('px', scale), ('px²', scale**2)) for row in ROWS
                  for value in (getattr(self, row.name),) if row.unit == unit}
        return replace(self, **scaled | {
            'min_disparity': first, 'disparities': last - first + 1,
            'neighbourhood': scaled['neighbourhood'] | 1})      # odd

    def rejects(self, confidence):
        """Return where the disparity of a confidence, float (R, C), is invalid: bool (R, C)."""
        return (confidence == 0) | (confidence < self.confidence_threshold)


ROWS = tuple(replace(one.metadata['row'], name=one.name, field=one.name)
             for one in fields(MatcherConfig))
PROFILES = {
    'realtime': {},
    'fast': {'planes': False},
    'quality': {'generations': 4, 'algorithm': 'quality'},
    'paper': {'speckle_size': 0, 'population': 70, 'generations': 100, 'algorithm': 'paper'},
    'paper_live': {'speckle_size': 0, 'population': 4, 'generations': 24, 'algorithm': 'paper',
                   'mutation_rate': 1.0},
}
