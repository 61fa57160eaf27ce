# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Warm start: the same matcher with and without its previous frame, error and flicker, and 3WAY.

Cold means that the matcher forgets the frame before each one.
"""
from fuzzy_stereo_ros.benchmarks import over_frames
from fuzzy_stereo_ros.benchmarks.pictures import draw_warm
from fuzzy_stereo_ros.benchmarks.request import counted, mean_flicker, report_of, scored_error
from fuzzy_stereo_ros.evaluation.baselines import dense, REFERENCE, tuned_3way
from fuzzy_stereo_ros.evaluation.report import Table
import pandas as pd

COLD, WARM = 'cold', 'warm'
MATCHERS = REFERENCE, COLD, WARM
MORE = 'warm - cold'
MOST = 5        # sequences of the table of those where the warm start costs most


def run(request):
    """Return the `Report` of cold against warm on the sequences of a request."""
    scenes, skipped = request.scenes()
    sequences, missing = request.sequences(scenes)
    measured = request.each(sequences, 'warm', lambda sequence: measure(sequence, request))
    walked = request.each(over_frames.walks(request, scenes), 'over frames',
                          lambda one: over_frames.walk(request, one))
    quality = over_frames.quality_errors(dict.fromkeys(one.scene for one in walked))
    settings = {
        'ours': f'{request.subject}, filled; cold: reset before each frame',
        'baseline': '3WAY, tuned for the family, dense',
        'window': 'the classic pairs through a window that pans so many pixels per frame, with '
                  'fresh noise of so many grey levels (standard deviation, alike in the three '
                  'channels); frames 2 to 5 of 0 to 5',
        'error': 'percent off by more than 1 px, of the pixels that both cameras see; KITTI: '
                 '3 px, pixels with truth that are visible (noc), frame 10 after 7, 8 and 9',
        'flicker': 'percent of pixels that change by more than 1 px, the pan taken out',
        'drive': 'cameras that drive through a street, turn, tilt and roll; the calibration is '
                 'given there, and for KITTI and EuRoC',
        'hard cut': 'two frames of one scene, then one of another, which counts',
        'object appears': 'the frame in which it is there for the first time and the next',
    }
    found = [*tables(measured), over_frames.table(walked, quality)]
    return report_of('warm', 'Warm start', settings, found, [*skipped, *missing],
                     {'warm.svg': draw_warm, 'over_frames.svg': over_frames.draw})


def measure(sequence, request):
    """
    Return what was found on a sequence: {column: figure}, its kind and path among them.

    A matcher's name: percent, mean of the scored frames, NaN where none has a truth. 'flicker,'
    and its name: percent of pixels that change by more than 1 px.
    """
    frames, maps = sequence.read(), {name: [] for name in MATCHERS}
    matchers = {name: request.matcher(sequence.disparities, warm_start=True)
                for name in (COLD, WARM)}
    baseline = tuned_3way(sequence.family)
    for known in frames:
        matchers[COLD].reset()
        for name, matcher in matchers.items():
            maps[name].append(matcher.match(known.left, known.right,
                                            camera=sequence.camera).disparity)
        maps[REFERENCE].append(dense(baseline.match(known.left, known.right,
                                                    sequence.disparities)))
    return {'kind': sequence.kind, 'path': sequence.path,
            **{name: scored_error(sequence, frames, found) for name, found in maps.items()},
            **{f'flicker, {name}': mean_flicker(sequence, found) for name, found in maps.items()}}


def tables(measured):
    """Return the tables of what `measure` returned, a list."""
    found = pd.DataFrame(measured)
    found[MORE] = found[WARM] - found[COLD]
    costly = found.dropna(subset=MORE).sort_values([MORE, COLD, WARM, 'path'], ascending=False)
    kinds = counted(found, 'kind', 'path').groupby('kind', sort=False)
    means = kinds.mean(numeric_only=True)
    means['warm / cold'] = means[WARM] / means[COLD].where(means[COLD] > 0)
    means['worst warm - cold'] = kinds[MORE].max()
    return [
        Table.of('Error and flicker, percent', means[[
            *MATCHERS, 'warm / cold', 'worst warm - cold',
            *(f'flicker, {name}' for name in MATCHERS)]],
            '*Worst warm - cold*: on a single sequence of the line, in points.'),
        Table.of('The sequences where the warm start costs most',
                 costly.head(MOST).set_index('path')[[COLD, WARM, MORE]])]
