"""People and distances as point clouds."""
from dataclasses import replace
import struct

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
import numpy as np
import pytest
from sensor_msgs.msg import PointField
from std_msgs.msg import Header

from depth_person.distance.estimator import Distances, Reason
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.nodes.cloud_messages import (
    decode_cloud,
    decode_people,
    encode_distances,
    encode_people,
    KEYPOINT_POINT,
    PERSON_POINT,
)
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint

NAN = float('nan')


def people(count, neck=None):
    """Return people with all keypoints, the neck between the shoulders unless given."""
    keypoints = np.arange(count * 18 * 3, dtype=np.float32).reshape(count, 18, 3) / 64
    keypoints[:, Keypoint.NECK, :2] = (
        keypoints[:, Keypoint.R_SHOULDER, :2] + keypoints[:, Keypoint.L_SHOULDER, :2]) / 2
    if neck is not None:
        keypoints[:, Keypoint.NECK, :2] = neck
    return People(keypoints, np.arange(7, 7 + count, dtype=np.int32))


@given(arrays(np.float32, st.tuples(st.integers(0, 4), st.just(18), st.just(3)),
              elements=st.floats(-1e4, 1e4, width=32)), st.data())
def test_people_survive(keypoints, data):
    missing = data.draw(arrays(bool, keypoints.shape[:2]))
    keypoints[missing] = np.nan
    ids = data.draw(arrays(np.int32, len(keypoints), elements=st.integers(0, 2**31 - 1)))
    decoded = decode_people(encode_people(People(keypoints, ids), Header()))
    np.testing.assert_array_equal(decoded.keypoints, keypoints)
    np.testing.assert_array_equal(decoded.track_ids, ids)


@pytest.mark.parametrize(('neck', 'measured'), [
    (None, False), ((3.0, 4.0), True), ((NAN, NAN), False)])
def test_a_neck_between_the_shoulders_counts_as_derived_from_them(neck, measured):
    decoded = decode_people(encode_people(people(2, neck), Header()))
    assert decoded.neck_measured == measured


def test_an_infinite_or_half_missing_keypoint_is_missing():
    keypoints = people(1).keypoints.copy()
    keypoints[0, 4, 0] = np.inf
    keypoints[0, 6, 2] = np.nan
    decoded = decode_people(encode_people(People(keypoints, np.array([1], np.int32)), Header()))
    assert np.isnan(decoded.keypoints[0, [4, 6]]).all()
    assert np.isfinite(decoded.keypoints[0, 5]).all()


def test_other_order_byte_order_and_padding_are_understood():
    original = people(2)
    message = encode_people(original, Header())
    foreign = np.dtype({
        'names': ['track_id', 'colour', 'score', 'v', 'u'],
        'formats': ['>i4', '>u2', '>f4', '>f4', '>f4'], 'offsets': [0, 4, 8, 12, 16],
        'itemsize': 24})
    points = np.zeros((2, 20), foreign)  # two points of padding a row
    for name in KEYPOINT_POINT.names:
        points[name][:, :18] = decode_cloud(message, KEYPOINT_POINT)[name]
    message.fields = [
        PointField(name=name, offset=foreign.fields[name][1], count=1, datatype=datatype)
        for name, datatype in (
            ('track_id', PointField.INT32), ('colour', PointField.UINT16),
            ('score', PointField.FLOAT32), ('v', PointField.FLOAT32),
            ('u', PointField.FLOAT32))]
    message.is_bigendian, message.point_step, message.row_step = True, 24, 480
    message.data = points.tobytes()
    decoded = decode_people(message)
    np.testing.assert_array_equal(decoded.keypoints, original.keypoints)
    np.testing.assert_array_equal(decoded.track_ids, original.track_ids)


@pytest.mark.parametrize(('broken', 'said'), [
    ({'fields': []}, "lacks the field 'u'"),
    ({'width': 17}, '17 points wide instead of 18'),
    ({'row_step': 100}, 'rows of 100'),
    ({'data': bytes(287)}, 'in 287 bytes'),
    ({'point_step': 8}, 'exceed'),
    ({'height': 3}, '18x3 points'),
])
def test_other_layouts_are_refused(broken, said):
    message = encode_people(people(1), Header())
    for name, value in broken.items():
        setattr(message, name, value)
    with pytest.raises(DepthPersonError, match=said):
        decode_people(message)


def test_a_field_of_another_type_is_refused():
    message = encode_people(people(1), Header())
    message.fields[3] = PointField(
        name='track_id', offset=12, datatype=PointField.FLOAT32, count=1)
    with pytest.raises(DepthPersonError, match="'track_id' of type int32"):
        decode_people(message)


def test_distances_are_packed_as_documented():
    distances = Distances(
        range=np.array([5.0, NAN]), range_sigma=np.array([0.25, NAN]),
        position=np.array([[3.0, 0.0, 4.0], [NAN] * 3]),
        reason=np.array([0, 2], np.uint8), cues=np.array([5, 0], np.uint8))
    crowd = people(2)
    crowd.keypoints[1, 3:] = np.nan
    measured = Distances(
        range=np.array([13.0, NAN]), range_sigma=np.array([0.5, NAN]),
        position=np.array([[12.0, 0.0, 5.0], [NAN] * 3]),
        reason=np.array([0, 2], np.uint8), cues=np.array([4, 0], np.uint8))
    tracked = replace(
        TrackedPeople.unfiltered(crowd, measured), distances=distances,
        velocity=np.array([[1.0, 2.0, -3.0], [NAN] * 3]), velocity_sigma=np.array([0.125, NAN]),
        time_to_contact=np.array([1.5, NAN]), time_to_contact_sigma=np.array([0.75, NAN]),
        predicted=np.array([True, False]))
    message = encode_distances(tracked, Header(frame_id='eye'))
    assert message.header.frame_id == 'eye'
    assert not message.is_dense
    first, second = struct.iter_unpack('<ffffffiffBBBx11f', bytes(message.data))
    neck = crowd.keypoints[:, 1]
    assert first == pytest.approx((
        3, 0, 4, 5, 0.25, crowd.keypoints[0, :, 2].mean(), 7, neck[0, 0], neck[0, 1], 0, 5,
        1, 1, 2, -3, 0.125, 1.5, 0.75, 13, 0.5, 12, 0, 5))
    assert second == pytest.approx((
        NAN, NAN, NAN, NAN, NAN, crowd.keypoints[1, :3, 2].mean(), 8, neck[1, 0], neck[1, 1],
        2, 0, 0, *[NAN] * 11), nan_ok=True)
    assert decode_cloud(message, PERSON_POINT)['range'][0, 0] == 5


def test_a_person_without_keypoints_scores_zero():
    nobody = People(np.full((1, 18, 3), np.nan, np.float32), np.array([1], np.int32))
    nowhere = Distances.none(1, Reason.NO_SHOULDERS)
    message = encode_distances(TrackedPeople.unfiltered(nobody, nowhere), Header())
    assert decode_cloud(message, PERSON_POINT)['score'][0, 0] == 0
