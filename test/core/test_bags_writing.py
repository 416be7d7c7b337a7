"""Bags that are written here, and whether others can read them."""
import signal
import subprocess
import sys

from bag_kinds import LATCHED
from bag_messages import header, string
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.rosbag2 import Reader, Writer

from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagReader, BagWriter


@pytest.mark.parametrize('compress', [False, True])
def test_other_tools_read_the_messages_by_their_embedded_definitions(tmp_path, compress):
    with BagWriter(tmp_path / 'bag', compress=compress) as writer:
        for index in range(3):
            writer.write('/header', index, header(5_000_000_007, f'frame {index}'))

    with (tmp_path / 'bag/bag.mcap').open('rb') as file:
        found = [
            (channel.topic, record.log_time, message.frame_id, message.stamp.nanosec)
            for _, channel, record, message in
            make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()]

    assert found == [('/header', index, f'frame {index}', 7) for index in range(3)]


def test_compression_makes_text_smaller(tmp_path):
    for name, compress in (('plain', False), ('small', True)):
        with BagWriter(tmp_path / name, compress=compress) as writer:
            writer.write('/text', 0, string('walk ' * 10_000))

    sizes = [(tmp_path / name / f'{name}.mcap').stat().st_size for name in ('plain', 'small')]
    assert sizes[1] < sizes[0] / 10


def test_metadata_hold_topics_counts_and_qos(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/latched', 'std_msgs/msg/String', qos=[LATCHED])
        writer.write('/latched', 20, string('a'))
        writer.write('/latched', 10, string('b'))

    with Reader(tmp_path / 'bag') as reader:
        connection, = reader.connections
        assert (connection.topic, connection.msgcount) == ('/latched', 2)
        assert connection.ext.offered_qos_profiles == [LATCHED]
        assert (reader.start_time, reader.duration) == (10, 11)
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics['/latched'].qos == (LATCHED,)


def test_an_existing_bag_is_never_overwritten(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/text', 0, string('precious'))

    with pytest.raises(DepthPersonError, match='bag exists already; remove it'):
        BagWriter(tmp_path / 'bag')

    with BagReader(tmp_path / 'bag') as reader:
        assert [message.data for _, _, message in reader.messages()] == ['precious']


def test_a_topic_keeps_its_type(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        writer.write('/text', 0, string('a'))

        with pytest.raises(DepthPersonError, match='/text is of type std_msgs/msg/String, not'):
            writer.write('/text', 1, header(1))
        with pytest.raises(DepthPersonError, match='unknown type no/msg/Such'):
            writer.add_topic('/other', 'no/msg/Such')


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'file').touch()

    with pytest.raises(DepthPersonError, match=r'cannot be written: .*Not a directory'):
        BagWriter(tmp_path / 'file' / 'bag')


def test_closing_twice_does_nothing(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    writer.close()
    writer.close()

    with BagReader(tmp_path / 'bag') as reader:
        assert list(reader.messages()) == []
        assert reader.damage is None


def test_an_error_while_writing_leaves_what_was_written(tmp_path):
    def fail_midway():
        with BagWriter(tmp_path / 'bag') as writer:
            writer.write('/text', 0, string('before'))
            raise RuntimeError('elsewhere')

    with pytest.raises(RuntimeError, match='elsewhere'):
        fail_midway()

    with BagReader(tmp_path / 'bag') as reader:
        assert [message.data for _, _, message in reader.messages()] == ['before']
        assert reader.damage is None


def test_a_message_is_finished_when_ctrl_c_strikes_while_it_is_written(tmp_path, monkeypatch):
    write = Writer.write

    def interrupted_write(self, *arguments):
        signal.raise_signal(signal.SIGINT)
        write(self, *arguments)

    monkeypatch.setattr(Writer, 'write', interrupted_write)

    with pytest.raises(KeyboardInterrupt), BagWriter(tmp_path / 'bag') as writer:
        writer.write('/text', 0, string('whole'))

    with BagReader(tmp_path / 'bag') as reader:
        assert [message.data for _, _, message in reader.messages()] == ['whole']


WRITE_UNTIL_STOPPED = """
import itertools, sys
from depth_person.replay.bags import BagWriter, jazzy_types
String = jazzy_types().types['std_msgs/msg/String']
with BagWriter(sys.argv[1]) as writer:
    for index in itertools.count():
        writer.write('/text', index, String(data=f'{index} ' + 1000 * 'walk '))
        if index == 2000:
            print('going', flush=True)
"""


@pytest.mark.parametrize('stop', [signal.SIGINT, signal.SIGKILL])
def test_a_writer_that_is_stopped_leaves_a_readable_bag(tmp_path, stop):
    child = subprocess.Popen([sys.executable, '-c', WRITE_UNTIL_STOPPED, str(tmp_path / 'bag')],
                             stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert child.stdout.readline() == b'going\n'
        child.send_signal(stop)
        child.communicate(timeout=60)
    finally:
        child.kill()  # or it would fill the disk

    with BagReader(tmp_path / 'bag') as reader:
        numbers = [int(message.data.split()[0]) for _, _, message in reader.messages()]
        assert numbers == list(range(len(numbers)))
        assert len(numbers) > 1500
        assert reader.undecodable == {}
        assert (reader.damage is None) == (stop == signal.SIGINT)
