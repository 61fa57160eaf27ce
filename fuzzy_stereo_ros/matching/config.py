# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The configuration of the matcher: every number declared once, with range, unit and sentence."""
from dataclasses import dataclass, field, fields, replace
import math
import numbers


def _number(default, low, high, unit, sentence):
    return field(default=default,
                 metadata={'low': low, 'high': high, 'unit': unit, 'sentence': sentence})


def _switch(default, sentence):
    return field(default=default, metadata={'sentence': sentence})


def _choice(default, choices, sentence):
    return field(default=default, metadata={'choices': choices, 'sentence': sentence})


@dataclass(frozen=True)
class MatcherConfig:
    """
    The configuration of a matcher, frozen; the defaults are those of the profile `realtime`.

    Where a sentence ends with profiles in brackets, the others ignore the parameter.
    Make changes with `dataclasses.replace`; a value that is not allowed raises a ValueError
    that says what was given and what is allowed.
    """

    disparities: int = _number(
        64, 1, 4096, 'px', 'number of disparities searched, from min_disparity upwards')
    min_disparity: int = _number(
        0, -2048, 2048, 'px', 'smallest disparity searched')
    reference: str = _choice(
        'left', ('left', 'right'),
        'image the disparities belong to; ROS wants left, the paper matches from the right')
    fill: bool = _switch(
        False, 'fill rejected pixels from the background; a filled pixel has confidence 0. What '
        'was found to be nearer than the range stays invalid')
    fill_holes: int = _number(
        0, 0, 1000000, 'px²', 'fill connected regions of at most so many rejected pixels, as fill '
        'does all; 0 fills none')
    confidence_threshold: float = _number(
        0.0, 0.0, 1.0, '', 'pixels of less confidence are invalid')
    speckle_size: int = _number(
        100, 0, 1000000, 'px²',
        'connected regions smaller than this are rejected; 0 keeps all (realtime and '
        'quality)')
    speckle_range: int = _number(
        1, 0, 255, 'px',
        'largest step of disparity inside a connected region (realtime and quality)')
    align_rows: bool = _switch(
        True, 'undo the offset between the rows of both images, as it is measured')
    warm_start: bool = _switch(
        True, 'average the pictures over frames, and begin with what the previous frame found: '
        'its best chromosome, or in paper all of its population')
    still_interval: int = _number(
        4, 1, 1000, 'frames',
        'after 32 static frames match every n-th frame only, the others reuse the result; 1 '
        'matches every frame (realtime)')
    deadline_ms: float = _number(
        0.0, 0.0, 3600000.0, 'ms',
        'no operator starts after this time, nor, in realtime, one that would end after it; 0 is '
        'no deadline, and only then are results the same on every run')
    threads: int = _number(
        0, 0, 256, '', 'threads that match one pair, one for small images; 0 is one for each '
        'processor that the process may use; never changes the result')
    seed: int = _number(
        0, 0, 2**31 - 1, '', 'seed of the random numbers; equal seeds and input give equal output')
    population: int = _number(
        1, 1, 1000, '', 'number of chromosomes (paper)')
    generations: int = _number(
        1, 0, 1000000, '', 'largest number of generations in one frame; quality runs one where it '
        'begins with the map of the previous frame')
    algorithm: str = _choice(
        'realtime', ('realtime', 'quality', 'paper'),
        'genetic algorithm, by the name of its profile')
    planes: bool = _switch(
        True, 'give planes to regions of weak texture, and take the median of similar pixels; '
        'without it is quicker and less exact (realtime)')
    mutation_rate: float = _number(
        0.4, 0.0, 1.0, '',
        'share of the children that mutate (paper); in its literal reading the share of the '
        'cells, the least possible ones, that may mutate')
    elite: float = _number(
        0.4, 0.0, 1.0, '',
        'share of the population, the fittest, that is retained and has children (paper)')
    reading: str = _choice(
        'uniform', ('literal', 'uniform'),
        'Eq. 1 to 4 as printed, or what the words of the paper allow: possibilities of the '
        'uniform cells around, and smoothness (paper)')
    initial_population: str = _choice(
        'random', ('random', 'winner_takes_all'),
        'what evolution starts from: random genes, or the most possible ones (paper)')
    class_sigma: float = _number(
        54.0, 1.0, 1000.0, 'grey levels of 8 bits',
        'standard deviation of the grey classes of Eq. 1; 54 makes two neighbouring classes '
        'cross at one half (paper; the paper leaves it open)')
    neighbourhood: int = _number(
        25, 1, 31, 'px',
        'side of the square N of Eq. 3 and, at the most, of mutated patches, odd (paper; the '
        'paper leaves it open)')

    def __post_init__(self):
        for parameter in fields(self):
            _check(parameter, getattr(self, parameter.name))
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
        """
        Return the configuration for images reduced to a scale, 0 < scale <= 1.

        Lengths (px) and areas (px²) are scaled, and stay above 0 where they are; the same
        distances are searched. At scale 1 it is equal to this one. Raises ValueError for another
        scale.
        """
        if not 0 < scale <= 1:
            raise ValueError(f'scale is {scale!r}; allowed are numbers above 0 up to 1')
        first = math.floor(self.min_disparity * scale)
        last = math.ceil((self.min_disparity + self.disparities - 1) * scale)
        scaled = {one.name: max(round(value * factor), min(value, 1))
                  for unit, factor in (('px', scale), ('px²', scale**2)) for one in fields(self)
                  for value in (getattr(self, one.name),) if one.metadata.get('unit') == unit}
        return replace(self, **scaled | {
            'min_disparity': first, 'disparities': last - first + 1,
            'neighbourhood': scaled['neighbourhood'] | 1})      # odd

    def rejects(self, confidence):
        """Return where the disparity of a confidence, float (R, C), is invalid: bool (R, C)."""
        return (confidence == 0) | (confidence < self.confidence_threshold)


PROFILES = {
    'realtime': {},
    'fast': {
        'planes': False,
    },
    'quality': {
        'generations': 4,
        'algorithm': 'quality',
    },
    'paper': {
        'speckle_size': 0,
        'population': 70,
        'generations': 100,
        'algorithm': 'paper',
    },
    'paper_live': {
        'speckle_size': 0,
        'population': 4,
        'generations': 24,
        'algorithm': 'paper',
        'mutation_rate': 1.0,
    },
}


def _check(parameter, value):
    """Raise ValueError unless value is of the parameter's type and in its range."""
    kind, name = parameter.type, parameter.name
    if kind is bool:
        if not isinstance(value, bool):
            raise ValueError(f'{name} is {value!r}; allowed are true and false')
        return
    if kind is str:
        choices = parameter.metadata['choices']
        if not isinstance(value, str) or value not in choices:
            raise ValueError(f"{name} is {value!r}; allowed are {', '.join(choices)}")
        return
    low, high = parameter.metadata['low'], parameter.metadata['high']
    wanted = numbers.Integral if kind is int else numbers.Real
    if (not isinstance(value, wanted) or isinstance(value, bool)
            or not low <= value <= high):     # false for NaN, too
        what = 'whole numbers' if kind is int else 'numbers'
        raise ValueError(f'{name} is {value!r}; allowed are {what} from {low} to {high}')
