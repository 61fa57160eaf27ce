# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Show progress on a text stream: a bar on a terminal, lines or nothing elsewhere."""
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
