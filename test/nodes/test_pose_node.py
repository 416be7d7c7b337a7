"""pose_node in a process of its own, fed over DDS."""
import struct

import cv2
from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CompressedImage, Image, PointCloud2, PointField

SMALL = ('--ros-args', '-p', 'input_size:=128')


def image_message(picture, second=1):
    height, width = picture.shape[:2]
    message = Image(height=height, width=width, encoding='bgr8', step=3 * width)
    message.data = picture.tobytes()
    message.header.frame_id = 'front_optical_frame'
    message.header.stamp.sec = second
    message.header.stamp.nanosec = 999999999
    return message


class Harness:
    """A running pose_node and both ends of its topics."""

    def __init__(self, domain):
        self.domain = domain
        self.program = domain.start('pose_node', *SMALL)
        self.clouds = domain.listen(PointCloud2, 'person_keypoints')
        self.images = domain.publisher(Image, 'image_raw')
        domain.spin_until(lambda: domain.node.count_publishers('person_keypoints'))
        domain.spin_for(0.5)

    def find(self, message):
        """Return the keypoint cloud of an image, sent until it has got through."""
        del self.clouds[:]

        def sent():
            self.images.publish(message)
            self.domain.spin_for(0.2)
            return [cloud for cloud in self.clouds if cloud.header == message.header]

        self.domain.spin_until(sent)
        return self.clouds[-1]


@pytest.fixture(scope='module')
def harness(shared_domain):
    return Harness(shared_domain)


def test_the_keypoints_of_a_photograph_come_as_documented(harness, photograph):
    message = image_message(photograph)
    cloud = harness.find(message)
    assert cloud.header == message.header
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 18, 16, 288)
    assert not cloud.is_dense
    assert not cloud.is_bigendian
    assert [(field.name, field.offset, field.datatype, field.count)
            for field in cloud.fields] == [
        ('u', 0, PointField.FLOAT32, 1), ('v', 4, PointField.FLOAT32, 1),
        ('score', 8, PointField.FLOAT32, 1), ('track_id', 12, PointField.INT32, 1)]
    points = np.array(list(struct.iter_unpack('<fffi', cloud.data)))
    assert len(points) == 18
    neck, right, left = points[1], points[2], points[5]
    assert right[:2] == pytest.approx((72, 424), abs=25)  # marked by hand
    assert left[:2] == pytest.approx((456, 428), abs=25)
    assert neck[:2] == pytest.approx((right + left)[:2] / 2, abs=0.01)
    assert (points[:, 3] == points[0, 3]).all()
    found = ~np.isnan(points[:, 0])
    assert (np.isnan(points[:, :3]).all(axis=1) == ~found).all()
    assert ((points[found, 2] > 0) & (points[found, 2] <= 1)).all()


def test_an_image_without_people_gives_an_empty_cloud(harness):
    message = image_message(np.full((240, 320, 3), 90, np.uint8), second=2)
    cloud = harness.find(message)
    assert (cloud.height, cloud.width, len(cloud.data)) == (0, 18, 0)


def test_it_says_where_its_network_marks_keypoints(harness, photograph):
    harness.find(image_message(photograph))
    harness.domain.status('pose_node', lambda status: ('convention', 'movenet_crops') in [
        (pair.key, pair.value) for pair in status.values])


@pytest.mark.parametrize(('fault', 'said'), [
    ({'width': 0, 'height': 0, 'step': 0, 'data': b''}, 'empty'),
    ({'encoding': '32FC7'}, "encoding '32FC7' is not supported"),
    ({'step': 100}, 'step 100 is smaller'),
    ({'data': bytes(1000)}, 'too short'),
])
def test_a_bad_image_is_reported_and_the_next_good_one_is_taken(
        harness, photograph, fault, said):
    bad = image_message(photograph)
    for name, value in fault.items():
        setattr(bad, name, value)

    def reported(status):
        harness.images.publish(bad)
        return said in status.message and status.level == DiagnosticStatus.ERROR

    harness.images.publish(bad)
    status = harness.domain.status('pose_node', reported)
    counts = {pair.key: pair.value for pair in status.values}
    assert int(counts['bad images']) >= 1
    assert harness.find(image_message(photograph, second=3)).height == 1
    harness.domain.status('pose_node', lambda status: said not in status.message)


def test_a_camera_that_comes_back_is_heard_again(harness, photograph):
    harness.domain.node.destroy_publisher(harness.images)
    status = harness.domain.fault('pose_node', 'no message on /image_raw')
    assert status.level == DiagnosticStatus.ERROR
    harness.images = harness.domain.publisher(Image, 'image_raw')
    assert harness.find(image_message(photograph, second=4)).height == 1
    harness.domain.healthy('pose_node')


def test_the_model_that_is_not_there_ends_it_with_the_command_to_run(domain, tmp_path):
    domain.environment['DEPTH_PERSON_HOME'] = str(tmp_path / 'none')
    program = domain.start('pose_node', ready='depth_person models install')
    assert program.exit_code() == 1
    assert 'Traceback' not in program.said


def test_compressed_images_are_taken_and_a_torn_one_reported(domain, photograph):
    domain.start('pose_node', *SMALL, '-p', 'compressed:=true')
    clouds = domain.listen(PointCloud2, 'person_keypoints')
    publisher = domain.publisher(CompressedImage, 'image_raw/compressed')
    jpeg = cv2.imencode('.jpg', photograph)[1].tobytes()
    torn = CompressedImage(format='jpeg', data=jpeg[:2000])
    whole = CompressedImage(format='jpeg', data=jpeg)

    def reported(status):
        publisher.publish(torn)
        return 'torn' in status.message

    domain.status('pose_node', reported)
    domain.spin_until(lambda: publisher.publish(whole) or domain.spin_for(0.2) or clouds)
    assert clouds[-1].height == 1


def test_a_publisher_that_offers_too_little_is_reported_with_both_profiles(domain):
    program = domain.start(
        'pose_node', *SMALL, '-p',
        'qos_overrides./image_raw.subscription.reliability:=reliable')
    profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = domain.node.create_publisher(Image, 'image_raw', profile)
    status = domain.fault('pose_node', 'no message passes on /image_raw')
    assert 'offers best_effort' in status.message
    assert 'asks reliable' in status.message
    assert 'qos_overrides./image_raw.subscription.reliability' in status.message
    assert 'no message passes on /image_raw' in program.said
    domain.node.destroy_publisher(publisher)
    domain.node.create_publisher(Image, 'image_raw', 1)
    domain.status('pose_node', lambda status: 'passes' not in status.message)


def test_a_subscriber_that_asks_too_much_is_reported_by_the_publisher(domain):
    domain.start(
        'pose_node', *SMALL, '-p',
        'qos_overrides./person_keypoints.publisher.reliability:=best_effort')
    domain.listen(PointCloud2, 'person_keypoints')
    domain.fault('pose_node', 'no message passes on /person_keypoints')
    # DDS tells the names of nodes some time after their subscriptions.
    domain.status('pose_node', lambda status: 'the subscriber is /test' in status.message)
