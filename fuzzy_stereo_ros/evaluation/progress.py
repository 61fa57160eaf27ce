# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Progress on standard error: a bar on a terminal, a line per step where it is piped."""


def follow(items, title, stream):
    """
    Yield the items, and show on a text stream how far they are.

    items: a sequence; texts are shown, and the `path` of an item that has one.
    """
    items = list(items)
    if stream.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            yield from tqdm(items, desc=title, file=stream)
            return
    for number, item in enumerate(items, start=1):
        name = item if isinstance(item, str) else getattr(item, 'path', '')
        stream.write(f'{title}: {number} of {len(items)} {name}'.rstrip() + '\n')
        stream.flush()
        yield item
