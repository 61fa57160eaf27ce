# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Show progress on a text stream: a bar on a terminal, lines or nothing elsewhere."""
from functools import cache
from itertools import count
from shutil import get_terminal_size
import sys
import threading

from fuzzy_stereo_ros.matching.compiling import compile_kernels, Progress
from fuzzy_stereo_ros.matching.kernels import compiled
from tqdm import tqdm

COMPILING = 'compiling kernels, once on this machine'
COMPILING_BAR = '{l_bar}{bar}|{postfix}'
LINE_SECONDS = 10   # between two lines on this where there is no terminal


def bar(stream, **options):
    """Return a progress bar, shown on terminals; options: of tqdm."""
    columns, rows = get_terminal_size()     # never 0: for a terminal of no size tqdm shows nothing
    return tqdm(file=stream, disable=not stream.isatty(), ncols=columns, nrows=rows,
                **options)


def follow(items, title, stream):
    """Yield items, and show a bar on a terminal, elsewhere a line for each text or `path`."""
    items = list(items)
    for number, item in enumerate(bar(stream, iterable=items, desc=title), start=1):
        if not stream.isatty():
            name = item if isinstance(item, str) else getattr(item, 'path', '')
            stream.write(f'{title}: {number} of {len(items)} {name}'.rstrip() + '\n')
            stream.flush()
        yield item


def show_compiling():
    """From now on, have all cores compile kernels that are not cached, and show it on stderr."""
    compiled.compilers[:] = [cache(_compile)]


def _compile(config):
    newest, ended = [Progress(0.0, None)], threading.Event()
    showing = threading.Thread(target=_show, args=(newest, ended), daemon=True)
    showing.start()
    try:
        compile_kernels(config, newest.append)
    finally:
        ended.set()
        showing.join()


def _show(newest, ended):
    """Show the last of a list of Progress each second until an event is set."""
    with bar(sys.stderr, total=100, desc=COMPILING, bar_format=COMPILING_BAR) as shown:
        for second in count():
            over = second and ended.wait(1)
            share, left = newest[-1]
            left = f'about {left:.0f} s left' if left else f'{second} s so far'
            shown.n = round(100 * share)
            shown.set_postfix_str(left)
            if shown.disable and (over or second % LINE_SECONDS == 0):
                sys.stderr.write(f'{COMPILING}: {100 * share:.0f} %, {left}\n')
                sys.stderr.flush()
            if over:
                return
