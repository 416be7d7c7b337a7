"""The parameters of camera_node."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.deblur import motion_kernel
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
        '/dev/video0, a stream URL (rtsp://, udp://), or a bag.')
    camera_info_url: str = parameter(
        '', 'Calibration file in the YAML of camera_calibration: a path, file:// or package://. '
        'Comes before horizontal_fov and before what a bag says.')
    horizontal_fov: float = parameter(
        0.0, 'Horizontal field of view in degrees, for a camera that was never calibrated; '
        '0 where it is not known.', minimum=0.0, maximum=179.0)
    fps: float = parameter(
        0.0, "Frames a second of a folder, or asked of a camera; 0 for the source's own.",
        minimum=0.0, maximum=1000.0)
    loop: bool = parameter(False, 'Start a file, folder or bag again when it ends.')
    frame_id: str = parameter(
        'camera_optical_frame',
        'Name of the optical frame (z forward, x right, y down); bags keep their own.')
    image_topic: str = parameter(
        '', 'Image topic of a bag that has several; empty for the only one.')
    timeout: float = parameter(
        2.0, 'A device or stream that sends no frame for so many seconds is opened again.',
        minimum=0.1, maximum=60.0)
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

    def blur_kernel(self) -> NDArray[np.float64] | None:
        """Return the kernel of the motion blur to undo; None for none."""
        if not self.motion_blur:
            return None
        return motion_kernel(self.motion_blur, self.motion_blur_angle)
