"""depth_node told the attitude, height and motion of a vehicle over DDS."""
import sys
import time
from types import SimpleNamespace as Fields

from depth_harness import camera_info, CUES, DepthNode, GROUND, keypoints, STANDING
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, LaserScan, PointCloud2, Range
from std_msgs.msg import Float64

from depth_person.nodes.monitor import Monitor
from depth_person.nodes.mounting_input import MountingInput
from depth_person.settings.depth import DepthSettings

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
KINDS = {'imu': Imu, 'rangefinder': Range, 'transforms': TransformStamped}


class Vehicle(DepthNode):
    """A depth_node that sees one person 6 m ahead, and what a vehicle 1.5 m up would publish."""

    def __init__(self, domain, *topics, **parameters):
        super().__init__(domain, **parameters, outputs={
            'person_depth/people': PointCloud2, 'person_depth/scan': LaserScan})
        self.people, self.scans = self.outputs.values()
        self.publishers = {
            topic: domain.publisher(
                KINDS[topic], topic, 10 if topic == 'transforms' else BEST_EFFORT)
            for topic in topics}

    def tell(self, stamp, *, height=1.5, quaternion=(0.0, 0.0, 0.0, 1.0)):
        for topic, publisher in self.publishers.items():
            message = KINDS[topic]()
            message.header.stamp = stamp
            if topic == 'rangefinder':
                message.range, message.min_range, message.max_range = height, 0.2, 40.0
            if topic == 'imu':
                message.orientation.x, message.orientation.y = quaternion[:2]
                message.orientation.z, message.orientation.w = quaternion[2:]
            if topic == 'transforms':
                message.header.frame_id, message.child_frame_id = 'map', 'base_link'
                message.transform.translation.z = height
            publisher.publish(message)

    def see(self, **told):
        """Send one image's keypoints with what the vehicle tells then; return the cues."""
        self.people.clear()
        self.camera_info.publish(camera_info())
        cloud = keypoints(STANDING)
        cloud.header.stamp.sec, cloud.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
        self.tell(cloud.header.stamp, **told)
        self.domain.spin_for(0.05)
        self.keypoints.publish(cloud)
        self.domain.spin_for(0.1)
        return self.people[-1].data[CUES] if self.people else None

    def sees_the_ground(self, **told):
        self.domain.spin_until(lambda: (self.see(**told) or 0) & GROUND)

    def loses_the_ground(self, **told):
        self.domain.spin_until(lambda: (self.see(**told) or GROUND) & GROUND == 0)


def test_a_vehicle_brings_the_ground_in_and_its_silence_and_nonsense_take_it_out(domain):
    vehicle = Vehicle(domain, 'imu', 'rangefinder', attitude='imu', height='rangefinder')
    vehicle.sees_the_ground()
    domain.spin_until(lambda: vehicle.scans)
    figures = {pair.key: pair.value for pair in domain.status('depth_node').values}
    assert (figures['attitude'], figures['height']) == ('known', 'known')
    assert figures['imu age'].endswith(' ms')
    told, vehicle.publishers = vehicle.publishers, {}
    domain.spin_for(0.3)
    vehicle.loses_the_ground()
    assert 'before the image' in domain.fault('depth_node', 'no sample on /imu').message
    vehicle.publishers = told
    domain.spin_for(0.3)
    vehicle.scans.clear()
    vehicle.see(quaternion=(0.0, 0.0, 0.0, 0.0))
    assert not vehicle.scans
    domain.fault('depth_node', 'a quaternion of length 0 instead of 1')
    vehicle.loses_the_ground(height=-2.0)
    domain.fault('depth_node', '-2 m is not within 0.2 to 40 m')
    vehicle.sees_the_ground()


def test_two_publishers_on_one_topic_are_named_and_not_used(domain):
    vehicle = Vehicle(domain, 'imu', attitude='imu', camera_height=1.5)
    vehicle.sees_the_ground()
    second = domain.node.create_publisher(Imu, 'imu', BEST_EFFORT)
    vehicle.loses_the_ground()
    domain.fault('depth_node', '2 publishers send on /imu')
    domain.node.destroy_publisher(second)
    vehicle.sees_the_ground()


