# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whatever bytes stand in a bag: what is whole is read, and the rest rejected with a sentence."""
from contextlib import closing, contextmanager, suppress
import resource
import sqlite3

from fuzzed import damaged, examples, leaves
from fuzzy_stereo_ros.bags.reading import BagReader, DamagedBag, read_stamped
from fuzzy_stereo_ros.pairs.pair_reader import PairReader
from fuzzy_stereo_ros.pairs.stereo_pair import BadPair
from hypothesis import given, strategies as st
from made_bags import file_of, FORMATS, name_of, scene, TOPICS, write_bag
import pytest
import yaml

FILES = {'ros1': 'bag.bag', 'sqlite3': 'bag.db3', 'mcap': 'bag.mcap'}
MEMORY = 1 << 30        # bytes that reading a bag of a few kilobytes never takes
ANY_INTEGER = st.integers(-2 ** 63, 2 ** 63 - 1)
ANY_VALUE = st.one_of(st.none(), st.text(max_size=9), ANY_INTEGER, st.floats())


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return {format: bytes} of the same small bag, and the metadata.yaml of its folder."""
    folder, found = tmp_path_factory.mktemp('bags'), {}
    for form in FORMATS:
        path = write_bag(folder / name_of(form), form, scene(3, 12, 24, 8))
        found[form] = file_of(path).read_bytes()
    found['metadata.yaml'] = (folder / 'mcap' / 'metadata.yaml').read_bytes()
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
                    _, latest[message.topic] = read_stamped(message)
                    read += 1
                # What a bag defines otherwise than ROS lacks fields: a replay rejects such pairs.
                with suppress(BadPair, AttributeError, TypeError):
                    if len(latest) == len(TOPICS):
                        reader.read(*map(latest.get, TOPICS))
    except DamagedBag as damage:
        assert f'{path} is damaged: ' in str(damage)
    except ValueError as rejection:
        assert str(path) in str(rejection)
    return read


@pytest.mark.parametrize('form', FORMATS)
def test_a_bag_of_any_bytes_is_read_as_far_as_it_goes_or_rejected(
        bags, tmp_path, form, little_memory):
    path = tmp_path / FILES[form]

    @examples(60)
    @given(st.one_of(damaged(bags[form]), damaged(bags[form]), st.binary(max_size=99)))
    def read(content):
        path.write_bytes(content)
        assert 0 <= read_all(path) <= 12

    read()


@pytest.fixture
def described(bags, tmp_path):
    """Return a function of a description, bytes or data, that gives a folder with it."""
    folder = tmp_path / 'bag'
    folder.mkdir()
    (folder / 'mcap.mcap').write_bytes(bags['mcap'])

    def describe(description):
        if not isinstance(description, bytes):
            description = yaml.safe_dump(description).encode()
        (folder / 'metadata.yaml').write_bytes(description)
        return folder

    return describe


@examples(60)
@given(data=st.data())
def test_a_folder_described_by_any_bytes_or_values_is_read_or_rejected(bags, described, data):
    read_all(described(data.draw(
        st.one_of(damaged(bags['metadata.yaml']), st.binary(max_size=60)))))
    description = yaml.safe_load(bags['metadata.yaml'])
    *way, last = data.draw(st.sampled_from(leaves(description)))
    place = description
    for key in way:
        place = place[key]
    place[last] = data.draw(st.one_of(ANY_VALUE, st.just([]), st.just({}), st.just(place[last:])
                                      if isinstance(place, list) else st.booleans()))
    read_all(described(description))


@contextmanager
def any_values(path, table):
    """Yield a database in which a table takes any values, as where its bytes were damaged."""
    with closing(sqlite3.connect(path)) as database:
        columns = ', '.join(row[1] for row in database.execute(f'PRAGMA table_info({table})'))
        database.executescript(
            f'PRAGMA synchronous = OFF; CREATE TABLE any_values ({columns});'
            f'INSERT INTO any_values SELECT * FROM {table}; DROP TABLE {table};'
            f'ALTER TABLE any_values RENAME TO {table};')
        yield database
        database.commit()


@examples(60)
@given(data=st.data())
def test_a_database_with_any_values_is_read_or_rejected(bags, tmp_path, data):
    path = tmp_path / FILES['sqlite3']
    path.write_bytes(bags['sqlite3'])
    table = data.draw(st.sampled_from(['topics', 'messages', 'message_definitions', 'schema']))
    with any_values(path, table) as database:
        columns = [row[1] for row in database.execute(f'PRAGMA table_info({table})')]
        rows = database.execute(f'SELECT count(*) FROM {table}').fetchone()[0]
        column, row = data.draw(st.sampled_from(columns)), data.draw(st.integers(1, rows))
        database.execute(f'UPDATE {table} SET {column} = ? WHERE rowid = ?',
                         (data.draw(st.one_of(ANY_VALUE, st.binary(max_size=9))), row))
    read_all(path)
