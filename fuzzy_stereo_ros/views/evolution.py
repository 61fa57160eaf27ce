# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The figure of an evolution and its film; both need matplotlib.

The first row has the images and the curves. A row for each of some generations or frames follows:
the best chromosome, its possibility, the origin of its genes, the changed cells (as Figures 4 and
5 of the paper, with more generations). The film has one such row.
"""
from fuzzy_stereo_ros.evaluation.scores import ERROR_LIMIT, error_map
from fuzzy_stereo_ros.views.evolution_record import FIRST, MUTATED, SECOND
from fuzzy_stereo_ros.views.pictures import as_rgb, show_map
from fuzzy_stereo_ros.views.video import VideoFile
import numpy as np

ORIGIN_COLOURS = {FIRST: '#3b6fb6', SECOND: '#f2a93b', MUTATED: '#d62768'}
CURVE_COLOURS = {'best': '#1a7f37', 'mean': '#555555', 'worst': '#b35900', 'wrong': '#b3261e'}
NOTHING, UNCOUNTED = '#ffffff', '#8a8a8a'   # no parents yet; no ground truth
TRUTH_TITLE = 'ground truth; hatched is unknown'
WIDTH = 3.4         # inches of a panel with its margins
HEIGHTS = 1.4, 6.0  # least and most inches of a panel
PANEL_SPACE = 0.5   # inches above and below a panel
BELOW = 1.2         # inches of the title and the colour bars
DOTS = 100, 200     # least and most dots per inch; between them a dot is a pixel of the images
FAR_OFF = 1e6       # px, an error that has the brightest colour
LIMITS = -4, 4      # powers of ten of the fitness beyond which its axis has a factor
BRIGHTEST = 95      # percentile of possibilities
FEW = 12            # generations or frames up to which curves have markers
DURATION = 10       # seconds of a film
RATES = 1, 10       # least and most generations or frames per second
STAY = 2            # seconds for which the last picture stays


def evolution_figure(record, match=None):
    """Return the Figure of a Record; match: the result of its generations, None of frames."""
    layout = _Layout(record, record.shown(), None if match is None else match.disparity)
    layout.draw_curves()
    return layout.figure


class EvolutionFilm(VideoFile):
    """
    A video with a picture for each generation or frame, drawn one by one.

    rate: of these, per second. figure: of the pictures.
    """

    def __init__(self, path, record):
        """Prepare for a Record without Snapshots; raises ValueError as VideoFile does."""
        super().__init__(path, min(max(round(record.count / DURATION), RATES[0]), RATES[1]))
        self._record, self._layout, self.figure, self._last = record, None, None, None

    def add(self, snapshot):
        """Append the picture of the Snapshot that was added to the Record last."""
        self._last = self.picture(snapshot)
        self.write(self._last)

    def picture(self, snapshot):
        """Return the picture of the Snapshot that was added last: uint8 (R, C, 3) BGR."""
        if self._layout is None:
            self._layout = _Layout(self._record, [snapshot], dots=DOTS[0])
            self.figure = self._layout.figure
        self._layout.draw(0, snapshot)
        self._layout.draw_curves()
        canvas = self.figure.canvas
        canvas.draw()
        self.figure.set_layout_engine('none')   # panels keep their places in the next pictures
        return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, 2::-1])

    def close(self):
        """Repeat the last picture for STAY seconds and finish the file; see VideoFile.close."""
        if self._last is not None:
            for _ in range(self.rate * STAY):
                self.write(self._last)
        super().close()


class _Layout:
    """A grid of panels and curves; figure: the Figure."""

    def __init__(self, record, snapshots, result=None, dots=None):
        """
        Draw the images, and a row of panels for each Snapshot.

        result: float (R, C), px, of the match, or None. dots: per inch.
        """
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._record, self._config, self._drawn = record, record.config, {}
        above, image = {'image': None}, snapshots[0].image
        if record.truth is not None:
            above['truth'] = record.truth, TRUTH_TITLE
        if result is not None:
            refined = '' if self._config.algorithm == 'paper' else ', refined'
            invalid = '; hatched is invalid' if np.isnan(result).any() else ''
            above['result'] = result, f'result{refined}{invalid}'
        curves = ['fitness', *['genes'] * bool(record.frames),
                  *['wrong'] * (record.truth is not None)]
        names, self._rows = list(panels_of(snapshots[-1], record)), len(snapshots)
        across = max(len(names), len(above) + len(curves))
        free = across - len(above) - len(curves)
        mosaic = [[*above, *curves[:1] * free, *curves]] + [
            [f'{name} {row}' for name in names] + ['.'] * (across - len(names))
            for row in range(self._rows)]
        rows, columns = image.shape[:2]
        height = min(max(WIDTH * rows / columns, HEIGHTS[0]), HEIGHTS[1])
        self.figure = Figure(
            figsize=(across * WIDTH, (self._rows + 1) * (height + PANEL_SPACE) + BELOW),
            layout='constrained', dpi=dots or min(max(columns / WIDTH, DOTS[0]), DOTS[1]))
        self.figure.get_layout_engine().set(h_pad=0.08, w_pad=0.06)
        FigureCanvasAgg(self.figure)
        self._places = self.figure.subplot_mosaic(mosaic)
        place = self._places['image']
        self._image = show_map(place, as_rgb(image), '')
        place.set_anchor('N')       # aligns the titles of a row
        place.set_title(f'{self._config.reference} image, the reference', size='small')
        for name, (values, title) in list(above.items())[1:]:
            self._show(name, 'best', values, title)     # the bar of the chromosomes explains it
        self._brightest = brightest(snapshot.possibility for snapshot in snapshots)
        for row, snapshot in enumerate(snapshots):
            self.draw(row, snapshot)

    def draw(self, row, snapshot):
        """Draw the panels of a Snapshot into a row; the last row gets the legends."""
        self._brightest = max(self._brightest, brightest([snapshot.possibility]))
        self._image.set_data(as_rgb(snapshot.image))
        for name, (values, title) in panels_of(snapshot, self._record).items():
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
        """Draw the curves of fitness, of genes of frames and, with a truth, of the error."""
        record, config = self._record, self._config
        scale = '1 is perfect' if config.algorithm != 'paper' else (
            'Eq. 3 as printed' if config.reading == 'literal' else f'{config.reading} reading')
        place = self._draw_curves_of('fitness', f'fitness ({scale})', {
            name: (CURVE_COLOURS[name], [getattr(row, f'{name}_fitness') for row in record.rows])
            for name in ('best', 'mean', 'worst')})
        place.ticklabel_format(axis='y', scilimits=LIMITS)
        place.legend(fontsize='small', loc='lower right')
        if record.frames:
            genes = {
                word: (ORIGIN_COLOURS[code], [100 * row.origins[word] for row in record.rows])
                for code, word in record.words.items()} or {'new genes of the best': (
                    ORIGIN_COLOURS[MUTATED], [100 * row.changed for row in record.rows])}
            self._draw_curves_of('genes', 'genes [%]', genes).legend(fontsize='small')
        if record.truth is not None:
            place = self._draw_curves_of('wrong', 'best: off by more than 1 px [%]', {
                'wrong': (CURVE_COLOURS['wrong'], [row.bad_1 for row in record.rows])})
            place.set_ylim(0, max(1.1 * max(row.bad_1 for row in record.rows), 1))
        lowest, number = config.min_disparity, record.rows[-1].number
        # The evolution of `realtime` may converge earlier.
        most = 'at most ' * (config.algorithm == 'realtime' and not record.frames)
        self.figure.suptitle(
            f"{'frame' if record.frames else 'generation'} {number} of {most}{record.count}, "
            f'profile {record.profile}, population {config.population}, disparities {lowest} '
            f'to {lowest + config.disparities - 1} px')

    def _draw_curves_of(self, name, title, lines):
        """Draw lines, {label: (colour, values)}, into the place of a name; return its Axes."""
        place, numbers = self._places[name], [row.number for row in self._record.rows]
        place.clear()
        for label, (colour, values) in lines.items():
            place.plot(numbers, values, marker='o' if len(numbers) < FEW else None, markersize=4,
                       label=label, color=colour)
        place.set_title(title, size='small')
        place.xaxis.get_major_locator().set_params(integer=True, min_n_ticks=1)
        place.tick_params(labelsize='small')
        place.set_xlabel('frame' if self._record.frames else 'generation', size='small')
        place.set_xlim(numbers[0] - 0.5, self._record.count + 0.5)
        place.grid(alpha=0.3)
        return place

    def _show(self, place, name, values, title):
        """Draw a map in the colours of a panel; return its AxesImage."""
        drawn = show_map(self._places[place], values, '', bar=False,
                         **_colours(name, self._record))
        drawn.axes.set_title(title, size='small')
        drawn.axes.set_anchor('N')
        background = {'origin': NOTHING, 'changed': NOTHING, 'error': UNCOUNTED}.get(name)
        if background:
            drawn.axes.patch.set(facecolor=background, hatch=None)
        return drawn

    def _explain(self, name, drawn):
        """Add a bar of colours below the panels of a name, of origins with words."""
        places = [self._places[f'{name} {row}'] for row in range(self._rows)]
        below = {'ax': places, 'location': 'bottom', 'aspect': 30, 'pad': 0.02}
        if name == 'origin':
            from matplotlib.cm import ScalarMappable
            from matplotlib.colors import ListedColormap, Normalize

            words = self._record.words
            colours = ListedColormap([ORIGIN_COLOURS[code] for code in words])
            bar = self.figure.colorbar(
                ScalarMappable(Normalize(-0.5, len(words) - 0.5), colours), **below)
            bar.set_ticks(range(len(words)), labels=words.values())
            bar.ax.tick_params(labelsize='small', length=0)
            return
        of_children = self._config.algorithm == 'paper' and not self._record.frames
        unit = {'best': 'px', 'changed': '% of the children' * of_children,
                'error': 'error in px; grey does not count'}.get(name, '')
        exceeded = name in ('error', 'possibility') or (name == 'changed' and of_children)
        bar = self.figure.colorbar(drawn, extend='max' if exceeded else 'neither', **below)
        bar.set_label(unit, size='small')
        bar.ax.tick_params(labelsize='small')


def brightest(maps):
    """Return the possibility that has the brightest colour: nearly the largest of maps."""
    return max(*(float(np.ceil(20 * np.percentile(one, BRIGHTEST)) / 20) for one in maps), 0.05)


def panels_of(snapshot, record):
    """
    Return the panels of a Snapshot of a Record, {name: (values, title)}.

    values: float (R, C), NaN = nothing to show.
    """
    nothing = np.full(snapshot.best.shape, np.nan)
    of_frames, paper = bool(record.frames), record.config.algorithm == 'paper'
    title = f'frame {snapshot.number}: disparity' if of_frames else (
        f'generation {snapshot.number}' if snapshot.number else 'initial population'
    ) + ': best chromosome'
    panels = {'best': (snapshot.best, title)}
    if record.truth is not None:
        counted = True if record.mask is None else record.mask
        wrong, = (row.bad_1 for row in record.rows if row.number == snapshot.number)
        found = np.nan_to_num(snapshot.best, nan=-FAR_OFF)     # no disparity counts as wrong
        panels['error'] = (np.where(counted, error_map(found, record.truth), np.nan),
                           f'{wrong:.2f} % off by more than 1 px')
    title = 'possibility of the best' if of_frames else 'its possibility'
    panels['possibility'] = (snapshot.possibility,
                             f'{title}, mean {snapshot.possibility.mean():.4f}')
    if record.words:
        title = 'parents of genes' if of_frames else (
            'parents of the fittest child, ' + (
                'the new best' if snapshot.is_best else 'not the best'))
        if snapshot.origin is None:
            title = 'no parents yet'
        elif not (of_frames or paper):
            title = f'its genes, {100 * np.mean(snapshot.origin == MUTATED):.2f} % new'
        panels['origin'] = nothing if snapshot.origin is None else snapshot.origin, title
    if record.changes(record.count):
        panels['changed'] = (
            100 * snapshot.changed, 'new genes of the best' if of_frames else 'changed by mutation'
        ) if record.changes(snapshot.number) else (nothing, 'no mutation yet')
    return panels


def _colours(name, record):
    """Return the colour keywords of `show_map` for the panels of a name."""
    config = record.config
    if name == 'best':
        lowest = config.min_disparity
        return {'cmap': 'turbo', 'vmin': lowest,
                'vmax': lowest + max(config.disparities - 1, 1)}
    if name == 'error':
        return {'cmap': 'magma', 'vmin': 0, 'vmax': ERROR_LIMIT}
    if name == 'possibility':
        return {'cmap': 'viridis'}
    if name == 'changed':
        # Patches of the paper fall anywhere: few cells change in half of the children that mutate.
        few = config.algorithm == 'paper' and not record.frames
        top = max(50 * config.mutation_rate, 1) if few else 100
        return {'cmap': 'magma', 'vmin': 0, 'vmax': top}
    from matplotlib.colors import ListedColormap

    colours = [ORIGIN_COLOURS[code] for code in sorted(ORIGIN_COLOURS)]
    return {'cmap': ListedColormap(colours), 'vmin': -0.5, 'vmax': len(colours) - 0.5,
            'interpolation': 'nearest'}
