# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""YAML of strangers: plain data, or a sentence that says what is wrong."""

MOST_ENTRIES = 10_000      # with each alias counted as all that it stands for


class BadYaml(ValueError):
    """A text that is no YAML, or is YAML that cannot be taken, with one line that says why."""


def read_yaml(text):
    """
    Return the plain data of a YAML text, str or bytes.

    Raises BadYaml where it is none, and where its aliases make it larger than `MOST_ENTRIES`, as
    they can of a few lines.
    """
    import yaml     # only for those who read YAML

    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _check_entries(node)
        return loader.construct_document(node)
    except BadYaml:
        raise
    except Exception as error:  # yaml raises many kinds for foreign bytes  # noqa: B902
        raise BadYaml(' '.join(str(error).split()) or type(error).__name__) from None


def _check_entries(node):
    """Raise BadYaml where a node has too many below it, or has itself there."""
    waiting = [node]
    for _ in range(MOST_ENTRIES):
        if not waiting:
            return
        below = waiting.pop().value
        if isinstance(below, list):     # of nodes, or of pairs of them
            waiting += [each for entry in below
                        for each in (entry if isinstance(entry, tuple) else (entry,))]
    raise BadYaml(f'it has more than {MOST_ENTRIES} entries, or one that contains itself')
