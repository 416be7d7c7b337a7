"""mavlink_node between ROS topics and an autopilot that speaks MAVLink."""
import time

from autopilot_double import AutopilotDouble
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import numpy as np
import pytest
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header

from depth_person.distance.estimator import Distances
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.cloud_messages import encode_distances
from depth_person.nodes.image_messages import header
from depth_person.pose.people import People


class Harness:
    """A mavlink_node with everything on, between a domain and a double."""

    def __init__(self, domain, double, **parameters):
        self.domain, self.double = domain, double
        parameters = {
            'connection': f'udpout:127.0.0.1:{double.port}', 'obstacle_distance_3d': True,
            'follow_target': True, 'camera_pitch': 30.0, 'scan_sigmas': 2.0, **parameters}
        self.program = domain.start('mavlink_node', **parameters)
        topics = {'scan': LaserScan, 'people': PointCloud2, 'target': PoseWithCovarianceStamped}
        self.scan, self.people, self.target = (
            domain.node.create_publisher(kind, f'person_depth/{name}', 10)
            for name, kind in topics.items())
        domain.spin_until(self.people.get_subscription_count)
        domain.spin_for(0.5)

    def sent(self, publish, kind, wait_s=0.3):
        """Return the MAVLink messages of a kind that come while something is published."""
        self.double.drain()
        publish()
        deadline = time.monotonic() + wait_s
        while time.monotonic() < deadline:
            self.domain.spin_for(0.02)
            self.double.listen()
        return self.double.of(kind)

    def sent_at_last(self, publish, kind):
        messages = []
        self.domain.spin_until(lambda: messages.extend(self.sent(publish, kind)) or messages)
        return messages


def stamped(age_s=0.0, frame_id='camera_optical_frame'):
    return header(stamp_ns=time.time_ns() - round(age_s * 1e9), frame_id=frame_id)


def scan_of(metres, *, age_s=0.0, bins=72):
    ranges = [float('nan')] * bins
    ranges[3] = metres
    return LaserScan(
        header=stamped(age_s, 'base_link_frd'), angle_increment=2 * np.pi / bins,
        angle_max=2 * np.pi * (bins - 1) / bins, range_min=0.2, range_max=30.0, ranges=ranges)


def people_at(*positions, sigma=0.5):
    count = len(positions)
    keypoints = np.full((count, 18, 3), np.nan, np.float32)
    people = People(keypoints, np.arange(7, 7 + count, dtype=np.int32))
    distances = Distances.of(
        position=np.array(positions, float), range_sigma=np.full(count, sigma),
        reason=np.zeros(count, np.uint8), cues=np.ones(count, np.uint8))
    return encode_distances(TrackedPeople.unfiltered(people, distances), stamped())


def target_at(*position):
    message = PoseWithCovarianceStamped(header=stamped(frame_id='base_link'))
    place = message.pose.pose.position
    place.x, place.y, place.z = position
    message.pose.covariance[0] = message.pose.covariance[7] = 0.25
    message.pose.covariance[14] = 0.04
    return message


@pytest.fixture(scope='module')
def harness(shared_domain):
    double = AutopilotDouble()
    yield Harness(shared_domain, double)
    double.close()


def test_a_vehicle_that_is_silent_is_named_until_it_is_heard(harness):
    harness.domain.fault('mavlink_node', 'no heartbeat of system 1')
    harness.double.listen_until(lambda: harness.double.of('HEARTBEAT'))

    def healthy(status):
        harness.double.heartbeat()
        harness.double.listen()
        return 'no heartbeat' not in status.message

    harness.domain.status('mavlink_node', healthy)


