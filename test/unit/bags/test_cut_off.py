# SPDX-FileCopyrightText: 2026 fuzzy_stereo_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Of a recording that was cut off every complete chunk is read, of each storage."""
from contextlib import closing
from functools import cache
import io
import random
from shutil import copyfile
import sqlite3
import tempfile
from types import SimpleNamespace

from fuzzed import examples
from fuzzy_stereo_ros.bags.cut_off import Mcap
from fuzzy_stereo_ros.bags.reading import BagReader, read_stamped
from hypothesis import given, strategies as st
from made_bags import BagOf, file_of, FORMATS, name_of, TOPICS, write_bag
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Writer as Writer2

PAIRS, LATE = 60, '/late'
CHUNK = 20          # pairs, at the most
PAGE = 4096         # bytes, of a database
ZEROS = bytes(100_000)      # what a file system puts where it knows a size and has no content


def made(rows=120, columns=240, levels=256):
    """Return pairs of noise, of one level: black; some ten of this size fill a chunk of a bag."""
    random = np.random.default_rng(rows)
    return [SimpleNamespace(**{side: random.integers(0, levels, (rows, columns), np.uint8)
                               for side in ('left', 'right')}) for _ in range(PAIRS)]


def write_late(bag, number, log_time):
    """Write to a topic that begins in a later chunk."""
    if number > PAIRS // 2:
        bag.write(LATE, bag.make('std_msgs/msg/Int32', data=number), log_time)


def compressing(monkeypatch, what=CompressionMode.STORAGE):
    """Have chunks compressed in the bags that are written, or of ROS 2 what else is said."""
    for writer, mode in ((Writer1, (Writer1.CompressionFormat.LZ4,)), (
            Writer2, (what, CompressionFormat.ZSTD))):
        def open_compressed(self, of=writer.open, mode=mode):
            self.set_compression(*mode)
            of(self)

        monkeypatch.setattr(writer, 'open', open_compressed)


def unchunked(content):
    """Return an .mcap whose messages stand in no chunk, as `ros2 bag` has them for fast disks."""
    parts, file = [Mcap.MAGIC], io.BytesIO(content)
    for record in Mcap.records(file, len(Mcap.MAGIC), len(content)):
        if record.kind == 'chunk':
            parts.append(Mcap.content(file, record))
        elif content[record.start] == 1:
            parts.append(content[record.start:record.end])
    return b''.join(parts)


def never_closed(content):
    """Return a .bag as it is while it is recorded: its index is nowhere yet."""
    content = bytearray(content)
    for name, size in (b'index_pos=', 8), (b'conn_count=', 4), (b'chunk_count=', 4):
        place = content.index(name) + len(name)
        content[place:place + size] = bytes(size)
    return content


