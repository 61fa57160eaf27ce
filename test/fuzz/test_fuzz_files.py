# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever bytes stand in a file: it is read, or rejected as a ValueError that names it."""
from contextlib import contextmanager
import io
import json
from pathlib import Path
import shutil
from tempfile import TemporaryDirectory
import tracemalloc

import cv2
from fuzzed import damaged, examples, leaves
from fuzzy_stereo_ros.commands.command_line import main
from fuzzy_stereo_ros.pairs.camera_files import (
    centred_calibration, read_yaml, rectified_cameras, write_camera, write_middlebury_calibration)
from fuzzy_stereo_ros.pairs.camera_formats import read_cameras
from fuzzy_stereo_ros.pairs.disparity_files import (
    encode_numpy, encode_pfm, read_depth, read_disparity)
from fuzzy_stereo_ros.pairs.image_files import read_image, write_image
from fuzzy_stereo_ros.saved_pair import read_saved_pair, write_saved_pair
from hypothesis import given, strategies as st
from made_messages import noise
import numpy as np
import pytest
from saved_scene import running

PLAIN = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=9),
              st.just(10**400)),
    lambda inner: st.one_of(st.lists(inner, max_size=4),
                            st.dictionaries(st.text(max_size=9), inner, max_size=4)),
    max_leaves=12)
MAP = np.linspace(1, 60, 12, dtype=np.float32).reshape(3, 4)
SUFFIXES = '.png', '.jpg', '.bmp', '.pgm', '.tiff', '.webp'


def archive(**arrays):
    stored = io.BytesIO()
    np.savez_compressed(stored, **arrays)
    return stored.getvalue()


def header_of(kind, shape):
    """Return a .npy that has the header of a large array, and eight bytes of it."""
    stored = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stored, {'descr': kind, 'fortran_order': False, 'shape': shape})
    return stored.getvalue() + bytes(8)


def rejected(read, path):
    """Return what a file gives; None where it is rejected by name, in one line of its own."""
    try:
        return read(path)
    except ValueError as error:
        assert str(path) in str(error)
        return None


