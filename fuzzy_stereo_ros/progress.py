# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Progress on a text stream: a bar on a terminal, where it is piped a line a step or nothing."""
from tqdm import tqdm


def bar(stream, always=False, **options):
    """Return a bar, which shows nothing on what is no terminal, unless always; options: tqdm's."""
    return tqdm(file=stream, disable=not (always or stream.isatty()), **options)


def follow(items, title, stream):
    """
    Yield the items, and show by a bar, or by a line each, how far they are.

    items: a sequence; texts are shown, and the `path` of an item that has one.
    """
    items = list(items)
    for number, item in enumerate(bar(stream, iterable=items, desc=title), start=1):
        if not stream.isatty():
            name = item if isinstance(item, str) else getattr(item, 'path', '')
            stream.write(f'{title}: {number} of {len(items)} {name}'.rstrip() + '\n')
            stream.flush()
        yield item
