"""The parameters of camera_node."""
from __future__ import annotations

from dataclasses import dataclass
import re

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.calibration import load_camera_info
from depth_person.camera.deblur import motion_kernel
from depth_person.camera.devices import DeviceOptions
from depth_person.camera.optics import Optics
from depth_person.errors import DepthPersonError
from depth_person.settings.node import NodeSettings
from depth_person.settings.parameter import parameter


@dataclass(frozen=True)
class CameraSettings(NodeSettings):
    """
    The parameters of camera_node.

    :raises DepthPersonError: when values do not go together.
    """

    source: str = parameter(
        '', 'Where frames come from: a video file, a folder of images, a device such as '
        '/dev/video0, a stream URL (rtsp://, udp://) or SDP file, a GStreamer pipeline '
        '(`... ! appsink`), a bag, or a test pattern (test://1280x720@30).')
    camera_info_url: str = parameter(
        '', 'Calibration file in the YAML of camera_calibration: a path, file:// or package://; '
        'or preset://CAMERA/WIDTHxHEIGHT. Comes before horizontal_fov and what a bag says.')
    rescale_calibration: bool = parameter(
        False, 'Scale a calibration of another resolution to the images; right only where both '
        'show the same field of view.')
    horizontal_fov: float = parameter(
        0.0, 'Horizontal field of view in degrees, for a camera that was never calibrated; '
        '0 where it is not known.', minimum=0.0, maximum=179.0)
    fps: float = parameter(
        0.0, "Frames a second of a file, folder or test pattern, or asked of a camera; 0 for "
        "the source's own.", minimum=0.0, maximum=1000.0)
    loop: bool = parameter(False, 'Start a file, folder or bag again when it ends.')
    frame_id: str = parameter(
        'camera_optical_frame',
        'Name of the optical frame (z forward, x right, y down); bags keep their own.')
    image_topic: str = parameter(
        '', 'Image topic of a bag that has several; empty for the only one.')
    timeout: float = parameter(
        2.0, 'A device or stream that sends no frame for so many seconds is opened again.',
        minimum=0.1, maximum=60.0)
    time_offset: float = parameter(
        0.0, 'Added to every stamp, seconds: minus the delay of a camera or stream that was '
        'measured.', minimum=-10.0, maximum=10.0, read_only=False)
    rtsp_transport: str = parameter(
        'tcp', 'What RTSP streams are sent over: `udp` loses packets where `tcp` waits for them.',
        choices=('tcp', 'udp'))
    size: str = parameter(
        '', 'Asked of a V4L2 camera, WIDTHxHEIGHT; empty leaves it as it is.')
    pixel_format: str = parameter(
        '', 'Asked of a V4L2 camera, such as MJPG or YUYV; empty leaves it as it is.')
    exposure: float = parameter(
        0.0, 'Asked of a V4L2 camera, milliseconds; -1 for automatic, 0 leaves it as it is.',
        minimum=-1.0, maximum=10000.0)
    gain: float = parameter(
        -1.0, "Asked of a V4L2 camera, in its driver's units; -1 leaves it as it is.",
        minimum=-1.0, maximum=100000.0)
    image_width: int = parameter(
        0, 'Images that are wider are scaled down to it, and their intrinsics with them, pixels; '
        '0 for none.', minimum=0, maximum=16384)
    motion_blur: float = parameter(
        0.0, 'Length of a known motion blur that is undone by a Wiener filter, pixels; 0 for '
        'none. A wrong length or angle does more harm than the blur.', minimum=0.0,
        maximum=100.0)
    motion_blur_angle: float = parameter(
        0.0, 'Direction of that motion, degrees clockwise from the right.', minimum=-180.0,
        maximum=180.0)
    publish_clock: bool = parameter(
        False, 'Publish /clock from the stamps of a file, folder or bag, for nodes that run '
        'with use_sim_time.')
    wait_for_subscribers: bool = parameter(
        False, 'Send the first frame only when someone subscribes, and for two seconds nobody '
        'else has come: so that no subscriber misses the beginning of a recording.')
    jpeg_quality: int = parameter(
        90, 'Quality of image_raw/compressed.', minimum=1, maximum=100, read_only=False)

    def __post_init__(self) -> None:
        self.blur_kernel()
        self.device_options()

    def device_options(self) -> DeviceOptions:
        """Return what a V4L2 camera is asked for."""
        return DeviceOptions(
            size=parse_size(self.size) if self.size else None,
            pixel_format=self.pixel_format or None, fps=self.fps or None,
            exposure_ms=max(self.exposure, 0.0) if self.exposure else None,
            gain=self.gain if self.gain >= 0 else None)

    def optics(self) -> Optics:
        """Return what is known of the lens, its calibration file read."""
        calibration = None
        if self.camera_info_url:
            _, calibration = load_camera_info(self.camera_info_url)
        return Optics(
            calibration=calibration, horizontal_fov=self.horizontal_fov or None,
            width=self.image_width or None, rescale=self.rescale_calibration)

    def blur_kernel(self) -> NDArray[np.float64] | None:
        """Return the kernel of the motion blur to undo; None for none."""
        if not self.motion_blur:
            return None
        return motion_kernel(self.motion_blur, self.motion_blur_angle)


def parse_size(text: str) -> tuple[int, int]:
    """
    Return the width and height in WIDTHxHEIGHT.

    :raises DepthPersonError: when it is written otherwise.
    """
    match = re.fullmatch(r'(\d{1,5})x(\d{1,5})', text.strip())
    if match is None:
        raise DepthPersonError(f'size = {text!r} is not WIDTHxHEIGHT, such as 1280x720')
    return int(match[1]), int(match[2])