def test_transforms_are_taken_without_tf2_and_unknown_frames_named(domain):
    vehicle = Vehicle(domain, 'transforms', attitude='tf', height='tf', camera_pose='tf',
                      mounting='tf')
    vehicle.see()
    message = domain.fault('depth_node', 'is unknown to TF').message
    assert "frame 'camera_optical_frame' is unknown to TF" in message
    camera = TransformStamped(child_frame_id='camera_optical_frame')
    camera.header.frame_id = 'base_link'
    rotation = camera.transform.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = -0.5, 0.5, -0.5, 0.5
    domain.publisher(TransformStamped, 'transforms_static', LATCHED).publish(camera)
    vehicle.sees_the_ground()
    domain.spin_until(lambda: vehicle.scans)


class NodeDouble:
    """What MountingInput needs of a node, without ROS."""

    def __init__(self, **parameters):
        self.settings = DepthSettings(**parameters)
        self.monitor = Monitor(lambda *_: None)
        self.now_ns = 5 * 10**9
        self.topics = {}

    def resolve_topic_name(self, name):
        return f'/{name}'

    def listen(self, kind, topic, callback, **options):
        self.topics[topic] = kind, callback, options['profile']
        return topic

    def crowded(self, _):
        return ''


def test_where_tf2_msgs_is_there_tf_is_heard_with_its_own_profiles(monkeypatch):
    class TFMessage:
        """A stand-in, since the wheels of ROS 2 do not hold it."""

        def __init__(self, *transforms):
            self.transforms = transforms

    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', Fields(TFMessage=TFMessage))
    node = NodeDouble(attitude='tf')
    mounting = MountingInput(node)
    for topic, durability in (('/tf', DurabilityPolicy.VOLATILE),
                              ('/tf_static', DurabilityPolicy.TRANSIENT_LOCAL)):
        kind, take, profile = node.topics[topic]
        assert (kind, profile.durability) == (TFMessage, durability)
        assert profile.reliability == ReliabilityPolicy.RELIABLE
        transform = TransformStamped(child_frame_id='eye' if topic == '/tf' else 'base_link')
        transform.header.frame_id = 'base_link' if topic == '/tf' else 'map'
        transform.header.stamp.sec = 5
        transform.transform.rotation.w = 1.0
        take(TFMessage(transform))
    assert mounting.at(5 * 10**9, 'eye').mounting.gravity == pytest.approx((0, 0, -1))


def test_without_tf2_msgs_the_way_out_is_named():
    node = NodeDouble(attitude='tf')
    MountingInput(node)
    assert set(node.topics) == {'transforms', 'transforms_static'}
    message = node.monitor.status('n').message
    assert 'no tf2_msgs' in message
    assert '/transforms (geometry_msgs/TransformStamped)' in message


def stamped(message, height=3.0):
    message.header.stamp.sec = 5
    pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
    pose.position.z, pose.orientation.w = height, 1.0
    return message


@pytest.mark.parametrize(('name', 'message'), [
    ('pose', stamped(PoseStamped())), ('odometry', stamped(Odometry()))])
def test_pose_and_odometry_tell_attitude_height_and_motion(name, message):
    node = NodeDouble(attitude=name, height=name, camera_pose=name, camera_z=0.5)
    mounting = MountingInput(node)
    assert node.topics[name][0] is type(message)
    assert node.topics[name][2].reliability == ReliabilityPolicy.BEST_EFFORT
    node.topics[name][1](message)
    state = mounting.at(5 * 10**9, 'eye')
    assert state.mounting.gravity == pytest.approx((0, 1, 0))
    assert state.mounting.height == pytest.approx(3.5)
    assert state.pose.position == pytest.approx((0, 0, 3.5))
    assert node.monitor.status('n').message == 'running'


def test_a_height_without_a_stamp_is_of_the_time_it_came():
    node = NodeDouble(attitude='fixed', height='rel_alt')
    mounting = MountingInput(node)
    node.topics['rel_alt'][1](Float64(data=8.0))
    state = mounting.at(5 * 10**9, 'eye').mounting
    assert (state.height, round(state.height_sigma)) == (8.0, 3)
    assert 'above home' in node.monitor.status('n').message
