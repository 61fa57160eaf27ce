# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Settings of Sphinx, for `make docs`.

Its source folder is the project's, so that links between the pages are those of the files.
"""
from pathlib import Path
import sys
from xml.etree import ElementTree

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from house_docstrings import in_markup  # noqa: E402

_manifest = ElementTree.parse(HERE.parent / 'package.xml').getroot()
project = _manifest.findtext('name')
author = _manifest.findtext('maintainer')
release = _manifest.findtext('version')
copyright = f'2026 {author}'      # noqa: A001  Sphinx calls it so

extensions = ['myst_parser', 'sphinx.ext.autodoc']
root_doc = 'docs/index'
include_patterns = ['*.md', 'CHANGELOG.rst', 'docs/*.md', 'docs/recipes/*.md']
exclude_patterns = ['.*', 'build', 'docs/_build', 'fuzzy_stereo_ros', 'install', 'log', 'test']
myst_heading_anchors = 3
default_role = 'py:obj'     # names in the docstrings' backticks become links where they can
autodoc_member_order = 'bysource'
autodoc_default_options = {'members': True, 'show-inheritance': True}
html_theme = 'alabaster'
html_theme_options = {'description': _manifest.findtext('description'), 'page_width': '76em'}


def setup(app):
    """Have docstrings marked up, and the fields of named tuples left out, which say nothing."""
    def mark_up(app, kind, name, documented, options, lines):
        lines[:] = in_markup(lines)

    def leave_out(app, kind, name, documented, skip, options):
        said = getattr(documented, '__doc__', None) or ''
        return True if said.startswith('Alias for field number') else None

    app.connect('autodoc-process-docstring', mark_up)
    app.connect('autodoc-skip-member', leave_out)
