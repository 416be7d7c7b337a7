"""Messages of a vehicle as ROS gives them, without ROS."""
import math
from types import SimpleNamespace as Fields

NOW = 1_700_000_000 * 10**9


def header(seconds, frame_id=''):
    stamp_ns = NOW + round(seconds * 1e9)
    return Fields(
        stamp=Fields(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9), frame_id=frame_id)


def quaternion(*, roll=0.0, pitch=0.0, yaw=0.0):
    """Return the orientation of a body (x forward, y left, z up) by angles in degrees."""
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(math.radians(angle) / 2), math.cos(math.radians(angle) / 2))
        for angle in (roll, pitch, yaw))
    return Fields(
        x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
        z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy)


def imu(seconds, *, orientation=None, **angles):
    return Fields(
        header=header(seconds), orientation=orientation or quaternion(**angles),
        orientation_covariance=[0.0] * 9)


def pose(seconds, *, x=0.0, y=0.0, z=0.0, **angles):
    return Fields(header=header(seconds), pose=Fields(
        position=Fields(x=x, y=y, z=z), orientation=quaternion(**angles)))


def odometry(seconds, **where):
    stamped = pose(seconds, **where)
    return Fields(header=stamped.header, pose=Fields(pose=stamped.pose))


def rangefinder(seconds, distance):
    return Fields(header=header(seconds), range=distance, min_range=0.2, max_range=40.0)


def transform(seconds, parent, child, *, x=0.0, y=0.0, z=0.0, rotation=None, **angles):
    return Fields(
        header=header(seconds, parent), child_frame_id=child, transform=Fields(
            translation=Fields(x=x, y=y, z=z), rotation=rotation or quaternion(**angles)))
