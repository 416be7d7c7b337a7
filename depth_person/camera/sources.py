"""Opens whatever frames can come from."""
from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import time
from urllib.parse import unquote, urlsplit

from depth_person.camera.bag_open import is_bag
from depth_person.camera.bag_source import BagSource
from depth_person.camera.folder import ImageFolder
from depth_person.camera.live import open_device, open_stream
from depth_person.camera.source import mask_password, Source, SourceLost
from depth_person.camera.video import VideoFile
from depth_person.errors import DepthPersonError

__all__ = ['Source', 'SourceLost', 'open_source']

STREAM_SCHEMES = ('rtsp', 'rtsps', 'rtmp', 'rtp', 'udp', 'tcp', 'srt', 'http', 'https')
#: What a web server sends of these names is a file, at its own pace.
VIDEO_SUFFIXES = ('.mp4', '.m4v', '.mov', '.avi', '.mkv', '.webm')


def open_source(
    spec: str, *, frame_id: str = 'camera_optical_frame', fps: float | None = None,
    loop: bool = False, image_topic: str | None = None,
    clock: Callable[[], int] = time.time_ns, timeout_s: float = 2.0,
) -> Source:
    """
    Open a source of frames.

    :param spec: a video file, a folder of images, a rosbag (folder, .mcap, .db3), a V4L2 device
        (/dev/video0 or its number), a stream URL (rtsp, udp, rtp, http, ...) or an SDP file.
    :param frame_id: the camera's optical frame; bags bring their own.
    :param fps: frames a second: of a file or folder instead of its own (30 for folders), of a
        device as a wish; streams and bags come as they are.
    :param loop: start files, folders and bags over at their end.
    :param image_topic: of a bag with several.
    :param clock: gives the stamps, nanoseconds; bags have theirs.
    :param timeout_s: a live source that sends no frame for so long is lost.
    :raises DepthPersonError: when there is nothing to read frames from.
    """
    if fps is not None and not 0 < fps <= 1000:
        raise DepthPersonError(f'{fps:g} frames a second are not between 0 and 1000')
    spec = spec.strip()
    if '://' in spec and not spec.startswith('file://'):
        return _open_url(spec, frame_id=frame_id, clock=clock, fps=fps, loop=loop,
                         timeout_s=timeout_s)
    path = _to_path(spec)
    if _is_device(path):
        return open_device(str(path), frame_id=frame_id, clock=clock, fps=fps, timeout_s=timeout_s)
    _check_readable(path, spec)
    if path.suffix == '.sdp':
        return open_stream(str(path), frame_id=frame_id, clock=clock, timeout_s=timeout_s)
    if is_bag(path):
        return BagSource(path, frame_id=frame_id, image_topic=image_topic, loop=loop)
    if path.is_dir():
        return ImageFolder(path, frame_id=frame_id, clock=clock, fps=fps, loop=loop)
    return VideoFile(str(path), frame_id=frame_id, clock=clock, fps=fps, loop=loop)


def _to_path(spec: str) -> Path:
    """Return the path of a file, folder or device."""
    if spec.startswith('file://'):
        return Path(unquote(urlsplit(spec).path))
    return Path(f'/dev/video{spec}' if spec.isdecimal() else spec).expanduser()


def _is_device(path: Path) -> bool:
    """Return whether the path is a device, or would be if it were plugged in."""
    if os.path.exists(path):
        return path.is_char_device()
    return path.is_relative_to('/dev')


def _check_readable(path: Path, spec: str) -> None:
    if not spec or not os.path.exists(path):
        raise DepthPersonError(
            f'source {spec!r} does not exist; give a video file, a folder of images, a rosbag, a '
            'device such as /dev/video0, or a URL such as rtsp://HOST/PATH')
    if not os.access(path, os.R_OK):
        raise DepthPersonError(f'no permission to read {path}')


def _open_url(
    url: str, *, frame_id: str, clock: Callable[[], int], fps: float | None,
    loop: bool, timeout_s: float,
) -> Source:
    scheme = url.partition('://')[0].lower()
    if scheme not in STREAM_SCHEMES:
        raise DepthPersonError(
            f'{mask_password(url)} cannot be opened; known are {", ".join(STREAM_SCHEMES)}')
    if scheme.startswith('http') and urlsplit(url).path.lower().endswith(VIDEO_SUFFIXES):
        return VideoFile(url, frame_id=frame_id, clock=clock, fps=fps, loop=loop)
    return open_stream(url, frame_id=frame_id, clock=clock, timeout_s=timeout_s)
