"""depth_node told the camera's attitude and height: over an Imu, and by parameters."""
import math

import pytest
from sensor_msgs.msg import CameraInfo, Imu, PointCloud2
from test_depth_node import camera_info, keypoints

GROUND = 8
CUES, RANGE = 37, slice(12, 16)
SECOND = 7
#: A person 1.75 m tall, 6 m ahead of a camera at f = 900 px that is level, 1.5 m high.
STANDING = {
    0: (640, 352), 1: (640, 375), 2: (618, 375), 5: (662, 375), 8: (625, 450), 11: (655, 450),
    9: (625, 518), 12: (655, 518), 10: (625, 570), 13: (655, 570), 14: (637, 348), 15: (643, 348)}


class Harness:
    """A depth_node of these parameters, and the ends of its topics."""

    def __init__(self, domain, **parameters):
        self.domain = domain
        words = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
        domain.start('depth_node', '--ros-args', *words)
        self.people = domain.listen(PointCloud2, 'person_depth/people')
        self.camera_info = domain.publisher(CameraInfo, 'camera_info')
        self.keypoints = domain.publisher(PointCloud2, 'person_keypoints')
        domain.spin_until(lambda: domain.node.count_publishers('person_depth/people'))

    def cues(self, wanted):
        """Return the cues of one standing person, once they are as wanted or time is up."""
        def measured():
            self.camera_info.publish(camera_info())
            self.keypoints.publish(keypoints(STANDING, second=SECOND))
            self.domain.spin_for(0.1)
            return self.people and self.people[-1].data[CUES] & GROUND == wanted

        self.domain.spin_until(measured)
        return self.people[-1].data[CUES]


def imu(*, second=SECOND, pitch_down=0.0, covariance=0.0):
    message = Imu()
    message.header.stamp.sec, message.header.stamp.nanosec = second, 140_000_000
    message.orientation.y = math.sin(pitch_down / 2)
    message.orientation.w = math.cos(pitch_down / 2)
    message.orientation_covariance[0] = covariance
    return message


def test_a_fixed_attitude_and_height_bring_the_ground_in(domain):
    harness = Harness(domain, attitude='fixed', camera_height=1.5)
    assert harness.cues(GROUND) & GROUND
    distance = memoryview(bytes(harness.people[-1].data[RANGE])).cast('f')[0]
    assert distance == pytest.approx(6.0, rel=0.1)
    answer = domain.set_parameter('/depth_node', 'camera_height', 0.0)
    assert answer.successful, answer.reason
    assert not harness.cues(0) & GROUND


def test_an_imu_near_the_image_brings_the_ground_in_and_a_far_one_is_reported(domain):
    harness = Harness(domain, attitude='imu', camera_height=1.5)
    attitude = domain.publisher(Imu, 'imu')
    attitude.publish(imu(second=SECOND + 1))
    assert not harness.cues(0) & GROUND
    domain.fault(
        'depth_node',
        'no sample on /imu at the time of the image: the nearest is 1.02 s after')
    attitude.publish(imu())
    assert harness.cues(GROUND) & GROUND


def test_an_imu_without_orientation_is_reported(domain):
    Harness(domain, attitude='imu', camera_height=1.5)
    domain.publisher(Imu, 'imu').publish(imu(covariance=-1.0))
    domain.fault('depth_node', 'it holds no orientation')


def test_a_stature_that_is_nobodys_is_refused(domain):
    domain.start('depth_node')
    answer = domain.set_parameter('/depth_node', 'stature', 0.2)
    assert not answer.successful
    assert 'stature of 0.2 m' in answer.reason
    assert domain.set_parameter('/depth_node', 'stature', 1.8).successful
