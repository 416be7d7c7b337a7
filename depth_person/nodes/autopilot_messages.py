"""What autopilots and followers take: scan, nearest person and target as messages."""
from __future__ import annotations

from array import array
from functools import lru_cache
import math

from geometry_msgs.msg import PoseWithCovarianceStamped
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import LaserScan, Range
from std_msgs.msg import Header

from depth_person.autopilot.choice import Target
from depth_person.autopilot.scan import ScanOptions, sent, STEP
from depth_person.camera.intrinsics import Intrinsics

#: Variance of an angle of which nothing is known: uniform over a full turn.
_ANY_ANGLE = (2 * math.pi) ** 2 / 12
_ANY_ORIENTATION = np.diag([0.0] * 3 + [_ANY_ANGLE] * 3)


def encode_scan(
    ranges: NDArray[np.float32], image_header: Header, *, frame_id: str, options: ScanOptions,
) -> LaserScan:
    """Return the distances (72,) of all bins with the stamp of the image they come from."""
    return LaserScan(
        header=Header(stamp=image_header.stamp, frame_id=frame_id), angle_min=0.0,
        angle_max=STEP * (len(ranges) - 1), angle_increment=STEP,
        range_min=sent(options.range_min), range_max=sent(options.range_max),
        ranges=array('f', ranges.tobytes()))


def encode_nearest(
    image_header: Header, *, distance: float, sigma: float, max_range: float,
    intrinsics: Intrinsics,
) -> Range:
    """Return the range to a person, who may be anywhere in the camera's view."""
    return Range(
        header=image_header, radiation_type=Range.INFRARED,
        field_of_view=_field_of_view(intrinsics), min_range=0.0, max_range=max_range,
        range=distance, variance=sigma ** 2)


@lru_cache(maxsize=16)
def _field_of_view(intrinsics: Intrinsics) -> float:
    """Return the angle from edge to edge, half a turn where there is no ray at the edges."""
    middle = (intrinsics.height - 1) / 2
    edges = intrinsics.undistort([(0.0, middle), (intrinsics.width - 1.0, middle)])
    left, right = np.arctan(edges[:, 0])
    return float(right - left) if np.isfinite(right - left) else math.pi


def encode_target(
    target: Target, image_header: Header, *, frame_id: str,
) -> PoseWithCovarianceStamped:
    """Return a person's position in the vehicle's frame; which way they face is not known."""
    message = PoseWithCovarianceStamped(
        header=Header(stamp=image_header.stamp, frame_id=frame_id))
    pose = message.pose.pose
    pose.position.x, pose.position.y, pose.position.z = target.position.tolist()
    pose.orientation.w = 1.0
    covariance = _ANY_ORIENTATION.copy()
    covariance[:3, :3] = target.covariance
    message.pose.covariance = covariance.ravel()
    return message
