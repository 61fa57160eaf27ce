# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Figures of an evolution and of a sequence, and an animation; all need matplotlib.

The first row has the images and the convergence curves. A row for each of some generations
follows: the best chromosome, its possibility, the origin of its genes, the mutated cells (as
Figures 4 and 5 of the paper, with more generations). The animation has one such row.
"""
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map
from fuzzy_stereo_ros.views.evolution_record import (
    FIRST, MUTATED, mutates, ORIGINS, SECOND, shown_frames)
from fuzzy_stereo_ros.views.pictures import as_rgb, show_map
from fuzzy_stereo_ros.views.video import VideoFile
import numpy as np

ORIGIN_COLOURS = {FIRST: '#3b6fb6', SECOND: '#f2a93b', MUTATED: '#d62768'}
ORIGIN_WORDS = {
    'paper': {FIRST: 'first parent', SECOND: 'second parent', MUTATED: 'mutation'},
    'realtime': {FIRST: 'kept', MUTATED: 'planes of plain regions'},
    'quality': {FIRST: 'kept', MUTATED: 'planes of segments and tiles'}}
PARENT_COLOURS = '#d62768', '#f2a93b', '#3b6fb6'    # of ORIGINS
CURVE_COLOURS = {'best': '#1a7f37', 'mean': '#555555', 'worst': '#b35900', 'wrong': '#b3261e'}
NOTHING, UNCOUNTED = '#ffffff', '#8a8a8a'   # no parents yet; no ground truth
TRUTH_TITLE = 'ground truth; hatched is unknown'
WIDTH = 3.4         # inches of a panel with its margins
FRAME_BESIDE = 0.8, 0.4   # inches beside and above a map of a sequence
HEIGHTS = 1.4, 6.0  # least and most inches of a panel
PANEL_SPACE = 0.5   # inches above and below a panel
BELOW = 1.2         # inches of the title and the colour bars
DOTS = 100, 200     # least and most dots per inch; between them a dot is a pixel of the images
LIMITS = -4, 4      # powers of ten of the fitness beyond which its axis has a factor
BRIGHTEST = 95      # percentile of possibilities
FEW = 12            # generations up to which curves have markers
DURATION = 10       # seconds of an animation
RATES = 1, 10       # least and most generations per second
STAY = 2            # seconds for which the last frame stays


def evolution_figure(convergence, match):
    """Return the Figure of an evolution; convergence: Convergence of all generations."""
    snapshots = convergence.shown()
    layout = _Layout(convergence, snapshots, match.disparity)
    layout.draw_curves()
    return layout.figure


class EvolutionAnimation(VideoFile):
    """
    A video with a frame for each generation, drawn one by one.

    rate: generations per second. figure: of the frames.
    """

    def __init__(self, path, convergence):
        """Prepare for a Convergence without Snapshots; raises ValueError as VideoFile does."""
        rate = round(convergence.config.generations / DURATION)
        super().__init__(path, min(max(rate, RATES[0]), RATES[1]))
        self._convergence, self._layout, self.figure, self._last = convergence, None, None, None

    def add(self, snapshot):
        """Append the frame of the Snapshot that was added to the Convergence last."""
        self._last = self.frame(snapshot)
        self.write(self._last)

    def frame(self, snapshot):
        """Return the frame of the Snapshot that was added last: uint8 (R, C, 3) BGR."""
        if self._layout is None:
            self._layout = _Layout(self._convergence, [snapshot], dots=DOTS[0])
            self.figure = self._layout.figure
        self._layout.draw(0, snapshot)
        self._layout.draw_curves()
        canvas = self.figure.canvas
        canvas.draw()
        self.figure.set_layout_engine('none')   # panels keep their places in the next frames
        return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, 2::-1])

    def close(self):
        """Repeat the last frame for STAY seconds and finish the file; see VideoFile.close."""
        if self._last is not None:
            for _ in range(self.rate * STAY):
                self.write(self._last)
        super().close()


class _Layout:
    """A grid of panels and curves; figure: the Figure."""

    def __init__(self, convergence, snapshots, result=None, dots=None):
        """
        Draw the images, and a row of panels for each Snapshot.

        result: float (R, C), px, of the match, or None. dots: per inch.
        """
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._convergence, self._config, self._drawn = convergence, convergence.config, {}
        above = {'image': None}
        if convergence.truth is not None:
            above['truth'] = convergence.truth, TRUTH_TITLE
        if result is not None:
            refined = '' if self._config.algorithm == 'paper' else ', refined'
            invalid = '; hatched is invalid' if np.isnan(result).any() else ''
            above['result'] = result, f'result{refined}{invalid}'
        curves = ['fitness'] if convergence.truth is None else ['fitness', 'wrong']
        names, self._rows = list(panels_of(snapshots[-1], convergence)), len(snapshots)
        across = max(len(names), len(above) + len(curves))
        free = across - len(above) - len(curves)
        mosaic = [[*above, *curves[:1] * free, *curves]] + [
            [f'{name} {row}' for name in names] + ['.'] * (across - len(names))
            for row in range(self._rows)]
        columns = convergence.image.shape[1]
        height = min(max(WIDTH * convergence.image.shape[0] / columns, HEIGHTS[0]), HEIGHTS[1])
        self.figure = Figure(
            figsize=(across * WIDTH, (self._rows + 1) * (height + PANEL_SPACE) + BELOW),
            layout='constrained', dpi=dots or min(max(columns / WIDTH, DOTS[0]), DOTS[1]))
        self.figure.get_layout_engine().set(h_pad=0.08, w_pad=0.06)
        FigureCanvasAgg(self.figure)
        self._places = self.figure.subplot_mosaic(mosaic)
        image = self._places['image']
        show_map(image, as_rgb(convergence.image), '')
        image.set_anchor('N')       # aligns the titles of a row
        image.set_title(f'{self._config.reference} image, the reference', size='small')
        for name, (values, title) in list(above.items())[1:]:
            self._show(name, 'best', values, title)     # the bar of the chromosomes explains it
        self._brightest = brightest(snapshot.possibility for snapshot in snapshots)
        for row, snapshot in enumerate(snapshots):
            self.draw(row, snapshot)

    def draw(self, row, snapshot):
        """Draw the panels of a Snapshot into a row; the last row gets the legends."""
        self._brightest = max(self._brightest, brightest([snapshot.possibility]))
        for name, (values, title) in panels_of(snapshot, self._convergence).items():
            key = f'{name} {row}'
            place = self._places[key]
            if key in self._drawn:
                self._drawn[key].set_data(np.ma.masked_invalid(values))
                place.set_title(title, size='small')
            else:
                self._drawn[key] = self._show(key, name, values, title)
                if row == self._rows - 1:
                    self._explain(name, self._drawn[key])
            if name == 'possibility':
                self._drawn[key].set_clim(0, self._brightest)
            for part in (place.patch, *place.spines.values()):
                part.set_visible(bool(np.isfinite(values).any()))

    def draw_curves(self):
        """Draw the curves of fitness and, with a truth, of the error of the best chromosome."""
        convergence, config = self._convergence, self._config
        scale = '1 is perfect' if config.algorithm != 'paper' else (
            'Eq. 3 as printed' if config.reading == 'literal' else f'{config.reading} reading')
        place = self._places['fitness']
        place.clear()
        for name in ('best', 'mean', 'worst'):
            self._draw_curve(place, name, f'{name}_fitness')
        place.set_title(f'fitness ({scale})', size='small')
        place.ticklabel_format(axis='y', scilimits=LIMITS)
        place.legend(fontsize='small', loc='lower right')
        if convergence.truth is not None:
            place = self._places['wrong']
            place.clear()
            self._draw_curve(place, 'wrong', 'bad_1')
            place.set_title('best: off by more than 1 px [%]', size='small')
            place.set_ylim(0, max(1.1 * max(row.bad_1 for row in convergence.rows), 1))
        lowest = config.min_disparity
        most = 'at most ' if config.algorithm == 'realtime' else ''     # it may converge earlier
        self.figure.suptitle(
            f'generation {convergence.rows[-1].number} of {most}{config.generations}, profile '
            f'{config.algorithm}, population {config.population}, disparities {lowest} to '
            f'{lowest + config.disparities - 1} px')

    def _draw_curve(self, place, name, figure):
        rows = self._convergence.rows
        place.plot([row.number for row in rows], [getattr(row, figure) for row in rows],
                   marker='o' if len(rows) < FEW else None, markersize=4, label=name,
                   color=CURVE_COLOURS[name])
        place.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
        place.tick_params(labelsize='small')
        place.set_xlabel('generation', size='small')
        place.set_xlim(-0.5, self._config.generations + 0.5)
        place.grid(alpha=0.3)

    def _show(self, place, name, values, title):
        """Draw a map in the colours of a panel; return its AxesImage."""
        drawn = show_map(self._places[place], values, '', bar=False,
                         **_colours(name, self._config))
        drawn.axes.set_title(title, size='small')
        drawn.axes.set_anchor('N')
        background = {'origin': NOTHING, 'mutated': NOTHING, 'error': UNCOUNTED}.get(name)
        if background:
            drawn.axes.patch.set(facecolor=background, hatch=None)
        return drawn

    def _explain(self, name, drawn):
        """Add a bar of colours below the panels of a name, of origins with words."""
        config, places = self._config, [self._places[f'{name} {row}'] for row in range(self._rows)]
        below = {'ax': places, 'location': 'bottom', 'aspect': 30, 'pad': 0.02}
        if name == 'origin':
            from matplotlib.cm import ScalarMappable
            from matplotlib.colors import ListedColormap, Normalize

            words = ORIGIN_WORDS[config.algorithm]
            colours = ListedColormap([ORIGIN_COLOURS[code] for code in words])
            bar = self.figure.colorbar(
                ScalarMappable(Normalize(-0.5, len(words) - 0.5), colours), **below)
            bar.set_ticks(range(len(words)), labels=words.values())
            bar.ax.tick_params(labelsize='small', length=0)
            return
        unit = {'best': 'px', 'mutated': '% of the children',
                'error': 'error in px; grey does not count'}.get(name, '')
        exceeded = name in ('error', 'possibility') or (
            name, config.algorithm) == ('mutated', 'paper')
        bar = self.figure.colorbar(drawn, extend='max' if exceeded else 'neither', **below)
        bar.set_label(unit, size='small')
        bar.ax.tick_params(labelsize='small')


def brightest(maps):
    """Return the possibility that has the brightest colour: nearly the largest of maps."""
    return max(*(float(np.ceil(20 * np.percentile(one, BRIGHTEST)) / 20) for one in maps), 0.05)


def panels_of(snapshot, convergence):
    """
    Return the panels of a Snapshot of a Convergence, {name: (values, title)}.

    values: float (R, C), NaN = nothing to show.
    """
    config, nothing = convergence.config, np.full(snapshot.best.shape, np.nan)
    generation = f'generation {snapshot.number}' if snapshot.number else 'initial population'
    panels = {'best': (snapshot.best, f'{generation}: best chromosome')}
    if convergence.truth is not None:
        counted = True if convergence.mask is None else convergence.mask
        panels['error'] = (
            np.where(counted, error_map(snapshot.best, convergence.truth), np.nan),
            f'{convergence.rows[snapshot.number].bad_1:.2f} % off by more than 1 px')
    panels['possibility'] = (snapshot.possibility,
                             f'its possibility, mean {snapshot.possibility.mean():.4f}')
    if config.generations > 0:
        title = 'parents of the fittest child, ' + (
            'the new best' if snapshot.is_best else 'not the best')
        if snapshot.origin is None:
            title = 'no parents yet'
        elif config.algorithm != 'paper':
            new = np.mean(snapshot.origin == MUTATED)
            title = f'its genes, {100 * new:.2f} % new'
        panels['origin'] = nothing if snapshot.origin is None else snapshot.origin, title
    if mutates(config, config.generations):
        panels['mutated'] = (100 * snapshot.mutated, 'changed by mutation') \
            if mutates(config, snapshot.number) else (nothing, 'no mutation yet')
    return panels


def _colours(name, config):
    """Return the colour keywords of `show_map` for the panels of a name."""
    if name == 'best':
        lowest = config.min_disparity
        return {'cmap': 'turbo', 'vmin': lowest,
                'vmax': lowest + max(config.disparities - 1, 1)}
    if name == 'error':
        return {'cmap': 'magma', 'vmin': 0, 'vmax': ERROR_LIMIT}
    if name == 'possibility':
        return {'cmap': 'viridis'}
    if name == 'mutated':
        # Patches of the paper fall anywhere: few cells change in half of the children that mutate.
        top = max(50 * config.mutation_rate, 1) if config.algorithm == 'paper' else 100
        return {'cmap': 'magma', 'vmin': 0, 'vmax': top}
    from matplotlib.colors import ListedColormap

    colours = [ORIGIN_COLOURS[code] for code in sorted(ORIGIN_COLOURS)]
    return {'cmap': ListedColormap(colours), 'vmin': -0.5, 'vmax': len(colours) - 0.5,
            'interpolation': 'nearest'}


def frames_figure(frames, config):
    """
    Return the Figure of a sequence: disparity, evolved cells, and curves.

    Beside them are, in realtime and fast, the parents of genes, else the possibility of the best.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    shown = shown_frames(frames)
    rows, columns = frames[0].disparity.shape
    beside_it, above = FRAME_BESIDE
    height = min((WIDTH - beside_it) * rows / columns, HEIGHTS[1]) + above
    figure = Figure(figsize=(3 * WIDTH, height * (len(shown) + 1)), layout='compressed')
    panels = figure.subplots(len(shown) + 1, 3)
    low, top = config.min_disparity, brightest(frame.beside for frame in shown)
    for row, frame in zip(panels, shown):
        show_map(row[0], frame.disparity, '', 'px', vmin=low, cmap='turbo',
                 vmax=low + max(config.disparities - 1, 1))
        show_map(row[1], np.float32(frame.evolved), '', bar=False, vmin=0, vmax=1)
        if frame.origin is None:
            show_map(row[2], frame.beside, '', vmin=0, vmax=top)
        else:
            show_map(row[2], frame.origin, '', bar=False, cmap=ListedColormap(PARENT_COLOURS),
                     vmin=0, vmax=len(ORIGINS) - 1, interpolation='nearest')
        for place, words in zip(row, (
                f'frame {frame.number}: disparity', 'new genes of the best',
                'possibility of the best' if frame.origin is None else 'parents of genes')):
            place.set_title(words, size='small')
    curves = _curves_of(frames)
    for place, (title, lines) in zip(panels[-1], curves):
        for name, values in lines.items():
            place.plot([frame.number for frame in frames], values, label=name,
                       color=dict(zip(ORIGINS, PARENT_COLOURS)).get(name),
                       marker='o' if len(frames) < FEW else None, markersize=4)
        place.set_title(title, size='small')
        place.set_xlabel('frame', size='small')
        place.tick_params(labelsize='small')
        place.grid(alpha=0.3)
        if len(lines) > 1:
            place.legend(fontsize='small')
    for place in panels[-1, len(curves):]:
        place.set_axis_off()
    return figure


def _curves_of(frames):
    """Return (title, {name: values of all frames}) of each curve below a sequence."""
    found = [('fitness of the best', {'best': [frame.fitness for frame in frames]}),
             ('new genes of the best [%]', {
                 'evolved': [100 * frame.figures['evolved'] for frame in frames]})
             if frames[0].origin is None else ('parents of genes [%]', {
                 name: [100 * frame.figures['origins'][name] for frame in frames]
                 for name in ORIGINS})]
    if frames[0].wrong is not None:
        found.append(('off by more than 1 px [%]', {'wrong': [frame.wrong for frame in frames]}))
    return found
