"""Messages for bags made in tests."""
from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from depth_person.replay.bags import jazzy_types

K = (300.0, 0.0, 31.5, 0.0, 300.0, 23.5, 0.0, 0.0, 1.0)


def new(msgtype: str, **fields: Any) -> Any:
    return jazzy_types().types[msgtype](**fields)


def header(stamp_ns: int, frame_id: str = 'bag_optical_frame') -> Any:
    stamp = new('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return new('std_msgs/msg/Header', stamp=stamp, frame_id=frame_id)


def string(text: str) -> Any:
    return new('std_msgs/msg/String', data=text)


def picture(value: int, *, width: int = 64, height: int = 48) -> np.ndarray:
    """Return an image whose grey tells its number."""
    return np.full((height, width, 3), value, np.uint8)


def image(stamp_ns: int, bgr: np.ndarray, *, encoding: str = 'bgr8',
          frame_id: str = 'bag_optical_frame') -> Any:
    height, width = bgr.shape[:2]
    return new(
        'sensor_msgs/msg/Image', header=header(stamp_ns, frame_id), height=height, width=width,
        encoding=encoding, is_bigendian=0, step=3 * width, data=bgr.ravel())


def compressed(stamp_ns: int, bgr: np.ndarray) -> Any:
    _, data = cv2.imencode('.jpg', bgr)
    return new('sensor_msgs/msg/CompressedImage', header=header(stamp_ns), format='jpeg',
               data=data.ravel())


def camera_info(stamp_ns: int, *, width: int = 64, height: int = 48,
                k: tuple[float, ...] = K) -> Any:
    return new(
        'sensor_msgs/msg/CameraInfo', header=header(stamp_ns), width=width, height=height,
        distortion_model='plumb_bob', d=np.zeros(5), k=np.array(k), r=np.eye(3).ravel(),
        p=np.eye(3, 4).ravel(), binning_x=0, binning_y=0,
        roi=new('sensor_msgs/msg/RegionOfInterest', x_offset=0, y_offset=0, height=0, width=0,
                do_rectify=False))
