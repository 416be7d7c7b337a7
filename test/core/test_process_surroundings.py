"""What bags tell of the camera, by the topics that the parameters ask for."""
import math

from bag_messages import header, new
import numpy as np
import pytest

from depth_person.errors import DepthPersonError
from depth_person.replay.bags import BagWriter
from depth_person.replay.input_bags import InputBags
from depth_person.replay.surroundings import Surroundings
from depth_person.settings.depth import DepthSettings

SECOND = 10**9
STAMP = 1000 * SECOND
FORWARD_DOWN = 0.2  # radians by which the nose of the body looks down


def imu(stamp_ns, pitch=FORWARD_DOWN):
    def vector():
        return new('geometry_msgs/msg/Vector3', x=0.0, y=0.0, z=0.0)

    return new(
        'sensor_msgs/msg/Imu', header=header(stamp_ns), orientation=new(
            'geometry_msgs/msg/Quaternion', x=0.0, y=math.sin(pitch / 2), z=0.0,
            w=math.cos(pitch / 2)),
        orientation_covariance=np.zeros(9), angular_velocity=vector(),
        angular_velocity_covariance=np.zeros(9), linear_acceleration=vector(),
        linear_acceleration_covariance=np.zeros(9))


@pytest.fixture
def ask(tmp_path):
    """Return a function that reads a bag of records, and says what is known at STAMP."""
    def ask_bag(settings, *records, **options):
        with BagWriter(tmp_path / 'bag') as writer:
            for topic, time_ns, message in records:
                writer.write(topic, time_ns, message)
        with InputBags([tmp_path / 'bag']) as bags:
            surroundings = Surroundings(bags, settings, **options)
            for message in bags.messages():
                surroundings.take(message)
            return surroundings.at(STAMP, 'eye'), surroundings.report
    return ask_bag


@pytest.mark.parametrize(('topic', 'options'), [
    ('/imu', {}),
    ('/front/imu', {'namespace': '/front/'}),
    ('/mavros/imu/data', {}),
    ('/mavros/imu/data', {'remaps': {'imu': '/mavros/imu/data'}}),
])
def test_the_attitude_comes_from_the_topic_of_the_node_or_the_only_one(ask, topic, options):
    state, report = ask(DepthSettings(attitude='imu'), (topic, STAMP, imu(STAMP)), **options)

    # A camera that looks down by 0.2 sees gravity that much in front of its own down.
    np.testing.assert_allclose(
        state.mounting.gravity, [0.0, math.cos(FORWARD_DOWN), math.sin(FORWARD_DOWN)], atol=1e-9)
    assert report.faults == []


def test_a_sample_behind_the_image_tells_of_it_too(ask):
    state, _ = ask(
        DepthSettings(attitude='imu'), ('/imu', STAMP - SECOND // 100, imu(STAMP - SECOND // 100)),
        ('/imu', STAMP + SECOND // 100, imu(STAMP + SECOND // 100, 0.4)))

    assert math.asin(state.mounting.gravity[2]) == pytest.approx(0.3)


def test_of_several_topics_the_user_says_which(ask):
    records = [('/left/imu', STAMP, imu(STAMP)), ('/right/imu', STAMP, imu(STAMP, 0.0))]

    with pytest.raises(DepthPersonError, match=r'/left/imu, /right/imu; choose by --remap imu:='):
        ask(DepthSettings(attitude='imu'), *records)


@pytest.mark.parametrize(('remap', 'said'), [
    (('imus', '/imu'), 'depth_node has no such input; it has imu, pose, .*, transforms_static'),
    (('imu', '/typo'), 'no /typo of type sensor_msgs/msg/Imu; it has /imu'),
    (('imu', '/text'), 'no /text of type sensor_msgs/msg/Imu; it has /imu'),
])
def test_a_remapped_input_that_is_none_is_refused(ask, remap, said):
    records = [('/imu', STAMP, imu(STAMP)), ('/text', STAMP, header(STAMP))]

    with pytest.raises(DepthPersonError, match=said):
        ask(DepthSettings(attitude='imu'), *records, remaps=dict([remap]))


def test_a_remapped_input_that_no_parameter_asks_for_is_told(ask, caplog):
    ask(DepthSettings(attitude='imu'), ('/imu', STAMP, imu(STAMP)),
        remaps={'imu': 'imu', 'tf_static': '/tf2'})

    assert [record.getMessage() for record in caplog.records] == [
        '--remap tf_static changes nothing: none of the parameters attitude, mounting, height '
        'and camera_pose is tf']


def test_what_is_asked_for_and_missing_is_counted(ask):
    state, report = ask(DepthSettings(attitude='imu'), ('/text', STAMP, header(STAMP)))

    assert state.mounting.gravity is None
    fault, = report.faults
    assert fault.startswith('1 times: the attitude is not known: no sample on /imu')


def test_a_height_above_home_is_taken_with_a_remark(ask):
    state, report = ask(
        DepthSettings(attitude='fixed', height='rel_alt'),
        ('/rel_alt', STAMP - 1000, new('std_msgs/msg/Float64', data=12.0)))

    assert state.mounting.height == pytest.approx(12.0)
    assert report.faults == []
    assert len(report.remarks) == 1
    assert 'above home' in report.remarks[0]


def test_nothing_is_listened_to_unasked(ask):
    state, report = ask(DepthSettings(), ('/imu', STAMP, imu(STAMP)))

    assert state.mounting.gravity is None
    assert report.faults == []
