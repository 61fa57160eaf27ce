# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""JSON and NumPy files that hold what is expected, or a sentence that says what is wrong."""
import io
import json

from fuzzy_stereo_ros.pairs.image_files import read_bytes
from fuzzy_stereo_ros.saved_pairs.versions import package_version
import numpy as np


def read_arrays(path):
    """
    Return the array of a .npy, or {name: array} of a .npz.

    Raises ValueError where the file is missing, damaged, or holds anything but plain arrays.
    """
    content = read_bytes(path)
    try:
        stored = np.load(io.BytesIO(content), allow_pickle=False)
        return stored if isinstance(stored, np.ndarray) else {
            name: stored[name] for name in stored.files}
    except Exception as error:  # numpy raises many kinds for foreign bytes  # noqa: B902
        raise ValueError(f'{path} is damaged: {error}') from error


def read_json(path):
    """Return what a JSON file holds; ValueError where it is missing or damaged."""
    content = read_bytes(path)
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ValueError(f'{path} is damaged: {error}') from error


def read_record(path, kinds):
    """Return the dict of a JSON file, checked as by `check_record`."""
    return check_record(path, read_json(path), kinds)


def check_record(path, record, kinds):
    """
    Return a record of a file if it has the names and types that are expected.

    record: what JSON gave. kinds: {name: type}; a whole number will do for a float.
    Raises ValueError for another name, a missing one, and a value of another type.
    """
    if not isinstance(record, dict):
        raise ValueError(f'{path} is damaged: {record!r:.60} is no record')
    check_names(path, record, kinds)
    for name, kind in kinds.items():
        value = record[name]
        if type(value) is not kind and not (kind is float and type(value) is int):
            raise ValueError(f'{path} is damaged: {name} is {value!r:.60}, no {kind.__name__}')
    return record


def check_names(path, found, wanted):
    """Raise ValueError where the names found in a file are not those that are wanted."""
    for names, fault in ((set(found) - set(wanted), 'has'), (set(wanted) - set(found), 'lacks')):
        if names:
            raise ValueError(
                f"{path} {fault} {', '.join(sorted(names))}, as no file of version "
                f'{package_version()} does; take the version that wrote it')


def check_array(name, array, kind, shape):
    """Raise ValueError, by the name of the array, unless it is one of a dtype and shape."""
    if not isinstance(array, np.ndarray) or (array.dtype, array.shape) != (kind, shape):
        found = f'{array.dtype} {array.shape}' if isinstance(array, np.ndarray) else 'no array'
        raise ValueError(f'{name} is {found}; needed is {np.dtype(kind)} {shape}')
