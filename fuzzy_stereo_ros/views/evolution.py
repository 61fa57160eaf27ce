# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The course of an evolution, its figure and its film: of generations or of frames, its steps.

Matching does not depend on it. The first row of the figure has the image and the curves. A row
for each of some steps follows: the best chromosome, its possibility, and the origin of its genes
(as Figures 4 and 5 of the paper, with more generations). The film has one such row. Both need
matplotlib.
"""
from dataclasses import replace
from typing import NamedTuple

from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map, score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.views.pictures import as_rgb, show_map
from fuzzy_stereo_ros.views.video import VideoFile
import numpy as np

FIRST, SECOND, MUTATED = range(3)       # the origin of a gene
ORIGINS = {
    'paper': {FIRST: 'first parent', SECOND: 'second parent', MUTATED: 'mutation'},
    'realtime': {FIRST: 'kept', MUTATED: 'planes of plain regions'},
    'quality': {FIRST: 'kept', MUTATED: 'planes of segments'},
    'frames of realtime': {
        FIRST: 'previous best', SECOND: 'half-size map', MUTATED: 'mutated by one'},
    'frames': {FIRST: 'kept', MUTATED: 'new'}}
ORIGIN_COLOURS = {FIRST: '#3b6fb6', SECOND: '#f2a93b', MUTATED: '#d62768'}
CURVE_COLOURS = {'best': '#1a7f37', 'mean': '#555555', 'worst': '#b35900', 'wrong': '#b3261e'}
UNITS = {'best': 'px', 'error': 'error in px; grey does not count'}     # of panels
BACKGROUNDS = {'origin': '#ffffff', 'error': '#8a8a8a'}     # no parents yet; no ground truth
BETWEEN = 1 / 3, 2 / 3  # exponents of the last step, of steps in a figure
WIDTH = 3.4         # inches of a panel with its margins
HEIGHTS = 1.4, 6.0  # least and most inches of a panel
PANEL_SPACE = 0.5   # inches above and below a panel
BELOW = 1.2         # inches of the title and the colour bars
DOTS = 100, 200     # least and most dots per inch; between them a dot is a pixel of the images
FAR_OFF = 1e6       # px, an error that has the brightest colour
LIMITS = -4, 4      # powers of ten of the fitness beyond which its axis has a factor
BRIGHTEST = 95      # percentile of possibilities
FEW = 12            # steps up to which curves have markers
DURATION = 10       # seconds of a film
RATES = 1, 10       # least and most steps per second
STAY = 2            # seconds for which the last picture stays


class Snapshot(NamedTuple):
    """A generation, of which 0 is the initial population, or a frame, from 1."""

    number: int
    image: np.ndarray           # the reference image, of which all maps are
    best: np.ndarray            # float32 (R, C), px, the fittest chromosome, of a frame the result
    possibility: np.ndarray     # float32 (R, C), 0 to 1, of the chromosome
    fitness: np.ndarray         # float64 (P,), of all chromosomes, higher is fitter
    # uint8 (R, C), of the genes: in `paper` of the fittest child, in frames of `realtime` and
    # `fast` of those selected in tiles, else MUTATED where another was best before; or None.
    origin: np.ndarray | None
    match: object = None        # of a frame


def observe_generations(config, left, right, observe):
    """Match a pair cold; return its Match; observe(snapshot): called with each, also the first."""
    config, former = replace(config, deadline_ms=0.0), None

    def take(number, genes):
        nonlocal former
        observe(_snapshot(matcher, number, (left, right), genes, former))
        former = genes.copy()

    matcher = StereoMatcher(replace(config, generations=0))
    matcher.match(left, right)
    take(0, matcher.algorithm.population.genes)
    matcher = StereoMatcher(config)
    return matcher.match(left, right, observe=take)


def observe_frames(config, pairs, observe):
    """Match pairs of images one after the other; observe(snapshot): called with each frame's."""
    matcher, former = StereoMatcher(config), None
    for number, images in enumerate(pairs, 1):
        match = matcher.match(*images)
        population = matcher.algorithm.population
        genes = population.genes[population.best][np.newaxis]
        observe(_snapshot(matcher, number, images, genes, former, match))
        former = genes.copy()


def origin_of_fittest_child(former, population, fitness, lineage):
    """Return the origin, uint8 (R, C), of genes of the fittest child; of both: FIRST."""
    if not lineage.children.size:
        return np.full(population.shape[1:], FIRST, np.uint8)
    place = fitness[lineage.children].argmax()
    first, second = (population[lineage.children[place]] == former[parent]
                     for parent in lineage.parents[place])
    return np.where(first, FIRST, np.where(second, SECOND, MUTATED)).astype(np.uint8)


