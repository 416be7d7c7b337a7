"""Topics written into a bag as they come."""
from bag_kinds import types_with
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String

from depth_person.camera.bag import BagReader
from depth_person.cli import main
from depth_person.replay.bags import BagWriter

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_what_is_published_is_recorded_with_its_profiles_until_ctrl_c(domain, tmp_path):
    recorder = domain.start(
        'depth_person', 'record', '-o', tmp_path / 'bag', '--topics', 'camera_info', '/note',
        '/never', ready='recording')
    note = domain.node.create_publisher(String, '/note', LATCHED)
    note.publish(String(data='said before anyone subscribed'))
    infos = domain.publisher(CameraInfo, '/camera_info')
    other = domain.node.create_publisher(String, '/other', 10)
    for number in range(5):
        infos.publish(CameraInfo(width=number))
        other.publish(String(data='not asked for'))
    domain.spin_until(lambda: note.get_subscription_count())
    domain.spin_for(1.0)

    recorder.interrupt()

    assert recorder.exit_code() == 0, recorder.said
    with BagReader(tmp_path / 'bag') as reader:
        found = {name: [message for _, _, message in reader.messages([name])]
                 for name in reader.topics}
        assert reader.topics['/note'].qos[0].durability.name == 'TRANSIENT_LOCAL'
    assert [message.width for message in found['/camera_info']] == [0, 1, 2, 3, 4]
    assert [message.data for message in found['/note']] == ['said before anyone subscribed']
    assert found.keys() == {'/camera_info', '/note'}
    with (tmp_path / 'bag/bag.mcap').open('rb') as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        assert len(list(decoded)) == 6


def test_on_simulated_time_a_player_that_waits_is_recorded_and_nothing_before_its_time(
        domain, tmp_path):
    text = types_with('my_msgs/msg/Wind', 'float64 value').types['std_msgs/msg/String']
    start_ns, end_ns = 1000 * 10**9, 1001 * 10**9
    with BagWriter(tmp_path / 'played') as writer:
        for time_ns in range(start_ns, end_ns + 1, 10**8):
            writer.write('/count', time_ns, text(data=str(time_ns)))
    note = domain.node.create_publisher(String, '/note', LATCHED)
    note.publish(String(data='said before there was a clock'))
    recorder = domain.start(
        'depth_person', 'record', '-o', tmp_path / 'bag', '--topics', '/note', '/count',
        '--ros-args', '-p', 'use_sim_time:=true', ready='recording')
    domain.spin_until(lambda: note.get_subscription_count())

    player = domain.start(
        'depth_person', 'play', tmp_path / 'played', '--clock', '--wait', ready='playing')
    assert player.exit_code() == 0, player.said
    recorder.interrupt()

    assert recorder.exit_code() == 0, recorder.said
    with BagReader(tmp_path / 'bag') as reader:
        found = [(topic, time_ns) for topic, time_ns, _ in reader.messages()]
    assert sorted(topic for topic, _ in found) == 11 * ['/count'] + ['/note']
    assert all(start_ns <= time_ns <= end_ns for _, time_ns in found)


@pytest.mark.parametrize('arguments', [
    ['--topics', '/no such topic'], ['--topics', 'a//b'], ['--topics', '{nothing}'],
    ['--duration', '0'], ['--duration', 'nan'], ['--duration', '-1']])
def test_what_means_nothing_is_refused_before_there_is_a_bag(tmp_path, capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        main(['record', '-o', str(tmp_path / 'bag'), *arguments])

    assert caught.value.code == 2
    assert arguments[0] in capsys.readouterr().err
    assert not (tmp_path / 'bag').exists()


def test_wrong_ros_arguments_leave_no_bag_behind(tmp_path, capsys):
    assert main(['record', '-o', str(tmp_path / 'bag'), '--ros-args', '-r', 'broken']) == 1

    assert 'the ROS arguments cannot be used' in capsys.readouterr().err
    assert not (tmp_path / 'bag').exists()


def test_silence_is_told(tmp_path, capsys):
    assert main(['record', '-o', str(tmp_path / 'bag'), '--topics', '/never',
                 '--duration', '0.5']) == 3

    assert 'no message came; are the nodes running' in capsys.readouterr().err
