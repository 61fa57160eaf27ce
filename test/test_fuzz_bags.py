# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever bytes stand in a bag: what is whole is read, and the rest refused with a sentence."""
from contextlib import suppress
import resource

from fuzzed import damaged, examples
from fuzzy_stereo_ros.pairs.bag_parts import read_part, rescue
from fuzzy_stereo_ros.pairs.bag_reading import BagReader, DamagedBag, decoded
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair
from hypothesis import given, strategies as st
from made_bags import FORMATS, scene, TOPICS, write_bag
import pytest

FILES = {'ros1': 'bag.bag', 'sqlite3': 'bag.db3', 'mcap': 'bag.mcap'}
MEMORY = 1 << 30        # bytes that reading a bag of a few kilobytes never takes


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return {format: bytes} of the same small bag, and the metadata.yaml of its folder."""
    folder, found = tmp_path_factory.mktemp('bags'), {}
    for form in FORMATS:
        path = write_bag(folder / (FILES[form] if form == 'ros1' else form), form,
                         scene(3, 12, 24, 8))
        file = path if path.is_file() else next(path.glob(f'{form}.*'))
        found[form] = file.read_bytes()
        if form == 'mcap':
            found['metadata.yaml'] = (path / 'metadata.yaml').read_bytes()
    return found


@pytest.fixture
def little_memory():
    """Let this process take no more memory than it has, and a gigabyte."""
    with open('/proc/self/statm') as file:
        has = int(file.read().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (has + MEMORY, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def read_all(path):
    """Read a bag as a replay does, and return how many messages of it could be read."""
    read, latest = 0, {}
    reader = PairReader()
    try:
        with BagReader([path]) as bag:
            for message in bag.messages(TOPICS):
                with suppress(BadPair):
                    latest[message.topic] = decoded(message)
                    read += 1
                    if len(latest) == len(TOPICS):
                        reader.read(*map(latest.get, TOPICS))
    except DamagedBag as damage:
        assert f'{path} is damaged: ' in str(damage)
    except ValueError as refusal:
        assert str(path) in str(refusal)
    return read


@pytest.mark.parametrize('form', FORMATS)
def test_a_whole_bag_is_read_to_its_end(bags, tmp_path, form):
    path = tmp_path / FILES[form]
    path.write_bytes(bags[form])
    assert read_all(path) == 12


@pytest.mark.parametrize('form', ['mcap', 'ros1'])
@pytest.mark.parametrize('field', [b' binning_y', b' encoding', b' frame_id', b' x_offset'])
def test_messages_of_a_type_that_the_bag_defines_otherwise_are_refused(
        bags, tmp_path, form, field):
    path = tmp_path / FILES[form]
    path.write_bytes(bags[form].replace(field, field[:-1] + b'Q'))
    assert read_all(path) < 12


@pytest.mark.parametrize('form', FORMATS)
def test_a_bag_of_any_bytes_is_read_as_far_as_it_goes_or_refused(
        bags, tmp_path, form, little_memory):
    path = tmp_path / FILES[form]

    @examples(60)
    @given(st.one_of(damaged(bags[form]), damaged(bags[form]), st.binary(max_size=99)))
    def read(content):
        path.write_bytes(content)
        assert 0 <= read_all(path) <= 12

    read()


@examples(60)
@given(data=st.data())
def test_a_folder_with_any_description_is_read_or_refused(bags, tmp_path, data):
    folder = tmp_path / 'bag'
    folder.mkdir(exist_ok=True)
    (folder / 'mcap.mcap').write_bytes(bags['mcap'])
    (folder / 'metadata.yaml').write_bytes(data.draw(
        st.one_of(damaged(bags['metadata.yaml']), st.binary(max_size=60))))
    read_all(folder)


@pytest.mark.parametrize('form', ['sqlite3', 'mcap'])
def test_a_file_of_any_bytes_is_rescued_or_not_and_never_more_than_it_was(bags, tmp_path, form):
    path = tmp_path / FILES[form]

    @examples(60)
    @given(damaged(bags[form]))
    def rescued(content):
        path.write_bytes(content)
        with suppress(OSError, ValueError):
            if rescue(path):
                part = read_part(path)
                assert part is None or sum(part.counts.values()) <= 12

    rescued()
