"""Streams: what FFmpeg reads by a URL or an SDP file, and GStreamer pipelines."""
from __future__ import annotations

from collections.abc import Callable

import cv2

from depth_person.camera.live import LiveSource, OPEN_TIMEOUT_S
from depth_person.camera.opencv import open_capture, open_within
from depth_person.camera.source import mask_password, SourceUnusable
from depth_person.camera.stamps import ArrivalStamps, Stamper, StreamStamps
from depth_person.camera.stream_fault import stream_fault
from depth_person.errors import DepthPersonError

#: FFmpeg is not to wait until it knows the rate, nor, where versions differ, for further tracks.
_PROBING = 'fpsprobesize;0|analyzeduration;3000000'
#: Longer than FFmpeg is told to take.
_PATIENCE_S = OPEN_TIMEOUT_S + 1.0
#: GStreamer is not told; a camera behind it may take a while to start.
_PIPELINE_PATIENCE_S = 10.0


def open_stream(
    url: str, *, transport: str, frame_id: str, clock: Callable[[], int], timeout_s: float,
) -> LiveSource:
    """
    Open a stream that FFmpeg reads: a URL, or the path of an SDP file.

    :param transport: of RTSP, tcp or udp.
    :raises DepthPersonError: when it does not open; the message holds no password. It is
        SourceUnusable where waiting does not help.
    """
    parameters = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, int(OPEN_TIMEOUT_S * 1000),
                  cv2.CAP_PROP_READ_TIMEOUT_MSEC, int(timeout_s * 1000)]
    if hasattr(cv2, 'CAP_PROP_N_THREADS'):  # since OpenCV 4.9
        # Every thread but one holds a frame back while FFmpeg decodes: 33 ms each at 30 Hz.
        parameters += [cv2.CAP_PROP_N_THREADS, 1]
    scheme = url.partition('://')[0].lower()
    options = _PROBING
    if scheme.startswith('rtsp'):
        options += f'|rtsp_transport;{transport}'
    if url.endswith('.sdp'):
        options += '|protocol_whitelist;file,rtp,udp'
    capture = open_within(_PATIENCE_S, lambda: open_capture(
        url, cv2.CAP_FFMPEG, parameters=parameters, ffmpeg_options=options))
    if capture is None or not capture.isOpened():
        raise stream_fault(url)
    # What comes over HTTP often has no times of its own (MJPEG), or comes in pieces (HLS).
    stamps: Stamper = ArrivalStamps() if scheme.startswith('http') else StreamStamps()
    return LiveSource(capture, description=f'stream {mask_password(url)}', frame_id=frame_id,
                      clock=clock, timeout_s=timeout_s, stamps=stamps)


def open_pipeline(
    pipeline: str, *, frame_id: str, clock: Callable[[], int], timeout_s: float,
) -> LiveSource:
    """
    Open a GStreamer pipeline that ends in appsink.

    :raises DepthPersonError: when it does not start; SourceUnusable where OpenCV has not been
        built with GStreamer, as in its wheels.
    """
    if cv2.CAP_GSTREAMER not in cv2.videoio_registry.getBackends():
        raise SourceUnusable(
            f'this OpenCV ({cv2.__version__}) has been built without GStreamer, so the pipeline '
            'cannot be run; take the python3-opencv of Ubuntu, which has it, or a stream URL')
    name = mask_password(pipeline)
    capture = open_within(
        _PIPELINE_PATIENCE_S, lambda: open_capture(pipeline, cv2.CAP_GSTREAMER))
    if capture is None or not capture.isOpened():
        raise DepthPersonError(
            f'pipeline {name} does not start; try it with gst-launch-1.0, autovideosink in the '
            'place of appsink, and see that it ends in: videoconvert ! appsink')
    return LiveSource(capture, description=f'pipeline {name}', frame_id=frame_id, clock=clock,
                      timeout_s=timeout_s, stamps=ArrivalStamps())
