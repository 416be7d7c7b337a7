"""Reading bags: whole, torn, and what only looks like one."""
from concurrent.futures import ThreadPoolExecutor
import errno
import logging
import os
from pathlib import Path
import shutil

from bag_kinds import types_with
from bag_messages import string
from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagReader, BagWriter, jazzy_types

STRING = 'std_msgs/msg/String'
COUNT = 60
# Long enough that the bags below have several chunks or many pages.
PADDING = np.random.default_rng(0).integers(32, 127, 60_000, np.uint8).tobytes().decode()


def text(index):
    return f'{index} {PADDING}'


def serialized(index):
    return jazzy_types().serialize_cdr(string(text(index)), STRING)


def write_mcap(path, compression):
    """Write an MCAP file with checksums, as rosbag2 does and rosbags does not."""
    definition, _ = jazzy_types().generate_msgdef(STRING, ros_version=2)
    with path.open('wb') as file:
        writer = McapWriter(file, chunk_size=300_000, compression=compression)
        writer.start(profile='ros2')
        schema = writer.register_schema(STRING, 'ros2msg', definition.encode())
        channel = writer.register_channel('/text', 'cdr', schema)
        for index in range(COUNT):
            writer.add_message(channel, index, bytes(serialized(index)), index)
        writer.finish()
    return path


