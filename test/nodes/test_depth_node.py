"""depth_node in a process of its own, fed over DDS."""
import struct

from depth_harness import camera_info, DepthNode, FACE_TO_FACE, keypoints, RELIABLE
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray


class Harness(DepthNode):
    """A depth_node that measures one cloud after the other."""

    def __init__(self, domain):
        super().__init__(domain, *RELIABLE, estimator='shoulder', outputs={
            'person_depth/people': PointCloud2, 'person_depth': MarkerArray})
        self.people, self.markers = self.outputs.values()

    def measure(self, cloud, info=None, reason=0):
        """Return people and markers of a keypoint cloud, once the first person has a reason."""
        def measured():
            if info is not None:
                self.camera_info.publish(info)
                self.domain.spin_for(0.1)
            self.forget()
            self.keypoints.publish(cloud)
            self.domain.spin_until(lambda: self.people and self.markers)
            return not self.people[0].data or self.people[0].data[36] == reason

        self.domain.spin_until(measured)
        return self.people[0], self.markers[0].markers


@pytest.fixture(scope='module')
def harness(shared_domain):
    return Harness(shared_domain)


def test_a_person_is_measured_as_documented(harness):
    people, markers = harness.measure(keypoints(FACE_TO_FACE), camera_info())
    assert (people.height, people.width, people.point_step, people.row_step) == (1, 1, 84, 84)
    assert people.header == keypoints().header
    assert people.is_dense
    assert [(field.name, field.offset, field.datatype) for field in people.fields] == [
        ('x', 0, 7), ('y', 4, 7), ('z', 8, 7), ('range', 12, 7), ('range_sigma', 16, 7),
        ('score', 20, 7), ('track_id', 24, 5), ('u', 28, 7), ('v', 32, 7), ('reason', 36, 2),
        ('cues', 37, 2), ('predicted', 38, 2), ('velocity_x', 40, 7), ('velocity_y', 44, 7),
        ('velocity_z', 48, 7), ('velocity_sigma', 52, 7), ('time_to_contact', 56, 7),
        ('time_to_contact_sigma', 60, 7), ('range_measured', 64, 7),
        ('range_sigma_measured', 68, 7), ('x_measured', 72, 7), ('y_measured', 76, 7),
        ('z_measured', 80, 7)]
    x, y, z, distance, sigma, score, track_id, u, v, reason, cues = struct.unpack_from(
        '<ffffffiffBB', people.data)
    assert (x, y, z, distance) == pytest.approx((0, 0, 3.5, 3.5), abs=0.05)  # 900 * 0.35 / 90
    assert 0.1 < sigma < 1.0
    assert (track_id, u, v, reason, cues) == (3, 640, 360, 0, 1)
    assert score == pytest.approx(0.9)
    assert [(marker.ns, marker.id, marker.action) for marker in markers] == [
        ('', 0, Marker.DELETEALL), ('person', 3, Marker.ADD), ('label', 3, Marker.ADD),
        ('uncertainty', 3, Marker.ADD), ('skeleton', 3, Marker.ADD)]
    assert all(marker.header == people.header for marker in markers)
    neck = markers[1].pose.position
    assert (neck.x, neck.y, neck.z) == pytest.approx((x, y, z), abs=1e-5)


def test_nobody_clears_the_markers_and_is_an_empty_cloud(harness):
    people, markers = harness.measure(keypoints(), camera_info())
    assert (people.width, len(people.data)) == (0, 0)
    assert [marker.action for marker in markers] == [Marker.DELETEALL]


def test_a_person_without_a_range_is_in_the_cloud_with_the_reason_only(harness):
    people, markers = harness.measure(
        keypoints({0: (640, 300), 2: (595, 360)}, FACE_TO_FACE), camera_info(), reason=2)
    first = struct.unpack_from('<ffffffiffBB', people.data)
    assert np.isnan(first[:5]).all()
    assert (first[6], first[9], first[10]) == (3, 2, 0)
    assert not people.is_dense
    assert {marker.id for marker in markers[1:]} == {4}


@pytest.mark.parametrize(('info', 'said'), [
    (camera_info(focal_length=0.0), 'uncalibrated'),
    (camera_info(focal_length=float('nan')), 'NaN'),
    (camera_info(width=0), 'size'),
    (camera_info(focal_length=-900.0), 'not positive'),
])
def test_a_useless_camera_info_is_reported_and_a_good_one_mends_it(harness, info, said):
    _, markers = harness.measure(keypoints(FACE_TO_FACE), info, reason=1)
    assert len(markers) == 1
    harness.domain.fault('depth_node', said)
    harness.measure(keypoints(FACE_TO_FACE), camera_info())
    harness.domain.status('depth_node', lambda status: said not in status.message)


