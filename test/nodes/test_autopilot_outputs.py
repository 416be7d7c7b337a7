"""What depth_node gives autopilots, over DDS: scan, nearest and target, or silence."""
import math
import time

from depth_harness import camera_info, DepthNode, FACE_TO_FACE, keypoints
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
import numpy as np
import pytest
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import Imu, LaserScan, PointCloud2, Range
from std_msgs.msg import Header

SCAN, NEAREST, TARGET = 'person_depth/scan', 'person_depth/nearest', 'person_depth/target'


def moved(rows, u):
    return {row: (place[0] + u, place[1]) for row, place in rows.items()}


class Harness(DepthNode):
    """A depth_node whose camera is calibrated, fed with keypoints."""

    def __init__(self, domain, **parameters):
        outputs = {'person_depth/people': PointCloud2, SCAN: LaserScan, NEAREST: Range,
                   TARGET: PoseWithCovarianceStamped}
        super().__init__(
            domain, outputs=outputs, estimator='shoulder', max_age=0.0, **parameters)
        self.people, self.scans, self.nearest, self.targets = self.outputs.values()

    def send(self, cloud, *, ranged=True, info=None):
        """Send keypoints until they come out as people; return scans of the last ones."""
        info = info or camera_info()

        def measured():
            self.camera_info.publish(info)
            self.domain.spin_for(0.1)
            self.forget()
            self.keypoints.publish(cloud)
            self.domain.spin_for(2.0, unless=lambda: self.people)
            self.domain.spin_for(0.3)  # for what is published beside them
            if not self.people:
                return False
            return not self.people[0].data or (self.people[0].data[36] == 0) == ranged

        self.domain.spin_until(measured)


@pytest.fixture(scope='module')
def harness(shared_domain):
    return Harness(shared_domain)


def test_one_image_gives_one_of_each_with_its_stamp(harness):
    cloud = keypoints(FACE_TO_FACE)
    harness.send(cloud)
    harness.domain.spin_for(1.0)  # nothing is repeated
    assert [len(messages) for messages in (
        harness.scans, harness.nearest, harness.targets)] == [1, 1, 1]
    scan, nearest, target = harness.scans[0], harness.nearest[0], harness.targets[0]
    assert {str(message.header.stamp) for message in (scan, nearest, target)} == {
        str(cloud.header.stamp)}
    assert (scan.header.frame_id, target.header.frame_id) == ('base_link_frd', 'base_link')
    assert nearest.header == cloud.header
    assert len(scan.ranges) == 72
    # 3.5 m away, with two sigmas of 0.27 m or so taken off.
    filled = np.flatnonzero(np.isfinite(scan.ranges)).tolist()
    assert filled[0] == 0
    assert 2.0 < scan.ranges[0] < 3.3
    assert nearest.range == pytest.approx(3.5, abs=0.05)
    position = target.pose.pose.position
    assert (position.x, position.y, position.z) == pytest.approx((3.5, 0, 0), abs=0.05)


def test_it_says_that_the_vehicle_is_taken_for_level(harness):
    harness.domain.status('depth_node', lambda status: 'vehicle taken for level' in [
        pair.value for pair in status.values if pair.key == 'scan frame'])


def test_the_scan_is_reliable(harness):
    info, = harness.domain.node.get_publishers_info_by_topic(f'/{SCAN}')
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_nobody_is_a_scan_of_nothing_and_no_target(harness):
    harness.send(keypoints())
    assert len(harness.scans) == 1
    assert np.isnan(harness.scans[0].ranges).all()
    assert not harness.nearest
    assert not harness.targets


def test_without_a_calibration_there_is_silence(harness):
    harness.send(keypoints(FACE_TO_FACE), ranged=False, info=camera_info(focal_length=0.0))
    harness.domain.spin_for(0.5)
    assert not harness.scans + harness.nearest + harness.targets
    harness.send(keypoints(FACE_TO_FACE))
    assert harness.scans


def test_scans_that_come_too_seldom_are_named(harness):
    domain = harness.domain
    cloud = keypoints(FACE_TO_FACE)
    seldom = domain.node.create_timer(0.2, lambda: harness.keypoints.publish(cloud))
    domain.fault('depth_node', 'scans a second on person_depth/scan')
    domain.node.destroy_timer(seldom)
    domain.status('depth_node', lambda status: 'scans a second' not in status.message)