def older(path, version):
    """Make a database one of an older version of rosbag2."""
    with closing(sqlite3.connect(path)) as database:
        database.executescript('ALTER TABLE topics DROP COLUMN type_description_hash;'
                               'DROP TABLE message_definitions; DROP TABLE schema;')
        if version == 1:
            database.execute('ALTER TABLE topics DROP COLUMN offered_qos_profiles')
        elif version == 3:
            database.executescript('CREATE TABLE schema (schema_version INTEGER, ros_distro TEXT);'
                                   "INSERT INTO schema VALUES (3, 'iron')")


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return {what: file of a whole bag} of each format, and of what else is recorded in it."""
    folder, pairs, black = tmp_path_factory.mktemp('bags'), made(), made(levels=1)
    found = {form: file_of(write_bag(folder / name_of(form), form, pairs, more=write_late))
             for form in FORMATS}
    with pytest.MonkeyPatch.context() as patch:
        compressing(patch)
        found.update({f'{form} compressed': file_of(write_bag(
            folder / f'compressed_{name_of(form)}', form, pairs)) for form in ('ros1', 'mcap')})
    for what, suffix, change in (('mcap unchunked', '.mcap', unchunked),
                                 ('ros1 never closed', '.bag.active', never_closed)):
        found[what] = folder / f'changed{suffix}'
        found[what].write_bytes(change(found[what.split()[0]].read_bytes()))
    for version in (1, 2, 3):
        found[f'sqlite3 {version}'] = path = folder / f'version_{version}.db3'
        copyfile(found['sqlite3'], path)
        older(path, version)
        with BagReader([path]) as bag:
            read_stamped(next(bag.messages(TOPICS)))
    # The content of a message takes two pages.
    found['sqlite3 small'] = file_of(write_bag(
        folder / 'small', 'sqlite3', made(60, 90)))
    found |= {f'{form} black': file_of(write_bag(folder / f'black_{name_of(form)}', form, black))
              for form in FORMATS}
    return found


@pytest.fixture(scope='module')
def written(files):
    """Return a function that gives the messages of a whole bag of `files`."""
    return cache(lambda what: messages(files[what]))


@pytest.fixture(autouse=True)
def temporary(tmp_path, monkeypatch):
    """Have a folder of its own for what is temporary."""
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))


def read_all(path):
    """Return the messages and the losses of a bag."""
    with BagReader([path]) as bag:
        return [(one.topic, one.log_time, one.content) for one in bag.messages(
            {*TOPICS, LATE} & {*bag.topics})], bag.losses


def messages(path):
    return read_all(path)[0]


@pytest.mark.parametrize('form, others', [
    ('sqlite3', [*3 * [''], *3 * [' small'], ' black', ' 1', ' 2', ' 3']),
    ('mcap', ['', ' unchunked', ' compressed', ' black']),
    ('ros1', ['', ' never closed', ' compressed', ' black'])])
@examples(20)
@given(data=st.data(), share=st.integers(0).map(lambda seed: random.Random(seed).random()),
       end=st.sampled_from([b'', ZEROS]), rest=st.sampled_from([None, 5, 144]))
def test_every_complete_chunk_before_the_cut_is_read_as_it_was_written(
        files, written, tmp_path, form, others, data, share, end, rest):
    """rest: bytes of the last page."""
    what = form + data.draw(st.sampled_from(others))
    whole = files[what].read_bytes()
    kept = int(share * len(whole))
    kept = kept if rest is None else kept // PAGE * PAGE + rest
    cut, written, share = whole[:kept], written(what), kept / len(whole)
    path = tmp_path / f"cut{''.join(files[what].suffixes)}"
    path.write_bytes(cut + end)
    least = int(share * PAIRS) - (3 if form == 'sqlite3' else CHUNK)
    try:
        read, losses = read_all(path)
    except ValueError as rejection:
        assert str(rejection).startswith((
            f'{path} has no messages', f'{path} cannot be read as a bag: ')) and least <= 0
        path.unlink()
        return
    assert read == written[:len(read)]
    # Pages of a database hold parts of its index, too, and the last torn message is left out.
    assert least <= sum(topic == TOPICS[0] for topic, _, _ in read) <= share * PAIRS + 2
    first, last = written[0][1], read[-1][1]
    assert losses == [
        f'{path} was cut off: its {len(read)} messages up to {(last - first) / 1e9:.3f} s into '
        'the bag are read, any later ones are lost']
    assert path.read_bytes() == cut + end
    path.unlink()
    assert [*tmp_path.iterdir()] == []


def with_its_end_in_the_log(bag, into):
    """Write a .db3 whose last 12 messages are in its write-ahead log only; return its path."""
    into.mkdir()
    path = into / bag.name
    path.write_bytes(bag.read_bytes())
    log = path.with_name(f'{path.name}-wal')
    with closing(sqlite3.connect(path)) as database:
        database.execute('PRAGMA journal_mode = WAL')
        database.execute('PRAGMA wal_autocheckpoint = 0')
        rows = database.execute('SELECT * FROM messages ORDER BY id DESC LIMIT 12').fetchall()
        database.execute('DELETE FROM messages WHERE id >= ?', rows[-1][:1])
        database.commit()
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
        database.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows[::-1])
        database.commit()
        logged = path.read_bytes(), log.read_bytes()    # closing moves the log into the database
    path.write_bytes(logged[0])
    log.write_bytes(logged[1])
    return path


@pytest.mark.parametrize('described', [False, True])
def test_messages_that_a_database_has_in_its_log_are_read(files, written, tmp_path, described):
    written = written('sqlite3')
    path = with_its_end_in_the_log(files['sqlite3'], tmp_path / 'logged')
    if described:
        (path.parent / 'metadata.yaml').write_bytes(
            (files['sqlite3'].parent / 'metadata.yaml').read_bytes())
    before = {one.name: one.read_bytes() for one in path.parent.iterdir()}
    for bag in (path, path.parent):
        assert read_all(bag) == (written, [
            f'{path} was cut off: its {len(written)} messages up to '
            f'{(written[-1][1] - written[0][1]) / 1e9:.3f} s into the bag are read, any later '
            'ones are lost'])
    assert {name: (path.parent / name).read_bytes() for name in before} == before


def test_a_database_whose_log_cannot_be_read_is_rejected_with_what_to_do(files, tmp_path):
    path = with_its_end_in_the_log(files['sqlite3'], tmp_path / 'logged')
    # What cannot be written, as in a folder that may not be written to.
    path.with_name(f'{path.name}-shm').symlink_to(tmp_path / 'nowhere' / 'index')
    with pytest.raises(ValueError, match='copy both into a folder that can be written to'):
        BagReader([path])


@pytest.mark.parametrize('form, suffix', [('sqlite3', '.db3'), ('mcap', '.mcap')])
def test_a_folder_as_a_power_failure_leaves_it_is_read(tmp_path, form, suffix):
    folder = tmp_path / 'recorded'
    folder.mkdir()
    for number in range(3):
        bag = write_bag(tmp_path / f'recorded_{number}', form, made(), first=PAIRS * number)
        content = file_of(bag).read_bytes()
        (folder / f'{bag.name}{suffix}').write_bytes(
            content[:(len(content), len(content) // 2, 0)[number]])
    with BagReader([folder]) as bag:
        read = [one.log_time for one in bag.messages([TOPICS[0]])]
        assert [sentence.split(':')[0] for sentence in sorted(bag.losses)] == [
            f'{folder}/recorded_1{suffix} was cut off',
            f'{folder}/recorded_2{suffix} cannot be read as a bag']
    assert 75 <= len(read) <= 91 and read == sorted(read)


@pytest.mark.parametrize('form', ['sqlite3', 'mcap'])
def test_messages_that_were_compressed_one_by_one_are_read_without_the_description(
        tmp_path, monkeypatch, form):
    compressing(monkeypatch, CompressionMode.MESSAGE)
    bag = write_bag(tmp_path / 'recorded', form, made())
    whole, file = messages(bag), file_of(bag)
    (bag / 'metadata.yaml').unlink()
    assert messages(bag) == whole
    file.write_bytes(file.read_bytes()[:file.stat().st_size // 2])
    read = messages(bag)
    assert CHUNK < len(read) < len(whole) and read == whole[:len(read)]


@pytest.mark.parametrize('zeros', [6, 14, 22, 30, 60])
def test_zeros_in_the_end_of_an_index_of_ros_1_lose_no_message(files, written, tmp_path, zeros):
    bag = tmp_path / 'bag.bag'
    bag.write_bytes(files['ros1'].read_bytes()[:-zeros] + bytes(zeros))
    assert messages(bag) == written('ros1')


ENDLESS = 'WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT {} FROM n'
# What stands for a table: a view whose rows have no end, or what makes rows or bytes of nothing.
COMPUTED = {
    'messages': 'VIEW messages AS ' + ENDLESS.format("i id, 1 topic_id, i timestamp, x'00' data"),
    'topics': 'VIEW topics AS ' + ENDLESS.format(
        "i id, '/a' || i name, 'a/msg/B' type, 'cdr' serialization_format, '' "
        "offered_qos_profiles, '' type_description_hash"),
    'message_definitions': 'VIEW message_definitions AS ' + ENDLESS.format(
        "i id, 'a/msg/B' topic_type, 'ros2msg' encoding, '' encoded_message_definition, '' "
        'type_description_hash'),
    'data': 'TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, '
            'data BLOB AS (zeroblob(1000000000)) VIRTUAL)',
    'rows': 'VIRTUAL TABLE messages USING rtree(id, topic_id, timestamp)'}


@pytest.mark.parametrize('comment, torn, described', [      # a comment that is no UTF-8
    ('', 0, False), ('', 100, True), ('2f2aff2a2f', 0, True), ('2f2aff2a2f', 100, False)])
@pytest.mark.parametrize('what', COMPUTED)
def test_rows_that_a_database_computes_are_not_read_as_they_may_have_no_end(
        tmp_path, what, comment, torn, described):
    with BagOf(tmp_path / 'bag', 'sqlite3') as bag:
        bag.write('/number', bag.make('std_msgs/msg/Int32'), 1)
    file = file_of(tmp_path / 'bag')
    with closing(sqlite3.connect(file)) as database:
        table = what if COMPUTED[what].startswith('VIEW') else 'messages'
        database.executescript(
            f'DROP TABLE {table}; CREATE {COMPUTED[what]}; PRAGMA writable_schema = ON; UPDATE '
            f"sqlite_master SET sql = CAST(CAST(sql AS BLOB) || x'{comment}' AS TEXT)")
    file.write_bytes(file.read_bytes()[:file.stat().st_size - torn])
    with pytest.raises(ValueError, match=f"{file} cannot be read as a bag: '[a-z_]*' is computed"):
        BagReader([file.parent if described else file])


def varint(number):
    """Return a number as three bytes of SQLite."""
    return bytes((number >> 14 & 127 | 128, number >> 7 & 127 | 128, number & 127))


def test_messages_that_claim_more_bytes_together_than_the_file_has_are_not_read(tmp_path):
    """The pages of each follow each other in a circle."""
    parts = [np.random.default_rng(seed).bytes(100_000) for seed in range(3)]
    with BagOf(tmp_path / 'bag', 'sqlite3') as bag:
        for number, data in enumerate(parts):
            bag.write_content('/data', 'std_msgs/msg/String', data, number)
    file = file_of(tmp_path / 'bag')
    content, more, kind = bytearray(file.read_bytes()), 48 * (PAGE - 4), 0
    for data in parts:
        kind = content.index(varint(2 * len(data) + 12), kind)      # behind the size of the row
        size = len(data) + content[kind - 4] + sum(
            {8: 0, 9: 0}.get(one, one) for one in content[kind - 2:kind])
        assert content[kind - 8:kind - 5] == varint(size)
        content[kind - 8:kind - 5] = varint(size + more)
        content[kind:kind + 3] = varint(2 * (len(data) + more) + 12)
        first, last = (content.index(part) // PAGE for part in (data[9000:9100], data[-50:]))
        content[last * PAGE:last * PAGE + 4] = (first + 1).to_bytes(4, 'big')
    file.write_bytes(content + bytes(100))
    with closing(sqlite3.connect(file)) as database:
        claimed, = database.execute('SELECT sum(length(data)) FROM messages').fetchone()
        assert claimed == 3 * (len(parts[0]) + more) > 2 * len(content)
    with BagReader([file]) as bag:
        assert sum(len(message.content) for message in bag.messages(['/data'])) <= len(content)
