# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Show progress on a text stream: a bar on a terminal, lines or nothing elsewhere."""
from contextlib import ExitStack

from fuzzy_stereo_ros.matching import StereoMatcher, WARM_UP_SIZE
from fuzzy_stereo_ros.matching.compiling import warm_up
from tqdm import tqdm


def bar(stream, always=False, **options):
    """Return a progress bar, shown on terminals, and elsewhere if always; options: of tqdm."""
    return tqdm(file=stream, disable=not (always or stream.isatty()), **options)


def follow(items, title, stream):
    """
    Yield items, and show the progress by a bar on a terminal, by a line for each item elsewhere.

    items: an iterable; lines name an item that is a text, or the `path` of one that has it.
    """
    items = list(items)
    for number, item in enumerate(bar(stream, iterable=items, desc=title), start=1):
        if not stream.isatty():
            name = item if isinstance(item, str) else getattr(item, 'path', '')
            stream.write(f'{title}: {number} of {len(items)} {name}'.rstrip() + '\n')
            stream.flush()
        yield item


def warm_matcher(config, stream, shape=WARM_UP_SIZE, always=False):
    """
    Return a StereoMatcher whose kernels are compiled for images of a shape.

    stream: of text, for a progress bar if it is a terminal, or always.
    """
    matcher, bars = StereoMatcher(config), []
    with ExitStack() as opened:
        def report(progress):
            if not bars:
                bars.append(opened.enter_context(bar(
                    stream, always, total=100, desc='compiling the kernels',
                    bar_format='{l_bar}{bar}| {elapsed}<{remaining}')))
            bars[0].update(100 * progress.share - bars[0].n)

        warm_up(matcher, *shape, report if always or stream.isatty() else None)
    return matcher
