# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`fuzzy-stereo suggest`: look at a few pairs of a recording and print parameters with reasons."""
from contextlib import ExitStack
from dataclasses import replace
from itertools import pairwise
import json

from fuzzy_stereo_ros.matching import MatcherConfig, StereoMatcher
from fuzzy_stereo_ros.matching.plausibility import PlausibilityCheck
from fuzzy_stereo_ros.matching.row_offsets import row_offset_in_words
from fuzzy_stereo_ros.matching.search_range import PAIRS, search_range, seen_disparities
from fuzzy_stereo_ros.pair_matcher import camera_of
from fuzzy_stereo_ros.pairs.calibration import reach
from fuzzy_stereo_ros.pairs.image_files import in_eight_bits
from fuzzy_stereo_ros.pairs.pair_reader import SCALES
from fuzzy_stereo_ros.pairs.stereo_pair import number_of, width_by_height
from fuzzy_stereo_ros.parameters.options import (
    add_camera_options, add_node_options, node_rows, option_values)
from fuzzy_stereo_ros.replay.options import READING, ReplayOptions, SYNCHRONISING
from fuzzy_stereo_ros.replay.source import first_pairs, opened_recording, SECOND
import numpy as np

DARK, BRIGHT = 8, 247       # of 255; beyond them a pixel says little
MUCH = 10.0                 # percent of pixels
NOISY = 2.0                 # grey levels

ON_INTERRUPT = 'nothing is written'
HELP = 'look at a few pairs and print parameters with reasons'
DESCRIPTION = (
    'Look at the first pairs of a recording, as replay reads it, and print a parameter file for\n'
    'the node: the range of disparities, what the rows and the exposure are like, and the scale\n'
    'at which this computer keeps up with the rate.')
EXAMPLE = ('examples:\n'
           '  fuzzy-stereo suggest recorded > parameters.yaml\n'
           '  fuzzy-stereo suggest left_folder right_folder --rate 30')


def add_arguments(parser):
    parser.add_argument('bags', metavar='BAG', nargs='+',
                        help='bags, or folders, patterns or videos, as for replay')
    parser.add_argument('--rate', metavar='NUMBER', type=float,
                        help='frames per second of folders and videos, as for replay')
    for side in ('left', 'right'):
        parser.add_argument(f'--{side}', metavar='TOPIC', help=f'images of the {side} camera')
    add_camera_options(parser)
    add_node_options(parser, 'how messages become pairs', (*SYNCHRONISING, *READING))


def run(arguments, stream):
    """Print the parameters; raises ValueError and OSError for recordings that cannot be read."""
    rows = node_rows((*SYNCHRONISING, *READING))
    options = ReplayOptions.of(arguments, config=MatcherConfig(), output='',    # writes nothing
                               settings=option_values(arguments, rows))
    with ExitStack() as opened:
        recording, options = opened_recording(options, opened)
        pairs, names = first_pairs(options, recording, PAIRS), recording.names
    if not pairs:
        raise ValueError(f'{names} has no pair that can be read; fuzzy-stereo replay says why')
    images = [(pair.left, pair.right) for pair in pairs]
    scale = options.settings['scale']
    seen = seen_disparities(images)
    first, count = search_range(images)
    config = MatcherConfig.from_profile('realtime', min_disparity=first, disparities=count)
    matcher, check = StereoMatcher(config), PlausibilityCheck()
    matcher.warm_up(*pairs[0].left.shape[:2])
    times, noise = [], []
    for pair in pairs:
        match = matcher.match(pair.left, pair.right, stamp=pair.stamp, camera=camera_of(pair))
        times.append(match.times['total'])
        noise.append(matcher.algorithm.noise)       # of the first pair: nothing is averaged
        finding = check.add(pair.left, pair.right, match, config, pair.calibration.offset)
    steps = [after.stamp - before.stamp for before, after in pairwise(pairs)]
    rate = SECOND / np.median(steps) if steps and min(steps) > 0 else None
    milliseconds = min(times)
    chosen, kept_up = _scale(scale, milliseconds, rate)
    whole = replace(config, min_disparity=round(first / scale), disparities=round(count / scale))
    whole_calibration = pairs[0].calibration.scaled(1 / scale)
    lines = [
        f'# {names}: {number_of(len(pairs), "pair")} of {width_by_height(pairs[0].left)} pixels',
        '/**:', '  ros__parameters:',
        '    # ' + ('too few pixels tell the range: the default' if seen is None else
                    f'disparities of {seen[0] / scale:.0f} to {seen[1] / scale:.0f} px are seen; '
                    'what comes nearer has a reserve'),
        *_comment(reach(whole.min_disparity, whole.disparities, whole_calibration)),
        f'    min_disparity: {whole.min_disparity}',
        f'    disparity_range: {whole.disparities}',
        *(f'    # remark: {remark}' for remark in pairs[0].calibration.remarks),
        f'    # row offset: {row_offset_in_words(match.misalignment)}',
        '    align_rows: true',
        *_comment(_exposure(images)),
        *_comment(_noise(noise[0])),
        *_comment(finding and f'hint: {finding.sentence}'),
        *_comment(f'{milliseconds:.1f} ms a pair on this computer'
                  + (f', recorded at {rate:.3g} pairs/s: {kept_up}' if rate else '')),
        '    profile: realtime', f'    scale: {chosen}',
        *(f'    {row.name}: {json.dumps(options.settings[row.name])}'
          for row in rows
          if row.name != 'scale' and options.settings[row.name] != row.default),
        *_comment('for single images, where seconds do not matter: profile: quality')]
    stream.write('\n'.join(lines) + '\n')


def _comment(sentence):
    return [f'    # {sentence}'] if sentence else []


def _scale(scale, milliseconds, rate):
    """Return the scale at which a pair takes less than its share of a second, and words on it."""
    for smaller in (one for one in SCALES if one <= scale):
        # pixels and disparities: time falls with the third power of the scale, or a bit slower
        if rate is None or milliseconds * (smaller / scale)**2.5 < 1000 / rate:
            return smaller, ('it keeps up' if smaller == scale else
                             f'it keeps up at scale {smaller}')
    return SCALES[-1], 'it keeps up at no scale; the node drops and counts pairs'


def _noise(level):
    return f'noise of {level:.1f} grey levels or more' + (
        ': more light, a longer exposure or a smaller gain gives fewer errors'
        if level > NOISY else '') if level else None


def _exposure(images):
    levels = np.concatenate([in_eight_bits(image).ravel()[::16] for pair in images
                             for image in pair])
    dark, bright = 100 * np.mean(levels < DARK), 100 * np.mean(levels > BRIGHT)
    advice = [f'{word} exposure' for word, share in (('raise the', dark), ('lower the', bright))
              if share > MUCH]
    return (f'{dark:.1f} % of the pixels are black, {bright:.1f} % white'
            + (': ' + ', or '.join(advice) if advice else ''))
