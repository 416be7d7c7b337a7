"""Opens whatever frames can come from."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import auto, Enum
import os
from pathlib import Path
import re
import time
from urllib.parse import unquote, urlsplit

from depth_person.camera.bag_open import is_bag
from depth_person.camera.bag_source import BagSource
from depth_person.camera.devices import DeviceOptions, open_device
from depth_person.camera.folder import ImageFolder
from depth_person.camera.pattern import DEFAULT_FPS, DEFAULT_SIZE, PatternSource
from depth_person.camera.source import mask_password, Source, SourceLost, SourceUnusable
from depth_person.camera.streams import open_pipeline, open_stream
from depth_person.camera.video import VideoFile
from depth_person.errors import DepthPersonError

__all__ = ['Source', 'SourceLost', 'SourceUnusable', 'is_live', 'open_source']

STREAM_SCHEMES = ('rtsp', 'rtsps', 'rtmp', 'rtp', 'udp', 'tcp', 'srt', 'http', 'https')
PATTERN_SCHEME = 'test'
#: What a web server sends of these names is a file, at its own pace.
VIDEO_SUFFIXES = ('.mp4', '.m4v', '.mov', '.avi', '.mkv', '.webm')


class Kind(Enum):
    """What a source is by its name alone, whether or not it is there."""

    PATTERN = auto()
    PIPELINE = auto()
    STREAM = auto()
    WEB_VIDEO = auto()
    DEVICE = auto()
    PATH = auto()


def is_live(spec: str) -> bool:
    """Return whether a source sets the pace, and may still come when it is not there."""
    return _kind(spec.strip()) in (Kind.PATTERN, Kind.PIPELINE, Kind.STREAM, Kind.DEVICE)


def open_source(
    spec: str, *, frame_id: str = 'camera_optical_frame', fps: float | None = None,
    loop: bool = False, image_topic: str | None = None,
    clock: Callable[[], int] = time.time_ns, timeout_s: float = 2.0,
    device: DeviceOptions | None = None, rtsp_transport: str = 'tcp',
) -> Source:
    """
    Open a source of frames.

    :param spec: a video file, a folder of images, a rosbag (folder, .mcap, .db3), a V4L2 device
        (/dev/video0 or its number), a stream URL (rtsp, udp, rtp, http, ...), an SDP file, a
        GStreamer pipeline (... ! appsink), or test://WIDTHxHEIGHT@FPS for a test pattern.
    :param frame_id: the camera's optical frame; bags bring their own.
    :param fps: frames a second: of a file, folder or test pattern instead of its own (30), of a
        device as a wish; streams and bags come as they are.
    :param loop: start files, folders and bags over at their end.
    :param image_topic: of a bag with several.
    :param clock: gives the stamps, nanoseconds; bags have theirs.
    :param timeout_s: a live source that sends no frame for so long is lost.
    :param device: what a V4L2 device is asked for beside fps.
    :param rtsp_transport: tcp or udp.
    :raises DepthPersonError: when there is nothing to read frames from.
    """
    if fps is not None and not 0 < fps <= 1000:
        raise DepthPersonError(f'{fps:g} frames a second are not between 0 and 1000')
    spec = spec.strip()
    kind = _kind(spec)
    if kind is Kind.PATTERN:
        return _open_pattern(spec, fps=fps, frame_id=frame_id, clock=clock)
    if kind is Kind.PIPELINE:
        return open_pipeline(spec, frame_id=frame_id, clock=clock, timeout_s=timeout_s)
    if kind is Kind.DEVICE:
        options = replace(device or DeviceOptions(), fps=fps)
        return open_device(str(_to_path(spec)), options=options, frame_id=frame_id, clock=clock,
                           timeout_s=timeout_s)
    if kind is Kind.STREAM:
        url = spec if '://' in spec else str(_readable(spec))
        return open_stream(url, transport=rtsp_transport, frame_id=frame_id, clock=clock,
                           timeout_s=timeout_s)
    if kind is Kind.WEB_VIDEO:
        return VideoFile(spec, frame_id=frame_id, clock=clock, fps=fps, loop=loop)
    path = _readable(spec)
    if is_bag(path):
        return BagSource(path, frame_id=frame_id, image_topic=image_topic, loop=loop)
    if path.is_dir():
        return ImageFolder(path, frame_id=frame_id, clock=clock, fps=fps, loop=loop)
    return VideoFile(str(path), frame_id=frame_id, clock=clock, fps=fps, loop=loop)


def _kind(spec: str) -> Kind:
    """Return the kind of a source; PATH also for what is none."""
    scheme, separator, rest = spec.partition('://')
    scheme = scheme.lower() if separator else ''
    if scheme == PATTERN_SCHEME:
        return Kind.PATTERN
    if ' ! ' in spec and not os.path.exists(spec):
        return Kind.PIPELINE
    if scheme in STREAM_SCHEMES:
        file = re.split('[?#]', rest)[0].lower().endswith(VIDEO_SUFFIXES)
        return Kind.WEB_VIDEO if file and scheme.startswith('http') else Kind.STREAM
    path = _to_path(spec)
    if _is_device(path):
        return Kind.DEVICE
    return Kind.STREAM if path.suffix == '.sdp' else Kind.PATH


def _open_pattern(
    spec: str, *, fps: float | None, frame_id: str, clock: Callable[[], int],
) -> PatternSource:
    match = re.fullmatch(r'\w+://(?:(\d+)x(\d+))?(?:@(\d+(?:\.\d+)?))?', spec)
    rate = fps or float(match[3] or DEFAULT_FPS) if match else 0.0
    if match is None or not 0 < rate <= 1000:
        raise SourceUnusable(
            f'{spec} is no test pattern; write test://WIDTHxHEIGHT@FPS, such as '
            'test://1280x720@30, or test:// alone')
    size = (int(match[1]), int(match[2])) if match[1] else DEFAULT_SIZE
    return PatternSource(frame_id=frame_id, clock=clock, size=size, fps=rate)


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


def _readable(spec: str) -> Path:
    """Return the path of what is there and may be read."""
    path, name = _to_path(spec), mask_password(spec)
    if '://' in spec and not spec.startswith('file://'):
        raise SourceUnusable(
            f'{name} cannot be opened; known are {", ".join((*STREAM_SCHEMES, PATTERN_SCHEME))}')
    if not spec or not os.path.exists(path):
        raise SourceUnusable(
            f'source {name!r} does not exist; give a video file, a folder of images, a rosbag, a '
            'device such as /dev/video0, a URL such as rtsp://HOST/PATH, or test://')
    if not os.access(path, os.R_OK):
        raise SourceUnusable(f'no permission to read {path}')
    return path