def write_sqlite(folder):
    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection('/text', STRING, typestore=jazzy_types())
        for index in range(COUNT):
            writer.write(connection, index, serialized(index))
    return folder / f'{folder.name}.db3'


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return the path of one bag file of each kind, all with the same messages."""
    folder = tmp_path_factory.mktemp('bags')
    return {
        'mcap': write_mcap(folder / 'plain.mcap', CompressionType.NONE),
        'mcap zstd': write_mcap(folder / 'zstd.mcap', CompressionType.ZSTD),
        'mcap lz4': write_mcap(folder / 'lz4.mcap', CompressionType.LZ4),
        'sqlite': write_sqlite(folder / 'sqlite'),
    }


KINDS = ['mcap', 'mcap zstd', 'mcap lz4', 'sqlite']


def numbers_in(reader):
    """Return the numbers of the texts that can be read, checking that they are intact."""
    numbers = []
    for topic, time_ns, message in reader.messages():
        assert (topic, message.data) == ('/text', text(time_ns))
        numbers.append(time_ns)
    assert not reader.undecodable
    return numbers


@pytest.mark.parametrize('kind', KINDS)
def test_a_whole_file_is_read(bags, kind):
    with BagReader(bags[kind]) as reader:
        assert numbers_in(reader) == list(range(COUNT))
        assert numbers_in(reader) == list(range(COUNT)), 'and once more'
        assert reader.damage is None
        assert reader.topics['/text'].msgtype == STRING
        assert reader.topics['/text'].count == COUNT


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize(('left', 'least'), [(0.5, 20), (0.8, 38), (0.99, 48)])
def test_most_of_a_torn_file_is_read_and_the_damage_told(bags, tmp_path, kind, left, least):
    data = bags[kind].read_bytes()
    torn = tmp_path / bags[kind].name
    torn.write_bytes(data[:int(left * len(data))])

    with BagReader(torn) as reader:
        numbers = numbers_in(reader)

        assert numbers == list(range(len(numbers)))
        assert len(numbers) >= least
    assert f'{torn} is cut off or damaged' in reader.damage


def test_a_full_disk_is_told_where_part_of_a_torn_file_is_copied(bags, tmp_path, monkeypatch):
    torn = tmp_path / bags['sqlite'].name
    torn.write_bytes(bags['sqlite'].read_bytes()[:10_000])  # two pages and a half

    def refuse(*_):
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(shutil, 'copyfileobj', refuse)
    with pytest.raises(DepthPersonError, match=r'nothing in bag .* No space left'):
        BagReader(torn)


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('left', [0.5, 1.0])
def test_a_bag_may_be_read_in_another_thread_than_it_was_opened_in(bags, tmp_path, kind, left):
    data = bags[kind].read_bytes()
    (tmp_path / bags[kind].name).write_bytes(data[:int(left * len(data))])

    with BagReader(tmp_path / bags[kind].name) as reader, ThreadPoolExecutor(1) as thread:
        assert len(thread.submit(numbers_in, reader).result()) >= 20


@pytest.mark.parametrize('kind', KINDS)
@given(left=st.floats(0, 1, exclude_max=True))
@settings(max_examples=30,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_wherever_a_file_is_cut_its_beginning_is_read_or_it_is_refused(
        bags, tmp_path, kind, left):
    data = bags[kind].read_bytes()
    torn = tmp_path / bags[kind].name
    torn.write_bytes(data[:int(left * len(data))])

    try:
        reader = BagReader(torn)
    except DepthPersonError:
        assert left < 0.05
        return
    with reader:
        numbers = numbers_in(reader)
        assert numbers == list(range(len(numbers)))
        assert reader.damage


@pytest.mark.parametrize('kind', ['mcap', 'mcap zstd', 'mcap lz4'])
@pytest.mark.parametrize('tail', [
    bytes(500_000), b'\x05' * 500_000, b'\x04' + b'\x07' * 500_000,
    b'\x05\x02\0\0\0\0\0\0\0..', b'\x03\x02\0\0\0\0\0\0\0..',
])
def test_garbage_behind_the_last_whole_record_does_no_harm(bags, tmp_path, kind, tail):
    data = bags[kind].read_bytes()
    first_chunks = data[:data.index(b'\x06', len(data) // 2)]
    torn = tmp_path / 'torn.mcap'
    torn.write_bytes(first_chunks + tail)

    with BagReader(torn) as reader:
        numbers = numbers_in(reader)

    assert numbers == list(range(len(numbers)))
    assert len(numbers) >= 20
    assert reader.damage


@pytest.mark.parametrize('kind', ['mcap', 'mcap zstd', 'mcap lz4'])
def test_damage_within_a_file_is_told(bags, tmp_path, kind):
    data = bytearray(bags[kind].read_bytes())
    data[len(data) // 2:len(data) // 2 + 40] = b'\x55' * 40
    damaged = tmp_path / 'damaged.mcap'
    damaged.write_bytes(data)

    with BagReader(damaged) as reader:
        numbers = numbers_in(reader)

        assert numbers == list(range(len(numbers)))
        assert 10 < len(numbers) < COUNT
        assert f'{damaged} is damaged' in reader.damage


def test_a_torn_folder_is_read_file_by_file(tmp_path, caplog):
    with BagWriter(tmp_path / 'bag') as writer:
        for index in range(COUNT):
            writer.write('/text', index, string(text(index)))
    path = tmp_path / 'bag/bag.mcap'
    path.write_bytes(path.read_bytes()[:1_500_000])

    with BagReader(tmp_path / 'bag') as reader:
        assert 20 < len(numbers_in(reader)) < 25
        assert 'bag.mcap is cut off' in reader.damage

    (tmp_path / 'bag/metadata.yaml').unlink()
    with caplog.at_level(logging.WARNING), BagReader(tmp_path / 'bag') as reader:
        assert 20 < len(numbers_in(reader)) < 25
    assert caplog.text == '', 'one file has no order to warn of'


def test_a_folder_without_metadata_is_read_in_name_order(bags, tmp_path, caplog):
    for name, half in (('b_1.mcap', 2), ('b_0.mcap', 1)):
        with BagWriter(tmp_path / name.removesuffix('.mcap')) as writer:
            for index in range(COUNT // 2 * (half - 1), COUNT // 2 * half):
                writer.write('/text', index, string(text(index)))
        (tmp_path / name.removesuffix('.mcap') / name).rename(tmp_path / name)

    with caplog.at_level(logging.WARNING), BagReader(tmp_path) as reader:
        assert numbers_in(reader) == list(range(COUNT))
        assert reader.topics['/text'].count == COUNT
        assert reader.damage is None
    assert 'no metadata.yaml' in caplog.text


def test_an_empty_last_file_does_not_cost_the_others(bags, tmp_path):
    (tmp_path / 'a_0.mcap').write_bytes(bags['mcap'].read_bytes())
    (tmp_path / 'a_1.mcap').touch()

    with BagReader(tmp_path) as reader:
        assert numbers_in(reader) == list(range(COUNT))
        assert 'a_1.mcap is empty' in reader.damage


@pytest.fixture
def small_bag(tmp_path):
    """Return a folder with messages on two topics, not written in order."""
    with BagWriter(tmp_path / 'small') as writer:
        for time_ns in (3, 1, 2):
            writer.write('/a', time_ns, string(f'a{time_ns}'))
        writer.write('/b', 2, string('b2'))
    return tmp_path / 'small'


def test_messages_come_in_order_and_by_topic(small_bag):
    with BagReader(small_bag) as reader:
        assert [(topic, time_ns) for topic, time_ns, _ in reader.messages()] == \
            [('/a', 1), ('/a', 2), ('/b', 2), ('/a', 3)]
        assert [message.data for _, _, message in reader.messages(['/b'])] == ['b2']
        assert list(reader.messages(['/c'])) == []
        assert list(reader.messages([])) == []
        assert reader.topics_of_type(STRING) == ['/a', '/b']
        assert reader.topics_of_type('sensor_msgs/msg/Image') == []


def test_raw_messages_are_the_serialised_ones(small_bag):
    with BagReader(small_bag) as reader:
        (_, _, raw), *_ = reader.raw_messages(['/b'])

    assert bytes(raw) == bytes(jazzy_types().serialize_cdr(string('b2'), STRING))


def test_messages_that_do_not_decode_are_left_out_and_counted(tmp_path, caplog):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/text', 1, string('good'))
        writer.write_raw('/text', 2, b'\x00\x01\x00\x00\xff\xff\xff\xff')
        writer.write_raw('/text', 3, b'')
        writer.write('/text', 4, string('also good'))

    with caplog.at_level(logging.WARNING), BagReader(tmp_path / 'bag') as reader:
        assert [message.data for _, _, message in reader.messages()] == ['good', 'also good']
        assert reader.undecodable == {'/text': 2}
    assert len(caplog.records) == 1
    assert '/text is no std_msgs/msg/String' in caplog.text


def test_types_that_only_the_bag_defines_are_read(tmp_path):
    types = types_with('birds/msg/Bird', 'std_msgs/Header header\nfloat32 wingspan')
    bird = types.types['birds/msg/Bird'](
        header=types.types['std_msgs/msg/Header'](
            stamp=types.types['builtin_interfaces/msg/Time'](sec=1, nanosec=2), frame_id='nest'),
        wingspan=1.5)
    with BagWriter(tmp_path / 'bag', types=types) as writer:
        writer.write('/bird', 1, bird)

    with BagReader(tmp_path / 'bag') as reader:
        (_, _, found), = reader.messages()

    assert (found.header.frame_id, found.wingspan) == ('nest', 1.5)


@pytest.mark.parametrize(('name', 'content', 'message'), [
    ('a.mcap', b'', r'a\.mcap is empty'),
    ('a.db3', b'', r'a\.db3 is empty'),
    ('a.mcap', b'SQLite format 3\0', r'a\.mcap does not begin like an \.mcap file'),
    ('a.db3', b'\x89MCAP0\r\n', r'a\.db3 does not begin like an \.db3 file'),
    ('a.db3', b'SQLite format 3\0', r'nothing in bag .*a\.db3 can be read'),
    ('a.txt', b'text', 'is no rosbag: not a folder'),
    ('folder/notes.txt', b'text', 'is no rosbag: it holds no metadata'),
    ('folder/metadata.yaml', b'a: [', 'is damaged: Could not load YAML'),
    ('folder/metadata.yaml', b'a: 1', 'is damaged: A metadata key is missing'),
    ('folder/metadata.yaml', b'', 'is damaged'),
])
def test_what_is_no_bag_is_refused(tmp_path, name, content, message):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)

    with pytest.raises(DepthPersonError, match=message):
        BagReader(path.parent if 'folder' in name else path)


def test_a_missing_bag_is_refused(tmp_path):
    with pytest.raises(DepthPersonError, match=r'no bag at .*gone'):
        BagReader(tmp_path / 'gone')


def test_what_is_neither_a_file_nor_a_folder_is_refused(tmp_path):
    os.mkfifo(tmp_path / 'pipe.mcap')  # a reader of which would wait for a writer

    for path in ('/dev/null', tmp_path / 'pipe.mcap'):
        with pytest.raises(DepthPersonError, match='is no rosbag: not a folder, nor a file'):
            BagReader(path)


@pytest.mark.parametrize('method', ['exists', 'iterdir'])
def test_a_folder_that_may_not_be_looked_into_is_refused(tmp_path, monkeypatch, method):
    def refuse(path):
        raise PermissionError(errno.EACCES, 'Permission denied', str(path))

    monkeypatch.setattr(Path, method, refuse)
    with pytest.raises(DepthPersonError, match=f'bag {tmp_path} cannot be read: .*denied'):
        BagReader(tmp_path)


def test_a_folder_whose_files_are_gone_is_refused(small_bag):
    (small_bag / 'small.mcap').unlink()

    with pytest.raises(DepthPersonError, match=r'missing: .*small\.mcap'):
        BagReader(small_bag)
