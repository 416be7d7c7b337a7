"""Topics written into a bag as they come."""
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import String

from depth_person.camera.bag import BagReader
from depth_person.cli import main

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