def test_a_camera_info_of_another_resolution_is_refused(harness):
    domain = harness.domain
    images = domain.node.create_publisher(Image, 'image_raw', 1)
    image = Image(width=1280, height=720, encoding='mono8', step=1280, data=bytes(1280 * 720))
    harness.measure(keypoints(FACE_TO_FACE), camera_info(width=640, height=360))
    domain.spin_until(images.get_subscription_count)

    def seen():
        images.publish(image)
        domain.spin_for(0.2)
        return not images.get_subscription_count()

    domain.spin_until(seen)  # one image is enough, then it does not listen any more
    _, markers = harness.measure(keypoints(FACE_TO_FACE), reason=1)
    assert len(markers) == 1
    domain.fault('depth_node', 'is for 640x360 px, the images have 1280x720')
    harness.measure(keypoints(FACE_TO_FACE), camera_info())
    domain.node.destroy_publisher(images)


def test_a_camera_info_of_another_frame_is_reported_and_used(harness):
    harness.measure(keypoints(FACE_TO_FACE), camera_info(frame_id='left'))
    harness.domain.fault('depth_node', "is of frame 'left'")
    harness.measure(keypoints(FACE_TO_FACE), camera_info())


def test_a_foreign_cloud_is_reported_and_the_next_good_one_measured(harness):
    foreign = keypoints(FACE_TO_FACE)
    foreign.fields = foreign.fields[:3]
    short = keypoints(FACE_TO_FACE)
    short.data = short.data[:100]
    harness.keypoints.publish(foreign)
    harness.domain.fault('depth_node', "lacks the field 'track_id'")
    harness.keypoints.publish(short)
    harness.domain.fault('depth_node', 'comes in 100 bytes')
    people, _ = harness.measure(keypoints(FACE_TO_FACE), camera_info())
    assert people.width == 1


def test_parameters_are_refused_with_the_reason_or_change_the_next_result(harness):
    set_parameter = harness.domain.set_parameter
    refused = set_parameter('depth_node', 'shoulder_width', 7.0)
    assert not refused.successful
    assert 'out of range' in refused.reason
    refused = set_parameter('depth_node', 'estimator', 'guess')
    assert not refused.successful
    assert "'guess' is not one of" in refused.reason
    assert not set_parameter('depth_node', 'shoulder_width', 'wide').successful
    assert not set_parameter('depth_node', 'compressed', True).successful  # read-only
    assert set_parameter('depth_node', 'max_range', 3).successful  # an integer for a double
    _, markers = harness.measure(keypoints(FACE_TO_FACE), camera_info(), reason=5)
    assert len(markers) == 1
    assert set_parameter('depth_node', 'max_range', 100.0).successful
    assert set_parameter('depth_node', 'shoulder_width', 0.7).successful
    people, _ = harness.measure(keypoints(FACE_TO_FACE))
    assert struct.unpack_from('<f', people.data, 12)[0] == pytest.approx(7.0, abs=0.1)
    assert set_parameter('depth_node', 'shoulder_width', 0.35).successful


def test_the_overlay_is_drawn_into_the_image_of_the_same_stamp(harness):
    domain = harness.domain
    pictures = domain.listen(CompressedImage, 'person_depth/image/compressed')
    images = domain.node.create_publisher(Image, 'image_raw', 1)
    image = Image(width=1280, height=720, encoding='mono8', step=1280, data=bytes(1280 * 720))
    cloud = keypoints(FACE_TO_FACE, second=9)
    image.header = cloud.header

    def publish_both():
        if images.get_subscription_count():
            images.publish(image)
        harness.keypoints.publish(cloud)
        domain.spin_for(0.1)
        return pictures

    domain.spin_until(publish_both)
    assert pictures[0].header == cloud.header
    assert bytes(pictures[0].data[:2]) == b'\xff\xd8'
    domain.node.destroy_publisher(images)


def test_ctrl_c_ends_it_without_a_traceback(harness):
    harness.program.interrupt()
    assert harness.program.exit_code(5) == 0
    assert 'Traceback' not in harness.program.said
