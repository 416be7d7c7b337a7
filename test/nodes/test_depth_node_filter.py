"""People over time in a depth_node of its own, fed over DDS."""
from depth_harness import camera_info, DepthNode, keypoints, RELIABLE
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from depth_person.nodes.cloud_messages import decode_cloud, PERSON_POINT

STEP_NS = 100_000_000


def facing(depth):
    """Return the keypoints of someone who faces the camera, shoulders 0.35 m apart."""
    def at(x, y):
        return 640 + 900 * x / depth, 360 + 900 * y / depth
    return {0: at(0, -0.2), 1: at(0, 0), 2: at(-0.175, 0), 5: at(0.175, 0)}


class Harness(DepthNode):
    """A depth_node that is shown one frame after the other."""

    def __init__(self, domain):
        super().__init__(domain, *RELIABLE, estimator='shoulder', outputs={
            'person_depth/people': PointCloud2, 'person_depth': MarkerArray})
        self.people, self.markers = self.outputs.values()
        self.camera_info.publish(camera_info())
        domain.spin_for(0.2)

    def see(self, stamp_ns, *depths):
        """Return the points of /person_depth/people and the markers of a frame."""
        cloud = keypoints(*map(facing, depths))
        cloud.header.stamp.sec, cloud.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        self.forget()
        self.keypoints.publish(cloud)
        self.domain.spin_until(lambda: self.people and self.markers)
        assert self.people[0].header == cloud.header
        return decode_cloud(self.people[0], PERSON_POINT)[0], self.markers[0].markers

    def walk(self, start_ns, steps=15):
        """Return the stamp after someone has come nearer by 1.5 m/s, from 6 m."""
        for step in range(steps):
            people, _ = self.see(start_ns + step * STEP_NS, 6.0 - 0.15 * step)
        return people[0], start_ns + steps * STEP_NS


@pytest.fixture(scope='module')
def harness(shared_domain):
    return Harness(shared_domain)


def test_velocity_and_time_to_contact_are_published_beside_the_raw_range(harness):
    person, _ = harness.walk(10 * 10**9)
    assert not person['predicted']
    assert person['range_measured'] == pytest.approx(3.9, abs=0.01)
    assert person['range'] == pytest.approx(3.9, abs=0.15)
    assert person['velocity_z'] == pytest.approx(-1.5, abs=0.3)
    assert abs(person['velocity_x']) < 0.1
    assert person['time_to_contact'] == pytest.approx(3.9 / 1.5, rel=0.2)
    assert 0 < person['time_to_contact_sigma'] < 2
    assert 0 < person['velocity_sigma'] < 1


def test_the_hidden_are_predicted_flagged_and_then_gone(harness):
    last, stamp = harness.walk(100 * 10**9)
    sigmas = []
    for step in range(9):
        (person,), markers = harness.see(stamp + step * STEP_NS)
        assert (person['predicted'], person['track_id']) == (1, last['track_id'])
        assert person['range'] == pytest.approx(3.75 - 0.15 * step, abs=0.5)
        assert np.isnan([person['range_measured'], person['u']]).all()
        assert {marker.ns for marker in markers[1:]} == {'person', 'label', 'uncertainty'}
        assert all(marker.color.a < 0.5 for marker in markers[1:])
        sigmas.append(person['range_sigma'])
    assert (np.diff(sigmas) > 0).all()
    people, markers = harness.see(stamp + 11 * STEP_NS)
    assert (len(people), len(markers)) == (0, 1)


def test_a_clock_set_back_begins_anew(harness):
    harness.walk(200 * 10**9)
    (person,), _ = harness.see(50 * 10**9, 9.0)
    assert person['range'] == person['range_measured'] == pytest.approx(9.0, abs=0.01)


def test_parameters_switch_the_filter_and_set_how_long_it_predicts(harness):
    set_parameter = harness.domain.set_parameter
    refused = set_parameter('depth_node', 'prediction_time', -1.0)
    assert not refused.successful
    assert 'out of range' in refused.reason
    assert set_parameter('depth_node', 'prediction_time', 0.0).successful
    _, stamp = harness.walk(300 * 10**9, steps=5)
    assert len(harness.see(stamp)[0]) == 0
    assert set_parameter('depth_node', 'filter', False).successful
    person, _ = harness.walk(400 * 10**9, steps=5)
    assert person['range'] == person['range_measured']
    assert np.isnan(person['velocity_z'])


def test_a_parameter_of_something_else_forgets_nobody(harness):
    assert harness.domain.set_parameter('depth_node', 'filter', True).successful
    _, stamp = harness.walk(500 * 10**9)
    assert harness.domain.set_parameter('depth_node', 'jpeg_quality', 80).successful
    (person,), _ = harness.see(stamp, 3.75)
    assert person['velocity_z'] == pytest.approx(-1.5, abs=0.3)
