"""depth_node told the camera's attitude and height: over an Imu, and by parameters."""
import math

from depth_harness import camera_info, CUES, DepthNode, GROUND, keypoints, STANDING
import pytest
from sensor_msgs.msg import Imu, PointCloud2

RANGE = slice(12, 16)
SECOND = 7


class Harness(DepthNode):
    """A depth_node of these parameters, which looks at one standing person."""

    def __init__(self, domain, **parameters):
        super().__init__(domain, outputs={'person_depth/people': PointCloud2}, **parameters)
        self.people, = self.outputs.values()

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
