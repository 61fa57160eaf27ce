# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An evolution from frame to frame, as it can be shown: figures of each frame, and a picture."""
from dataclasses import dataclass

from fuzzy_stereo_ros.evaluation.scores import score
from fuzzy_stereo_ros.matching import StereoMatcher
from fuzzy_stereo_ros.views.pictures import show_map, write_figure
import numpy as np

SHOWN = 4                   # frames of a sequence in one picture, at the most
WIDTH, HEIGHT = 3.4, 2.7    # inches of a map


@dataclass(frozen=True)
class Frame:
    """
    A frame of a sequence; maps are as the matcher has them: mirrored for the right reference.

    number: from 1; disparity: float32 (R, C), px; evolved: uint8 (R / 2, C / 2), where a gene has
    evolved; work: uint8 (R / 2, C / 2), planes proposed so far; gains: fitness by operator; warm:
    see Match; wrong: percent off by more than 1 px, None without truth
    """

    number: int
    disparity: np.ndarray
    evolved: np.ndarray
    work: np.ndarray
    gains: dict
    warm: bool
    wrong: float | None

    @property
    def figures(self):
        """The frame without its maps, for JSON."""
        return {'frame': self.number, 'warm': self.warm, 'gains': self.gains, 'bad_1': self.wrong,
                'evolved': float(np.mean(self.evolved > 0))}


def watched_frames(config, pairs, truth=None, mask=None):
    """
    Yield a `Frame` for each of some pairs of images, matched one after the other.

    config: MatcherConfig of the profile `realtime`, with warm_start; truth, mask: of all frames
    """
    matcher = StereoMatcher(config)
    for number, (left, right) in enumerate(pairs, 1):
        match = matcher.match(left, right)
        state = matcher.state
        wrong = None if truth is None else score(match.disparity, truth, mask).bad_dense[1.0]
        yield Frame(number, match.disparity, state.evolved, state.work, match.gains, match.warm,
                    wrong)


def shown_of(frames):
    """Return the first of some frames, the last, and others between by equal factors."""
    last = len(frames)
    numbers = sorted({round(last**(place / (SHOWN - 1))) for place in range(SHOWN)})
    return [frames[number - 1] for number in numbers]


def write_frames(path, frames, config):
    """
    Write the picture of a sequence: best, where it evolved, where work was done; and the gains.

    path: .png, .pdf or .svg. Raises ValueError for another suffix; needs matplotlib.
    """
    from matplotlib.figure import Figure

    shown = shown_of(frames)
    figure = Figure(figsize=(3 * WIDTH, HEIGHT * (len(shown) + 1)), layout='constrained')
    panels = figure.subplots(len(shown) + 1, 3)
    low = config.min_disparity
    for row, frame in zip(panels, shown):
        title = f'frame {frame.number}'
        show_map(row[0], frame.disparity, f'{title}: disparity', 'px', vmin=low,
                 vmax=low + config.disparities - 1)
        show_map(row[1], np.float32(frame.evolved), f'{title}: evolved', vmin=0, vmax=1)
        show_map(row[2], np.float32(frame.work), f'{title}: planes proposed', vmin=0)
    numbers = [frame.number for frame in frames]
    names = list(dict.fromkeys(name for frame in frames for name in frame.gains))
    for name in names:
        panels[-1, 0].plot(numbers, np.cumsum([frame.gains.get(name, 0.0) for frame in frames]),
                           label=name)
    panels[-1, 0].set_title('fitness gained since the first frame', fontsize=9)
    if names:
        panels[-1, 0].legend(fontsize=7)
    panels[-1, 1].plot(numbers, [frame.figures['evolved'] for frame in frames])
    panels[-1, 1].set_title('share of the cells that have evolved', fontsize=9)
    if frames[0].wrong is not None:
        panels[-1, 2].plot(numbers, [frame.wrong for frame in frames])
        panels[-1, 2].set_title('off by more than 1 px [%]', fontsize=9)
    else:
        panels[-1, 2].axis('off')
    write_figure(path, figure)