def _snapshot(matcher, number, images, genes, former, match=None):
    """Return the Snapshot of genes, (P, R, C), and those before, None; of a frame of the best."""
    config, algorithm = matcher.config, matcher.algorithm
    population, origin = algorithm.population, None
    if match is not None and config.algorithm == 'realtime':
        # InheritedGenes.origin_of_genes counts from mutation to the previous best.
        origin = MUTATED - algorithm.origin_of_genes()
    elif former is not None and former.shape == genes.shape:
        origin = origin_of_fittest_child(
            former, genes, population.fitness, population.lineage
        ) if match is None and config.algorithm == 'paper' else np.where(
            genes[0] != former[0], MUTATED, FIRST).astype(np.uint8)
    best = genes[0 if match is not None else population.best]
    mirrored = config.reference == 'right'      # the search then is
    chromosome, possibility, origin = (
        one if one is None else np.ascontiguousarray(one[:, ::-1 if mirrored else 1]) for one in (
            best + np.float32(config.min_disparity), algorithm.possibility_of(best), origin))
    return Snapshot(number, images[mirrored], chromosome if match is None else match.disparity,
                    possibility, population.fitness.copy(), origin, match)


class Course:
    """
    The course of an evolution: figures of all steps, Snapshots of up to five.

    config: its MatcherConfig. truth, mask: arguments of `scores.score`, or None. frames: their
    number, 0 if it is one of generations. profile: its name, for titles; None = that of the
    algorithm. rows: the figures of each step so far, {name: value}; bad_1: percentage off by more
    than 1 px, None without a truth; origins: {word: share of the genes}, {} without an origin.
    shown: Snapshots of the first two steps, of two more by equal factors, and of the last one.
    """

    def __init__(self, config, truth=None, mask=None, frames=0, profile=None):
        self.config, self.truth, self.mask, self.frames = config, truth, mask, frames
        self.profile = profile or config.algorithm
        self.rows, self.shown = [], []
        self.step, self.count = ('frame', frames) if frames else (
            'generation', config.generations)
        self._wanted = {bool(frames), bool(frames) + 1,
                        *(round(self.count**exponent) for exponent in BETWEEN)}
        self.words = ORIGINS[config.algorithm if not frames else 'frames of realtime'
                             if config.algorithm == 'realtime' else 'frames']

    def add(self, snapshot):
        """Add the Snapshot of the next step."""
        fitness, match = snapshot.fitness, snapshot.match
        self.rows.append({
            'number': snapshot.number, 'best_fitness': float(fitness.max()),
            'mean_fitness': float(fitness.mean()), 'worst_fitness': float(fitness.min()),
            'bad_1': None if self.truth is None else score(
                snapshot.best, self.truth, self.mask).bad_dense[1.0],
            'origins': {} if snapshot.origin is None else {
                word: float(np.mean(snapshot.origin == code))
                for code, word in self.words.items()},
            **({} if match is None else {'warm': match.warm, 'gains': match.gains})})
        if self.shown and self.shown[-1].number not in self._wanted:
            self.shown.pop()
        self.shown.append(snapshot)


class EvolutionFilm(VideoFile):
    """A video with a picture for each step, drawn one by one; rate: of these, per second."""

    def __init__(self, path, course):
        """Prepare for a Course without Snapshots; raises ValueError as VideoFile does."""
        super().__init__(path, min(max(round(course.count / DURATION), RATES[0]), RATES[1]))
        self._course, self._layout, self._last = course, None, None

    def add(self):
        """Append the picture of the Snapshot that was added to the Course last."""
        if self._layout is None:
            self._layout = EvolutionFigure(self._course, self._course.shown[-1:], DOTS[0])
        else:
            self._layout.draw(self._course.shown[-1:])
        figure = self._layout.figure
        figure.canvas.draw()
        figure.set_layout_engine('none')    # panels keep their places in the next pictures
        self._last = np.ascontiguousarray(np.asarray(figure.canvas.buffer_rgba())[:, :, 2::-1])
        self.write(self._last)

    def close(self):
        """Repeat the last picture for STAY seconds and finish the file; see VideoFile.close."""
        for _ in range(self.rate * STAY if self._last is not None else 0):
            self.write(self._last)
        super().close()


