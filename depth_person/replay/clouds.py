"""Reads the points of PointCloud2 messages that come from bags."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

CLOUD = 'sensor_msgs/msg/PointCloud2'

#: The numbers of sensor_msgs/PointField's types.
_FORMATS = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}


def cloud_points(message: Any) -> NDArray[np.void]:
    """
    Return the points of a cloud by the names of its fields, (height, width) of them.

    Fields of several values are left out.

    :param message: sensor_msgs/PointCloud2 as rosbags gives it.
    :raises DepthPersonError: when the sizes that the cloud states contradict each other.
    """
    order = '>' if message.is_bigendian else '<'
    fields = [field for field in message.fields if field.count == 1]
    try:
        layout = np.dtype({
            'names': [field.name for field in fields],
            'formats': [order + _FORMATS[field.datatype] for field in fields],
            'offsets': [field.offset for field in fields], 'itemsize': message.point_step})
        return np.ndarray(
            (message.height, message.width), layout, np.ascontiguousarray(message.data),
            strides=(message.row_step, message.point_step))
    except (KeyError, TypeError, ValueError) as error:
        raise DepthPersonError(
            f'a cloud of {message.width}x{message.height} points of {message.point_step} bytes '
            f'cannot be read: {error}') from error


def column(points: NDArray[np.void], name: str, *, missing: float = np.nan) -> NDArray:
    """Return a field of each point; the same number for all where the cloud has no such field."""
    if name in (points.dtype.names or ()):
        return points[name]
    return np.full(points.shape, missing)
