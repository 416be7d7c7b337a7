"""People and their distances as sensor_msgs/PointCloud2."""
from __future__ import annotations

from functools import cache
import sys

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import byte_array
from depth_person.pose.people import People
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

#: One point of /person_keypoints.
KEYPOINT_POINT = np.dtype([('u', '<f4'), ('v', '<f4'), ('score', '<f4'), ('track_id', '<i4')])

#: One point of /person_depth/people.
PERSON_POINT = np.dtype({
    'names': ['x', 'y', 'z', 'range', 'range_sigma', 'score', 'track_id', 'u', 'v', 'reason',
              'cues', 'predicted', 'velocity_x', 'velocity_y', 'velocity_z', 'velocity_sigma',
              'time_to_contact', 'time_to_contact_sigma', 'range_measured',
              'range_sigma_measured', 'x_measured', 'y_measured', 'z_measured'],
    'formats': ['<f4'] * 6 + ['<i4', '<f4', '<f4', 'u1', 'u1', 'u1'] + ['<f4'] * 11,
    'offsets': [*range(0, 36, 4), 36, 37, 38, *range(40, 84, 4)],
    'itemsize': 84,
})

_DATATYPES = {
    'i1': PointField.INT8, 'u1': PointField.UINT8, 'i2': PointField.INT16,
    'u2': PointField.UINT16, 'i4': PointField.INT32, 'u4': PointField.UINT32,
    'f4': PointField.FLOAT32, 'f8': PointField.FLOAT64,
}
_FORMATS = {datatype: name for name, datatype in _DATATYPES.items()}


def encode_people(people: People, header: Header) -> PointCloud2:
    """Return the keypoints of people as the organised cloud of /person_keypoints."""
    points = np.empty((len(people), N_KEYPOINTS), KEYPOINT_POINT)
    for column, name in enumerate(('u', 'v', 'score')):
        points[name] = people.keypoints[..., column]
    points['track_id'] = people.track_ids[:, None]
    return _cloud(points, header, is_dense=False)


def decode_people(message: PointCloud2, *, convention: str = 'coco') -> People:
    """
    Return the people of a /person_keypoints cloud.

    The cloud does not say whether the network marked the neck itself. A neck at exactly the
    shoulders' midpoint is one that was derived from them.

    :param convention: of the network, which the cloud does not say either.
    :raises DepthPersonError: when the cloud has another layout.
    """
    points = decode_cloud(message, KEYPOINT_POINT)
    if points.shape[1] != N_KEYPOINTS:
        raise DepthPersonError(
            f'a keypoint cloud is {points.shape[1]} points wide instead of {N_KEYPOINTS}; '
            'check which node publishes it')
    keypoints = np.stack([points['u'], points['v'], points['score']], axis=-1)
    keypoints[~np.isfinite(keypoints).all(axis=-1)] = np.nan
    track_ids = np.ascontiguousarray(points['track_id'][:, 0])
    midpoint = (keypoints[:, Keypoint.R_SHOULDER] + keypoints[:, Keypoint.L_SHOULDER]) / 2
    neck = keypoints[:, Keypoint.NECK]
    measured = np.isfinite(neck[:, 0]) & (neck != midpoint)[:, :2].any(axis=1)
    return People(
        keypoints, track_ids, neck_measured=bool(measured.any()), convention=convention)


def person_scores(people: People) -> NDArray[np.float32]:
    """Return the mean score of each person's keypoints, 0 for a person without any."""
    scores = people.keypoints[..., 2]
    found = np.isfinite(scores)
    return np.where(found, scores, 0).sum(axis=1) / np.maximum(found.sum(axis=1), 1)


def encode_distances(tracked: TrackedPeople, header: Header) -> PointCloud2:
    """Return one point a person: /person_depth/people."""
    people, distances, measured = tracked.people, tracked.distances, tracked.measured
    points = np.zeros((1, len(tracked)), PERSON_POINT)
    row = points[0]
    row['x'], row['y'], row['z'] = distances.position.T
    row['range'] = distances.range
    row['range_sigma'] = distances.range_sigma
    row['score'] = person_scores(people)
    row['track_id'] = people.track_ids
    row['u'], row['v'] = people.keypoints[:, Keypoint.NECK, :2].T
    row['reason'] = distances.reason
    row['cues'] = distances.cues
    row['predicted'] = tracked.predicted
    row['velocity_x'], row['velocity_y'], row['velocity_z'] = tracked.velocity.T
    row['velocity_sigma'] = tracked.velocity_sigma
    row['time_to_contact'] = tracked.time_to_contact
    row['time_to_contact_sigma'] = tracked.time_to_contact_sigma
    row['range_measured'], row['range_sigma_measured'] = measured.range, measured.range_sigma
    row['x_measured'], row['y_measured'], row['z_measured'] = measured.position.T
    return _cloud(points, header, is_dense=bool(distances.known.all()))


def decode_cloud(message: PointCloud2, layout: np.dtype) -> NDArray[np.void]:
    """
    Return the points of a cloud that holds at least the fields of a layout.

    :returns: (height, width) structured array with the fields of the cloud; a view of its data
        where the byte order allows.
    :raises DepthPersonError: when a field is missing or of another type, or sizes disagree.
    """
    order = '>' if message.is_bigendian else '<'
    fields = {field.name: field for field in message.fields}
    for name in layout.names or ():
        expected = _DATATYPES[layout[name].str[1:]]
        if name not in fields or fields[name].datatype != expected or fields[name].count != 1:
            raise DepthPersonError(
                f'a point cloud lacks the field {name!r} of type {layout[name].name}, and has '
                f'{", ".join(fields) or "none"}; check which node publishes it')
    size = message.height * message.row_step
    if message.row_step < message.width * message.point_step or len(message.data) < size:
        raise DepthPersonError(
            f'a point cloud of {message.width}x{message.height} points of '
            f'{message.point_step} bytes comes in {len(message.data)} bytes, rows of '
            f'{message.row_step}; check which node publishes it')
    try:
        points = np.dtype({
            'names': list(layout.names or ()),
            'formats': [order + _FORMATS[fields[name].datatype] for name in layout.names or ()],
            'offsets': [fields[name].offset for name in layout.names or ()],
            'itemsize': message.point_step})
    except ValueError as error:
        raise DepthPersonError(
            f'the fields of a point cloud exceed its points of {message.point_step} bytes; '
            'check which node publishes it') from error
    return np.ndarray(
        (message.height, message.width), points, np.frombuffer(message.data, np.uint8),
        strides=(message.row_step, message.point_step))


def _cloud(points: NDArray[np.void], header: Header, *, is_dense: bool) -> PointCloud2:
    """Return a two-dimensional structured array as a cloud."""
    height, width = points.shape
    size = points.dtype.itemsize
    return PointCloud2(
        header=header, height=height, width=width, fields=[*_fields(points.dtype)],
        is_bigendian=sys.byteorder == 'big', point_step=size, row_step=width * size,
        data=byte_array(points), is_dense=is_dense)


@cache
def _fields(layout: np.dtype) -> list[PointField]:
    """Return what a cloud says of its points; all of a layout share it."""
    return [
        PointField(name=name, offset=offset, datatype=_DATATYPES[kind.str[1:]], count=1)
        for name, (kind, offset, *_) in (layout.fields or {}).items()]