class EvolutionFigure:
    """The panels and curves of a Course; figure: the Figure of matplotlib."""

    def __init__(self, course, snapshots, dots=None):
        """Draw the Snapshots; dots: per inch, None = so that a dot is a pixel."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._course = course
        self._scales = _scales(course, max(float(np.percentile(one.possibility, BRIGHTEST))
                                           for one in snapshots))
        across = 3 if course.truth is None else 5       # panels of the first row
        rows, columns = snapshots[0].best.shape
        height = min(max(WIDTH * rows / columns, HEIGHTS[0]), HEIGHTS[1])
        self.figure = Figure(
            figsize=(across * WIDTH, (len(snapshots) + 1) * (height + PANEL_SPACE) + BELOW),
            layout='constrained', dpi=dots or min(max(columns / WIDTH, DOTS[0]), DOTS[1]))
        self.figure.get_layout_engine().set(h_pad=0.08, w_pad=0.06)
        FigureCanvasAgg(self.figure)
        self._above, *self._below = self.figure.subplots(len(snapshots) + 1, across)
        for place in (place for line in self._below for place in line[len(self._scales):]):
            place.remove()
        self.draw(snapshots)
        for name, *places in zip(self._scales, *self._below):
            bar = self.figure.colorbar(
                places[0].images[0], ax=places, location='bottom', aspect=30, pad=0.02,
                extend='max' if name in ('error', 'possibility') else 'neither')
            bar.set_label(UNITS.get(name, ''), size='small')
            bar.ax.tick_params(labelsize='small')
            if name == 'origin':
                bar.set_ticks([*course.words], labels=course.words.values())

    def draw(self, snapshots):
        """Draw Snapshots, one into each row, and the curves of the Course."""
        course, config = self._course, self._course.config
        above = iter(self._above)
        _show(next(above), f'{config.reference} image, the reference', as_rgb(snapshots[0].image))
        if course.truth is not None:
            _show(next(above), 'ground truth; hatched is unknown', course.truth,
                  **self._scales['best'])
        for line, snapshot in zip(self._below, snapshots):
            for place, (name, panel) in zip(line, panels_of(snapshot, course).items()):
                _show(place, *panel, **self._scales[name])
                if name in BACKGROUNDS:
                    place.patch.set(facecolor=BACKGROUNDS[name], hatch=None)
        scale = '1 is perfect' if config.algorithm != 'paper' else (
            'Eq. 3 as printed' if config.reading == 'literal' else f'{config.reading} reading')
        place = self._curves(next(above), f'fitness ({scale})', {name: (
            CURVE_COLOURS[name], [row[f'{name}_fitness'] for row in course.rows])
            for name in ('best', 'mean', 'worst')})
        place.ticklabel_format(axis='y', scilimits=LIMITS)
        self._curves(next(above), 'origin of genes [%]', {word: (ORIGIN_COLOURS[code], [
            100 * row['origins'].get(word, np.nan) for row in course.rows])
            for code, word in course.words.items()})
        if course.truth is not None:
            wrong = [row['bad_1'] for row in course.rows]
            place = self._curves(next(above), 'best: off by more than 1 px [%]', {
                'best': (CURVE_COLOURS['wrong'], wrong)})
            place.set_ylim(0, max(1.1 * max(wrong), 1))
        # The evolution of `realtime` may converge earlier.
        most = 'at most ' * (config.algorithm == 'realtime' and not course.frames)
        lowest = config.min_disparity
        self.figure.suptitle(
            f"{course.step} {course.rows[-1]['number']} of {most}{course.count}, profile "
            f'{course.profile}, population {config.population}, disparities {lowest} to '
            f'{lowest + config.disparities - 1} px')

    def _curves(self, place, title, lines):
        """Draw lines, {label: (colour, values)}, into Axes and return these."""
        numbers = [row['number'] for row in self._course.rows]
        place.clear()
        for label, (colour, values) in lines.items():
            place.plot(numbers, values, marker='o' if len(numbers) < FEW else None, markersize=4,
                       label=label, color=colour)
        place.set_title(title, size='small')
        place.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
        place.tick_params(labelsize='small')
        place.set_xlabel(self._course.step, size='small')
        place.set_xlim(numbers[0] - 0.5, self._course.count + 0.5)
        place.grid(alpha=0.3)
        place.legend(fontsize='small')
        return place


def _show(place, title, values, **colours):
    """Draw an image, or a map in colours, into Axes."""
    place.clear()
    show_map(place, values, '', bar=False, **colours)
    place.set_title(title, size='small')
    place.set_anchor('N')       # aligns the titles of a row


def panels_of(snapshot, course):
    """Return the panels of a Snapshot of a Course, {name: (title, float (R, C), NaN = none)}."""
    what = 'disparity' if course.frames else 'best chromosome'
    panels = {'best': (f'{course.step} {snapshot.number}: {what}', snapshot.best)}
    if course.truth is not None:
        counted = True if course.mask is None else course.mask
        wrong, = (row['bad_1'] for row in course.rows if row['number'] == snapshot.number)
        found = np.nan_to_num(snapshot.best, nan=-FAR_OFF)     # no disparity counts as wrong
        panels['error'] = (f'{wrong:.2f} % off by more than 1 px',
                           np.where(counted, error_map(found, course.truth), np.nan))
    panels['possibility'] = (f'its possibility, mean {snapshot.possibility.mean():.4f}',
                             snapshot.possibility)
    panels['origin'] = ('no parents yet', np.full(snapshot.best.shape, np.nan)
                        ) if snapshot.origin is None else (
        'genes of the fittest child' if course.words is ORIGINS['paper'] else
        f'genes, {100 * np.mean(snapshot.origin == MUTATED):.2f} % new', snapshot.origin)
    return panels


def _scales(course, brightest):
    from matplotlib.colors import ListedColormap, Normalize

    lowest = course.config.min_disparity
    highest = lowest + max(course.config.disparities - 1, 1)
    return {name: {'cmap': cmap, 'norm': Normalize(*ends), 'interpolation': 'nearest'}
            for name, cmap, ends in (
        ('best', 'turbo', (lowest, highest)), ('error', 'magma', (0, ERROR_LIMIT)),
        ('possibility', 'viridis', (0, max(brightest, 0.05))),
        ('origin', ListedColormap([*ORIGIN_COLOURS.values()]), (-0.5, len(ORIGIN_COLOURS) - 0.5)))
        if name != 'error' or course.truth is not None}
