"""What process writes is what the nodes publish."""
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from depth_person.autopilot.choice import Target
from depth_person.autopilot.scan import ScanOptions
from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Distances
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.autopilot_messages import encode_nearest, encode_scan, encode_target
from depth_person.nodes.cloud_messages import encode_distances, encode_people
from depth_person.nodes.image_messages import header
from depth_person.nodes.marker_messages import encode_markers
from depth_person.pose.people import People
from depth_person.replay.bags import jazzy_types
from depth_person.replay.cdr import Serializer

CAMERA = Intrinsics(1280, 720, 900.0, 900.0, 639.5, 359.5)
IMAGE = header(stamp_ns=7_123_456_789, frame_id='camera_optical_frame')


def crowd():
    """Return people with labels of different lengths; one has no keypoint, and no skeleton."""
    rng = np.random.default_rng(3)
    keypoints = rng.uniform(300.0, 500.0, (3, 18, 3)).astype(np.float32)
    keypoints[1] = np.nan
    return TrackedPeople.unfiltered(
        People(keypoints, np.array([7, 123, 4567], np.int32)), Distances.of(
            position=rng.uniform(1.0, 20.0, (3, 3)), range_sigma=np.array([0.5, 1.0, 12.0]),
            reason=np.zeros(3, np.uint8), cues=np.ones(3, np.uint8)))


MESSAGES = {
    'sensor_msgs/msg/PointCloud2': encode_distances(crowd(), IMAGE),
    'sensor_msgs/msg/PointCloud2 of keypoints': encode_people(crowd().people, IMAGE),
    'visualization_msgs/msg/MarkerArray': encode_markers(crowd(), IMAGE, CAMERA),
    'sensor_msgs/msg/LaserScan': encode_scan(
        np.linspace(0.5, 9.0, 72, dtype=np.float32), IMAGE, frame_id='base_link_frd',
        options=ScanOptions()),
    'sensor_msgs/msg/Range': encode_nearest(
        IMAGE, distance=4.0, sigma=0.3, max_range=100.0, intrinsics=CAMERA),
    'geometry_msgs/msg/PoseWithCovarianceStamped': encode_target(
        Target(7, np.array([1.0, 2.0, 3.0]), np.eye(3)), IMAGE, frame_id='base_link'),
}


@pytest.mark.parametrize('name', MESSAGES)
def test_readers_get_the_message_that_subscribers_of_the_nodes_get(name):
    message = MESSAGES[name]
    written = Serializer(jazzy_types()).serialize(message, name.partition(' ')[0])
    published = serialize_message(message)
    assert len(written) == len(published)
    assert deserialize_message(written, type(message)) == (
        deserialize_message(published, type(message)))