def test_a_scan_becomes_an_obstacle_distance(harness):
    message = harness.sent_at_last(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE')[0]
    assert message.distances[3] == 450
    assert set(message.distances) == {450, 65535}
    assert (message.min_distance, message.max_distance, message.frame) == (20, 3000, 12)
    assert abs(message.time_usec - time.time() * 1e6) < 5e6
    once = harness.sent(lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE', 1.2)
    assert len(once) <= 1  # nothing is repeated; on a busy machine it may come too late


def test_a_stale_or_foreign_scan_is_not_sent(harness):
    assert not harness.sent(
        lambda: harness.scan.publish(scan_of(4.5, age_s=0.8)), 'OBSTACLE_DISTANCE')
    harness.domain.fault('mavlink_node', 'results are dropped')
    assert not harness.sent(
        lambda: harness.scan.publish(scan_of(4.5, bins=360)), 'OBSTACLE_DISTANCE')
    harness.domain.fault('mavlink_node', 'a scan of 360 bins')
    assert harness.sent_at_last(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE')


def test_people_become_obstacles_in_the_bodys_frame(harness):
    # 6 m along the axis of a camera that looks down by 30 degrees, less two sigmas: 5 m.
    messages = harness.sent_at_last(
        lambda: harness.people.publish(people_at((0, 0, 6.0), (0, 0, 80.0))),
        'OBSTACLE_DISTANCE_3D')
    message = messages[0]
    assert (message.x, message.y, message.z) == pytest.approx((4.330, 0, 2.5), abs=1e-3)
    assert (message.obstacle_id, message.frame) == (7, 12)
    assert {each.obstacle_id for each in messages} == {7}  # 80 m is beyond the limit


def test_without_a_mounting_no_obstacle_is_told_in_three_dimensions(domain):
    double = AutopilotDouble(system_id=9)
    harness = Harness(
        domain, double, mounting='tf', system_id=9, obstacle_distance=False, follow_target=False)
    transforms = domain.publisher(TransformStamped, 'transforms', 100)
    cloud = people_at((0, 0, 6.0))
    assert not harness.sent(lambda: harness.people.publish(cloud), 'OBSTACLE_DISTANCE_3D')
    domain.fault('mavlink_node', 'the mounting is not known')

    def tell():
        cloud = people_at((0, 0, 6.0))
        straight_down = TransformStamped(
            header=Header(stamp=cloud.header.stamp, frame_id='base_link'),
            child_frame_id=cloud.header.frame_id)
        straight_down.transform.rotation.x = 0.5 ** 0.5
        straight_down.transform.rotation.y = -0.5 ** 0.5
        straight_down.transform.rotation.w = 0.0
        transforms.publish(straight_down)
        domain.spin_for(0.05)
        harness.people.publish(cloud)

    message = harness.sent_at_last(tell, 'OBSTACLE_DISTANCE_3D')[0]
    assert message.get_srcSystem() == 9
    assert (message.x, message.y, message.z) == pytest.approx((0, 0, 5.0), abs=1e-3)
    double.close()


def test_a_target_is_sent_once_the_vehicle_says_where_it_is(harness):
    double = harness.double

    def ask():
        harness.target.publish(target_at(10.0, 0.0, -2.0))

    assert not harness.sent(ask, 'FOLLOW_TARGET')
    harness.domain.fault('mavlink_node', 'no FOLLOW_TARGET')

    def fly():
        double.stand_at(47.0, 8.0, 500.0, heading_deg=90.0)
        ask()

    message = harness.sent_at_last(fly, 'FOLLOW_TARGET')[0]
    assert message.get_srcSystem() == 200
    assert message.est_capabilities == 1
    assert (message.lon * 1e-7 - 8) * 76_057 == pytest.approx(10.0, abs=0.05)
    assert (message.lat * 1e-7 - 47) * 111_173 == pytest.approx(0.0, abs=0.05)
    assert message.alt == pytest.approx(498.0)
    assert message.position_cov[:2] == pytest.approx([0.5 ** 0.5, 0.2])


def test_a_cloud_of_another_layout_is_named(harness):
    cloud = people_at((0, 0, 6.0))
    cloud.fields = cloud.fields[:4]
    harness.people.publish(cloud)
    harness.domain.fault('mavlink_node', 'a point cloud lacks the field')


def test_a_flood_is_named_and_does_not_stop_the_node(harness):
    def named(status):
        for _ in range(20):
            harness.double.send_bytes(bytes(8000))
        return 'floods' in status.message

    harness.domain.status('mavlink_node', named)
    harness.domain.status('mavlink_node', lambda status: 'floods' not in status.message)
    assert harness.sent_at_last(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE')


def test_with_two_publishers_nothing_is_sent(harness):
    domain = harness.domain
    second = domain.node.create_publisher(LaserScan, 'person_depth/scan', 10)
    domain.fault('mavlink_node', '2 publishers send on /person_depth/scan')
    assert not harness.sent(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE', 1.0)
    domain.node.destroy_publisher(second)
    assert harness.sent_at_last(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE')


def test_deactivation_ends_all_traffic_until_it_is_activated_again(harness):
    def change(transition):
        manager = harness.domain.node.create_client(ChangeState, 'mavlink_node/change_state')
        harness.domain.spin_until(manager.service_is_ready)
        answer = manager.call_async(
            ChangeState.Request(transition=Transition(id=transition)))
        harness.domain.spin_until(answer.done)
        assert answer.result().success

    change(Transition.TRANSITION_DEACTIVATE)
    harness.sent(lambda: None, 'HEARTBEAT', 0.3)
    assert not harness.sent(lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE', 1.5)
    assert not harness.double.heard
    change(Transition.TRANSITION_ACTIVATE)
    assert harness.sent_at_last(
        lambda: harness.scan.publish(scan_of(4.5)), 'OBSTACLE_DISTANCE')


def test_ctrl_c_ends_it_without_a_traceback(harness):
    harness.program.interrupt()
    assert harness.program.exit_code(5) == 0
    assert 'Traceback' not in harness.program.said
