"""V4L2 cameras: what is asked of them, and why one cannot be had."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import errno
import fcntl
import logging
import math
import os
from pathlib import Path
import re
import struct

import cv2

from depth_person.camera.live import LiveSource, OPEN_TIMEOUT_S
from depth_person.camera.opencv import Capture, open_capture, open_within
from depth_person.camera.source import SourceUnusable
from depth_person.camera.stamps import BufferStamps
from depth_person.errors import DepthPersonError

LOG = logging.getLogger(__name__)
_CLASS = Path('/sys/class/video4linux')

# Of linux/videodev2.h: struct v4l2_capability is 104 bytes, device_caps its last but three words.
_VIDIOC_QUERYCAP = 0x80685600
_CAPABILITY_BYTES = 104
_DEVICE_CAPS_OFFSET = 88
_CAN_CAPTURE = 0x00000001 | 0x00001000  # single- and multi-planar
_EXPOSURE_MANUAL, _EXPOSURE_AUTOMATIC = 1, 3
#: V4L2_CID_EXPOSURE_ABSOLUTE counts in steps of 0.1 ms.
_EXPOSURE_STEPS_PER_MS = 10


@dataclass(frozen=True)
class DeviceOptions:
    """
    What a V4L2 camera is asked for; a field that is None leaves the camera as it is set.

    :ivar size: width and height, pixels.
    :ivar pixel_format: four letters, such as MJPG or YUYV.
    :ivar fps: frames a second.
    :ivar exposure_ms: time that a frame is exposed; 0 for automatic.
    :ivar gain: in the driver's own units.
    :raises DepthPersonError: for a format that has not four letters, or a size that is none.
    """

    size: tuple[int, int] | None = None
    pixel_format: str | None = None
    fps: float | None = None
    exposure_ms: float | None = None
    gain: float | None = None

    def __post_init__(self) -> None:
        if self.pixel_format is not None and not re.fullmatch('[ -~]{4}', self.pixel_format):
            raise DepthPersonError(
                f'pixel format {self.pixel_format!r} has not four letters; common are MJPG, YUYV')
        if self.size is not None and min(self.size) <= 0:
            raise DepthPersonError(f'a size of {self.size[0]}x{self.size[1]} px is none')


def open_device(
    device: str, *, options: DeviceOptions, frame_id: str, clock: Callable[[], int],
    timeout_s: float,
) -> LiveSource:
    """
    Open a V4L2 camera.

    :param device: such as /dev/video0.
    :raises DepthPersonError: listing the devices that there are; SourceUnusable where waiting
        does not help.
    """
    _check_camera(device)
    # OpenCV waits ten seconds for a frame unless told otherwise before its first one.
    os.environ.setdefault('OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT', str(math.ceil(timeout_s)))
    capture = open_within(OPEN_TIMEOUT_S, lambda: open_capture(device, cv2.CAP_V4L2))
    if capture is None:
        raise DepthPersonError(f'{device} has not opened within {OPEN_TIMEOUT_S:g} s; plug it in '
                               'again, or reset the USB port')
    if not capture.isOpened():
        raise DepthPersonError(
            f'{device} is busy: another program has it (`fuser -v {device}` says which); '
            f'{_list_devices()}')
    # With one buffer a camera has to skip the frame that comes while another is decoded; more
    # than two would only grow old where decoding is slower than the camera.
    capture.set(cv2.CAP_PROP_BUFFERSIZE, 2)
    refused = _ask(capture, options)
    if refused:
        LOG.warning('%s does not take %s; `v4l2-ctl -d %s --all --list-formats-ext` shows what '
                    'it takes', device, '; '.join(refused), device)
    return LiveSource(capture, description=f'camera {device}', frame_id=frame_id, clock=clock,
                      timeout_s=timeout_s, stamps=BufferStamps())


def _check_camera(device: str) -> None:
    """Raise what keeps a device from being opened as a camera."""
    if not os.path.exists(device):
        raise DepthPersonError(f'there is no camera {device}; {_list_devices()}')
    try:
        capabilities = _query_capabilities(device)
    except PermissionError as error:
        raise SourceUnusable(
            f'no permission to use {device}; add your user to the group video and log in again'
        ) from error
    except OSError as error:
        if error.errno in (errno.ENOTTY, errno.EINVAL):
            raise SourceUnusable(f'{device} is no camera; {_list_devices()}') from error
        raise DepthPersonError(f'{device} cannot be opened: {error.strerror}') from error
    if not capabilities & _CAN_CAPTURE:
        raise SourceUnusable(
            f'{device} gives no images, but what else its driver has; {_list_devices()}')


def _query_capabilities(device: str) -> int:
    """
    Return the device_caps of a V4L2 device (ioctl VIDIOC_QUERYCAP).

    :raises OSError: as the kernel says.
    """
    answer = bytearray(_CAPABILITY_BYTES)
    descriptor = os.open(device, os.O_RDWR | os.O_NONBLOCK)
    try:
        fcntl.ioctl(descriptor, _VIDIOC_QUERYCAP, answer)
    finally:
        os.close(descriptor)
    return int(struct.unpack_from('=I', answer, _DEVICE_CAPS_OFFSET)[0])


def _ask(capture: Capture, options: DeviceOptions) -> list[str]:
    """Ask a camera for all that is wanted; return in words what it has not taken."""
    wishes: list[tuple[str, int, float]] = []
    if options.pixel_format:  # first, since sizes and rates depend on it
        code, = struct.unpack('<I', options.pixel_format.encode())
        wishes.append((f'format {options.pixel_format}', cv2.CAP_PROP_FOURCC, code))
    if options.size:
        wishes += [(f'width {options.size[0]}', cv2.CAP_PROP_FRAME_WIDTH, options.size[0]),
                   (f'height {options.size[1]}', cv2.CAP_PROP_FRAME_HEIGHT, options.size[1])]
    if options.fps:
        wishes.append((f'{options.fps:g} frames a second', cv2.CAP_PROP_FPS, options.fps))
    if options.exposure_ms is not None:
        mode = _EXPOSURE_MANUAL if options.exposure_ms else _EXPOSURE_AUTOMATIC
        name = 'manual' if options.exposure_ms else 'automatic'
        wishes.append((f'{name} exposure', cv2.CAP_PROP_AUTO_EXPOSURE, mode))
    if options.exposure_ms:
        steps = max(round(options.exposure_ms * _EXPOSURE_STEPS_PER_MS), 1)
        wishes.append((f'exposure {options.exposure_ms:g} ms', cv2.CAP_PROP_EXPOSURE, steps))
    if options.gain is not None:
        wishes.append((f'gain {options.gain:g}', cv2.CAP_PROP_GAIN, options.gain))
    for _, prop, value in wishes:
        capture.set(prop, value)
    # Once all are set: OpenCV changes the width only with the height.
    return [_refusal(capture, name, prop, value) for name, prop, value in wishes
            if abs(capture.get(prop) - value) >= 1.0]


def _refusal(capture: Capture, name: str, prop: int, value: float) -> str:
    got = capture.get(prop)
    if prop == cv2.CAP_PROP_FOURCC:
        return f'{name} (gives {struct.pack("<I", int(got)).decode("ascii", "replace")})'
    return f'{name} (has {got:g} for {value:g})'


def _list_devices() -> str:
    """Return a sentence on the V4L2 devices of this machine."""
    devices = [
        f'/dev/{entry.name} ({(entry / "name").read_text().strip()})'
        for entry in sorted(_CLASS.glob('video*')) if (entry / 'name').is_file()]
    if not devices:
        return 'no /dev/video* exists: plug a camera in, or pass one through to this container'
    return f'there are {", ".join(devices)}'