def written(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return path


def calibrations():
    """Return {suffix: bytes} of calibrations as we write them."""
    known = centred_calibration(400.0, 0.12, 0.5, 48, 64)
    with TemporaryDirectory() as name:
        write_camera(Path(name, 'a.yaml'), rectified_cameras(known, 48, 64)['right'], 'right')
        write_middlebury_calibration(Path(name, 'a.txt'), known, (48, 64), 0, 64)
        return {path.suffix: path.read_bytes() for path in Path(name).iterdir()}


IMAGES = {suffix: cv2.imencode(suffix, noise(6, 9))[1].tobytes() for suffix in SUFFIXES}
MAPS = {'.pfm': encode_pfm(MAP), '.npy': encode_numpy(MAP), '.npz': archive(one=MAP),
        '.png': cv2.imencode('.png', MAP.astype(np.uint16))[1].tobytes()}
CALIBRATIONS = calibrations()
# read, {suffix: content of a sound file}, and what holds of all that is read
READERS = [(read_image, IMAGES, lambda image: image.dtype in (np.uint8, np.uint16)),
           *((read, MAPS, lambda values: values.dtype == np.float32 and values.ndim == 2)
             for read in (read_disparity, read_depth)),
           (lambda path: read_cameras([path]), CALIBRATIONS, bool)]


@pytest.mark.parametrize('read, sound, holds', READERS, ids=[
    'image', 'disparity', 'depth', 'calibration'])
@examples(150)
@given(data=st.data())
def test_a_file_of_any_bytes_is_read_or_rejected(tmp_path, read, sound, holds, data):
    suffix = data.draw(st.sampled_from(sorted(sound)))
    content = data.draw(st.one_of(damaged(sound[suffix]), st.binary(max_size=60),
                                  PLAIN.map(lambda plain: json.dumps(plain).encode())))
    found = rejected(read, written(tmp_path, f'file{suffix}', content))
    assert found is None or holds(found)


@pytest.mark.parametrize('name, content', [
    ('map.npy', header_of('<f4', (2**31, 2**31))), ('map.npy', header_of('<f4', (2**17, 2**17))),
    ('map.pfm', b'Pf\n2147483648 2147483648\n-1.0\n'),
    ('map.pfm', b'Pf\n3 ' + b'9' * 5000 + b'\n-1\n')],
    ids=['npy larger than any memory', 'npy', 'pfm', 'pfm of 5000 digits'])
@pytest.mark.parametrize('read', [read_disparity, read_depth])
def test_a_size_that_is_only_said_is_rejected(tmp_path, name, content, read):
    assert rejected(read, written(tmp_path, name, content)) is None


@contextmanager
def rejected_unread(words):
    """See that what is within raises a ValueError with words, and takes little memory."""
    tracemalloc.start()
    with pytest.raises(ValueError, match=words):
        yield
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 2**24


@pytest.mark.parametrize('arrays, words', [
    ({'one': 2**28}, 'is compressed and takes'), ({'one': 9, 'two': 2**26}, 'it holds 2 arrays')])
def test_an_array_that_unpacks_to_much_more_than_its_file_is_rejected_unread(
        tmp_path, arrays, words):
    content = archive(**{name: np.zeros((1, size), np.uint8) for name, size in arrays.items()})
    assert len(content) < 2**19
    path = written(tmp_path, 'map.npz', content)
    for read in (read_disparity, read_depth):
        with rejected_unread(f'{path} is not .*{words}'):
            read(path)


@examples(150)
@given(data=st.data())
def test_a_calibration_with_any_value_under_any_name_is_read_or_rejected(tmp_path, data):
    content = read_yaml(CALIBRATIONS['.yaml'])
    name = data.draw(st.sampled_from(sorted(content)))
    if isinstance(content[name], dict) and data.draw(st.booleans()):
        content[name] = {'data': data.draw(PLAIN)}
    else:
        content[name] = data.draw(PLAIN)
    text = json.dumps(content).replace('Infinity', '.inf').replace('NaN', '.nan')
    path = written(tmp_path, 'right.yaml', text.encode())
    rejected(lambda one: read_cameras([one]), path)


# ---- YAML ----

LAUGHS = 'a0: &a0 [x, x]\n' + ''.join(
    f'a{each + 1}: &a{each + 1} [*a{each}, *a{each}]\n' for each in range(40))
MERGED = 'a0: &a0 {x: 1}\n' + ''.join(
    f'a{each + 1}: &a{each + 1} {{<<: [*a{each}, *a{each}]}}\n' for each in range(40))


@pytest.mark.parametrize('text, words', [
    (LAUGHS, 'more than'), (MERGED, 'more than'),
    ('[' * 1000, 'recursion'), ('!!timestamp x', 'NoneType'), ('2001-99-99', 'month'),
    ('!!python/object/apply:os.getcwd []', 'could not determine a constructor'), ('a: b: c', ''),
    (b'\xff\xfe\x00', ''), ('!!int ""', '')],
    ids=['laughs', 'merged', 'deep', 'timestamp', 'month', 'object', 'syntax', 'utf-16',
         'integer'])
def test_yaml_that_is_none_or_too_much_is_rejected_in_one_line(text, words):
    with pytest.raises(ValueError) as rejection:
        read_yaml(text)
    assert words in str(rejection.value)
    assert str(rejection.value) and '\n' not in str(rejection.value)


@examples(200)
@given(st.one_of(st.text(max_size=60), st.binary(max_size=60), st.text(
    '{}[]&*a!:,-?|>\n "\'<%#', max_size=25)))
def test_any_text_is_yaml_or_is_rejected(text):
    try:
        read_yaml(text)
    except ValueError as error:
        assert str(error) and '\n' not in str(error)


# ---- saved pairs, and what a replay has written ----


@pytest.fixture(scope='module')
def saved(tmp_path_factory):
    """Return the files of a saved pair: {name: bytes}."""
    folder = tmp_path_factory.mktemp('saved') / 'report'
    write_saved_pair(folder, running()[2])
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def place(saved, tmp_path):
    """Return a function that puts a file into a folder of the others, and returns the folder."""
    def put(changed, content):
        for name in saved:
            (tmp_path / name).write_bytes(content if name == changed else saved[name])
        return tmp_path

    return put


@examples(120)
@given(data=st.data())
def test_a_saved_pair_with_a_file_of_any_bytes_is_read_or_rejected(saved, place, data):
    name = data.draw(st.sampled_from(sorted(saved)))
    content = data.draw(damaged(saved[name]))
    rejected(read_saved_pair, place(name, content))


ANY_NUMBER = st.one_of(st.integers(), st.floats(), st.sampled_from(
    [0, -1, 2**31, 2**63 - 1, -2**63, 2**63, 10**400, 1e308, 5e-324]))


@examples(60)
@given(data=st.data())
def test_a_saved_pair_with_any_number_anywhere_is_matched_or_rejected(saved, place, capsys, data):
    record = json.loads(saved['pair.json'])
    # Of the parameters only those that were saved: others may ask for hours.
    *way, last = data.draw(st.sampled_from([
        one for one in leaves(record) if 'parameters' not in one and 'config' not in one]))
    inner = record
    for key in way:
        inner = inner[key]
    inner[last] = data.draw(st.one_of(ANY_NUMBER, PLAIN))
    folder = place('pair.json', json.dumps(record).encode())
    assert main(['match', '--saved', str(folder)]) in (0, 1, 2)
    assert 'Traceback' not in capsys.readouterr().err


@examples(40)
@given(data=st.data())
def test_a_saved_pair_with_any_number_in_an_array_is_matched_or_rejected(
        saved, place, capsys, data):
    with np.load(io.BytesIO(saved['arrays.npz'])) as stored:
        arrays = dict(stored)
    array = arrays[data.draw(st.sampled_from(sorted(arrays)))]
    if array.size:
        # As many as there are: one alone may stand where no kernel looks.
        bits = data.draw(st.binary(min_size=array.itemsize, max_size=array.itemsize))
        first = data.draw(st.integers(0, array.size - 1))
        array.reshape(-1)[first:] = np.frombuffer(bits, array.dtype)[0]
    content = io.BytesIO()
    np.savez(content, **arrays)
    folder = place('arrays.npz', content.getvalue())
    assert main(['match', '--saved', str(folder)]) in (0, 1, 2)
    assert 'Traceback' not in capsys.readouterr().err


def test_arrays_that_unpack_to_more_than_the_file_are_rejected_unread(saved, place):
    folder = place('arrays.npz', archive(labels=np.zeros(2**27, np.uint8)))
    with rejected_unread('its arrays are larger than the file'):
        read_saved_pair(folder)


@pytest.fixture(scope='module')
def matched(tmp_path_factory):
    """Return a folder of maps that a replay wrote, and the words that continue it."""
    folder = tmp_path_factory.mktemp('frames')
    for side in ('left', 'right'):
        (folder / side).mkdir()
        for number in range(3):
            write_image(folder / side / f'{number}.png', noise(16, 24))
    words = ['replay', *(str(folder / side) for side in ('left', 'right')), '--output',
             str(folder / 'out'), '--disparities', '4', '--format', 'none', '--files', 'npy']
    assert main(words) == 0
    return folder / 'out', [*words, '--resume']


@examples(60)
@given(data=st.data(), name=st.sampled_from(['replay.json', 'progress.json']))
def test_a_replay_with_a_record_of_any_bytes_is_continued_or_rejected(
        matched, tmp_path_factory, capsys, data, name):
    out, words = matched
    whole = shutil.copytree(out, tmp_path_factory.mktemp('whole') / 'out')
    (out / name).write_bytes(data.draw(st.one_of(
        damaged((whole / name).read_bytes()), st.just(b'[' * 100_000),
        PLAIN.map(lambda plain: json.dumps(plain).encode()))))
    capsys.readouterr()
    code, said = main(words), capsys.readouterr().err
    maps = [path.name for path in (out / 'disparity').iterdir()]
    shutil.rmtree(out)
    whole.rename(out)
    assert len(maps) == 3 and 'Traceback' not in said
    assert code == 0 or code == 2 and said.count('\n') == 1 and (
        name in said or '--resume needs the options' in said or 'the last pairs' in said), said
