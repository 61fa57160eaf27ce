# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pages of the project: their text, and the commands and sentences that stand in them."""
import re
import shlex

from repository import ROOT

# Pages with examples that are run one by one, not as a story from their beginning to their end.
GUIDES = 'README.md', *(f'docs/{name}.md' for name in (
    'bags', 'develop', 'evaluate', 'files', 'node'))
FENCE = re.compile(r'^```(\w*)\n(.*?)^```$', re.DOTALL | re.MULTILINE)


def text_of(name):
    """Return the text of a page, by its path below the project."""
    return (ROOT / name).read_text(encoding='utf-8')


def pages_with_commands():
    """Return the paths of the pages that people read and type from."""
    return sorted(path.relative_to(ROOT).as_posix()
                  for path in [*ROOT.glob('*.md'), *ROOT.glob('docs/*.md')])


def commands(name, start=''):
    """Return the commands of a page that begin with a word: no comments, split in words."""
    blocks = [block for language, block in FENCE.findall(text_of(name)) if language == 'bash']
    lines = '\n'.join(blocks).replace('\\\n', ' ').splitlines()
    return [words for words in (shlex.split(line, comments=True) for line in lines)
            if words and words[0].startswith(start.split(' ')[0])
            and ' '.join(words).startswith(start)]


def said(name):
    """Return the sentences that a page quotes, lines that begin with >, … for what differs."""
    quotes = re.findall(r'(?:^>.*\n)+', text_of(name), re.MULTILINE)
    return [' '.join(line[1:].strip() for line in quote.splitlines()) for quote in quotes]


def in_code_style(name):
    """Return what a page sets in code style inside its sentences."""
    return re.findall(r'`([^`\n]+)`', FENCE.sub('', text_of(name)))


# ---- the migration page ----

MIGRATION = text_of('docs/from_stereo_image_proc.md')
CAMERAS = [word for side in ('left', 'right') for topic in ('image_rect', 'camera_info')
           for word in ('-r', f'{side}/{topic}:=/camera/{side}/{topic}')]


def block(language, page=MIGRATION):
    """Return the first block of a language of a page, which tests start; page: its text."""
    return next(code for kind, code in FENCE.findall(page) if kind == language)