def test_the_target_is_chosen_while_the_node_runs(harness):
    set_parameter = harness.domain.set_parameter
    cloud = keypoints(moved(FACE_TO_FACE, -300), FACE_TO_FACE)  # track ids 3 and 4

    def left():
        harness.send(cloud)
        return harness.targets[0].pose.pose.position.y if harness.targets else None

    assert set_parameter('depth_node', 'target', '3').successful
    assert left() == pytest.approx(3.5 / 3, abs=0.1)
    assert set_parameter('depth_node', 'target', 'center').successful
    assert left() == pytest.approx(0.0, abs=0.05)
    assert set_parameter('depth_node', 'target', '77').successful
    assert left() is None
    refused = set_parameter('depth_node', 'target', 'tallest')
    assert not refused.successful
    assert 'is not nearest, center' in refused.reason
    assert set_parameter('depth_node', 'target', 'nearest').successful


def test_the_mounting_can_be_changed_while_the_node_runs(harness):
    set_parameter = harness.domain.set_parameter
    assert set_parameter('depth_node', 'camera_yaw', 90.0).successful
    harness.send(keypoints(FACE_TO_FACE))
    assert np.isfinite(harness.scans[0].ranges[18])
    assert harness.targets[0].pose.pose.position.y == pytest.approx(-3.5, abs=0.05)
    assert set_parameter('depth_node', 'camera_yaw', 0.0).successful
    assert set_parameter('depth_node', 'scan_clear', True).successful
    harness.send(keypoints())
    assert harness.scans[0].ranges[0] == np.float32(30.02)
    assert np.isnan(harness.scans[0].ranges[36])
    assert set_parameter('depth_node', 'scan_clear', False).successful
    refused = set_parameter('depth_node', 'scan_range_max', 0.1)
    assert not refused.successful
    assert 'is not within' in refused.reason


def test_a_stale_image_gives_no_scan(harness):
    assert harness.domain.set_parameter('depth_node', 'max_age', 0.4).successful
    cloud = keypoints(FACE_TO_FACE)

    def sent(age_s):
        now_ns = time.time_ns() - round(age_s * 1e9)
        cloud.header.stamp.sec, cloud.header.stamp.nanosec = divmod(now_ns, 10**9)
        harness.keypoints.publish(cloud)
        harness.domain.spin_for(0.3)
        return [scan for scan in harness.scans if scan.header.stamp == cloud.header.stamp]

    harness.domain.spin_until(lambda: sent(0.12))
    assert not sent(0.7)
    assert not sent(3600.0)
    harness.domain.spin_until(lambda: sent(0.12))
    assert math.isfinite(harness.scans[-1].ranges[0])
    assert harness.domain.set_parameter('depth_node', 'max_age', 0.0).successful


def test_what_is_missing_or_wrong_is_named_and_silences_the_scan(domain):
    harness = Harness(domain, attitude='imu', mounting='tf')
    attitude = domain.publisher(Imu, 'imu')
    transforms = domain.publisher(TransformStamped, 'transforms', 100)
    cloud = keypoints(FACE_TO_FACE)
    harness.send(cloud)
    assert not harness.scans + harness.targets
    assert harness.nearest  # which needs neither
    domain.fault('depth_node', 'where the camera is on the vehicle is not known')
    to_the_right = TransformStamped(
        header=Header(stamp=cloud.header.stamp, frame_id='base_link'),
        child_frame_id=cloud.header.frame_id)
    to_the_right.transform.rotation.y = math.sqrt(0.5)
    to_the_right.transform.rotation.z = -math.sqrt(0.5)
    to_the_right.transform.rotation.w = 0.0
    transforms.publish(to_the_right)
    level = Imu(header=cloud.header)
    level.orientation.w = 0.0
    attitude.publish(level)
    domain.fault('depth_node', 'quaternion of length 0')
    harness.send(cloud)
    assert harness.targets
    assert not harness.scans
    domain.fault('depth_node', 'no person_depth/scan: the attitude')
    level.orientation.w = 1.0
    attitude.publish(level)
    domain.spin_for(0.3)
    harness.send(cloud)
    assert math.isfinite(harness.scans[0].ranges[18])
    assert harness.targets[0].pose.pose.position.y == pytest.approx(-3.5, abs=0.05)
