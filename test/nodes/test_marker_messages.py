"""People at their distances as markers."""
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Distances, Reason
from depth_person.distance.tracked import TrackedPeople
from depth_person.nodes.marker_messages import encode_markers
from depth_person.pose.people import People

CAMERA = Intrinsics(200, 100, 100.0, 100.0, 100.0, 50.0)
HEADER = Header(frame_id='eye')


def markers_of(people, distances, header, camera):
    return encode_markers(TrackedPeople.unfiltered(people, distances), header, camera)


def crowd(count):
    keypoints = np.full((count, 18, 3), np.nan, np.float32)
    keypoints[:, 1] = (160, 50, 0.9)  # the neck, and a shoulder
    keypoints[:, 2] = (150, 60, 0.9)
    return People(keypoints, np.arange(1, 1 + count, dtype=np.int32))


def at(position, sigma=0.5, reason=Reason.NONE):
    position = np.atleast_2d(np.asarray(position, float))
    count = len(position)
    return Distances(
        np.linalg.norm(position, axis=1), np.full(count, sigma), position,
        np.full(count, reason, np.uint8), np.ones(count, np.uint8))


def test_a_person_is_drawn_where_it_is():
    array = markers_of(crowd(1), at([2.4, 0.0, 4.0]), HEADER, CAMERA)
    clear, person, label, uncertainty, skeleton = array.markers
    assert clear.action == Marker.DELETEALL
    assert [marker.ns for marker in array.markers] == [
        '', 'person', 'label', 'uncertainty', 'skeleton']
    assert [marker.type for marker in array.markers[1:]] == [
        Marker.SPHERE, Marker.TEXT_VIEW_FACING, Marker.LINE_LIST, Marker.LINE_LIST]
    assert (person.pose.position.x, person.pose.position.y, person.pose.position.z) == (2.4, 0, 4)
    assert label.text == '#1 4.66 ± 0.50 m'
    assert label.pose.position.y < 0  # above: y points down
    ends = np.array([[point.x, point.y, point.z] for point in uncertainty.points])
    assert np.linalg.norm(ends, axis=1) == pytest.approx([4.6648 - 0.5, 4.6648 + 0.5], abs=1e-4)
    assert np.cross(ends, [2.4, 0, 4.0]) == pytest.approx(0)
    limb = [(point.x, point.y, point.z) for point in skeleton.points]
    assert limb == [pytest.approx((2.4, 0, 4)), pytest.approx((2.0, 0.4, 4))]


def test_a_sigma_larger_than_the_range_ends_at_the_camera():
    uncertainty = markers_of(crowd(1), at([0, 0, 2.0], sigma=9.0), HEADER, CAMERA).markers[3]
    assert [point.z for point in uncertainty.points] == [0.0, 11.0]


def test_people_without_a_range_are_left_out():
    distances = at([[0, 0, 2.0], [np.nan] * 3, [0, 0, 3.0]])
    distances.reason[1] = Reason.NO_SHOULDERS
    markers = markers_of(crowd(3), distances, HEADER, CAMERA).markers
    assert {marker.id for marker in markers[1:]} == {1, 3}


@pytest.mark.parametrize('camera', [CAMERA, None])
def test_nobody_is_one_marker_that_clears(camera):
    markers = markers_of(
        People.nobody(), at(np.empty((0, 3))), HEADER, camera).markers
    assert [(marker.action, marker.header) for marker in markers] == [(Marker.DELETEALL, HEADER)]


def test_the_predicted_are_see_through_and_say_so():
    tracked = TrackedPeople.unfiltered(crowd(1), at([2.4, 0.0, 4.0])).with_hidden(
        np.array([7], np.int32))
    tracked = replace(
        tracked, distances=at([[2.4, 0, 4.0], [0, 0, 2.0]]), predicted=np.array([False, True]))
    markers = encode_markers(tracked, HEADER, CAMERA).markers[1:]
    opacity = {(marker.id, marker.ns): marker.color.a for marker in markers}
    assert set(opacity) == {
        (1, 'person'), (1, 'label'), (1, 'uncertainty'), (1, 'skeleton'),
        (7, 'person'), (7, 'label'), (7, 'uncertainty')}
    assert all((alpha < 0.5) == (who == 7) for (who, _), alpha in opacity.items())
    assert [marker.text for marker in markers if marker.ns == 'label'] == [
        '#1 4.66 ± 0.50 m', '#7 2.00 ± 0.50 m (predicted)']


def test_a_person_without_a_whole_limb_has_no_skeleton():
    people = crowd(1)
    people.keypoints[0, 2] = np.nan
    markers = markers_of(people, at([0, 0, 2.0]), HEADER, CAMERA).markers
    assert [marker.ns for marker in markers] == ['', 'person', 'label', 'uncertainty']


@given(st.lists(st.tuples(
    st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 100) | st.just(float('nan')),
    st.floats(0, 100) | st.just(float('nan')) | st.just(float('inf'))), max_size=4))
def test_every_number_is_finite_and_every_colour_a_colour(rows):
    position = np.array([row[:3] for row in rows], float).reshape(-1, 3)
    distances = Distances(
        np.linalg.norm(position, axis=1), np.array([row[3] for row in rows], float), position,
        np.zeros(len(rows), np.uint8), np.zeros(len(rows), np.uint8))
    for marker in markers_of(crowd(len(rows)), distances, HEADER, CAMERA).markers[1:]:
        points = [marker.pose.position, *marker.points]
        assert np.isfinite([[point.x, point.y, point.z] for point in points]).all()
        assert all(0 <= part <= 1 for part in (marker.color.r, marker.color.g, marker.color.b))
        assert (marker.color.a, marker.pose.orientation.w) == (1, 1)
        assert (marker.lifetime.sec, marker.lifetime.nanosec) == (0, 500_000_000)
        assert max(marker.scale.x, marker.scale.z) > 0
