"""
Measures what each kind of stream costs on this machine, without ROS.

    python test/benchmarks/camera_frames.py [--size 1280x720] [--fps 30] [--seconds 10]

FFmpeg (of the PyPI package imageio-ffmpeg, or --ffmpeg) encodes the test pattern, whose frames
carry a number, with x264; open_source reads them. Latency is from the drawing of a frame to its
arrival here, encoding included. The stamp's error is what has to go into time_offset, its spread
what no offset mends. Works with any OpenCV, so that their versions can be compared.
"""
from __future__ import annotations

import argparse
from pathlib import Path
import sys
import tempfile
import time

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from streams import Stream, STREAMS

from depth_person.camera.pattern import read_number
from depth_person.camera.sources import open_source
from depth_person.settings.camera import parse_size


def main():
    """Print one row a kind of stream."""
    parser = argparse.ArgumentParser(description=__doc__.partition('\n\n')[0])
    parser.add_argument('--size', type=parse_size, default=(1280, 720))
    parser.add_argument('--fps', type=int, default=30)
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--ffmpeg', help='instead of that of imageio-ffmpeg')
    args = parser.parse_args()
    print(f'OpenCV {cv2.__version__}, {args.size[0]}x{args.size[1]} at {args.fps} Hz')
    print('| stream | first frame s | latency ms (p95) | stamp error ms (spread) '
          '| CPU ms a frame |')
    print('|---|---|---|---|---|')
    with tempfile.TemporaryDirectory() as folder:
        for kind in STREAMS:
            with Stream(kind, ffmpeg_of(args.ffmpeg), folder, size=args.size,
                        fps=args.fps) as stream:
                print(f'| {kind} | {measure(stream, args.seconds)} |', flush=True)


def ffmpeg_of(given):
    """Return the FFmpeg to use."""
    if given:
        return given
    import imageio_ffmpeg
    return imageio_ffmpeg.get_ffmpeg_exe()


def measure(stream, seconds):
    """Return the cells of a row."""
    started_s = time.monotonic()
    late_ms, error_ms = [], []
    with open_source(stream.source, rtsp_transport=stream.rtsp_transport) as source:
        source.read()
        first_s = time.monotonic() - started_s
        cpu_s, since_s = time.process_time(), time.monotonic()
        while time.monotonic() - since_s < seconds:
            frame = source.read()
            now_ns = time.time_ns()
            sent_ns = stream.sender.sent_ns.get(read_number(frame.image))
            if sent_ns is not None:
                late_ms.append((now_ns - sent_ns) * 1e-6)
                error_ms.append((frame.stamp_ns - sent_ns) * 1e-6)
        cpu_ms = 1000 * (time.process_time() - cpu_s) / len(late_ms)
    spread_ms = np.percentile(error_ms, 95) - np.percentile(error_ms, 5)
    return (f'{first_s:.1f} | {np.median(late_ms):.0f} ({np.percentile(late_ms, 95):.0f}) | '
            f'{np.median(error_ms):.0f} ({spread_ms:.0f}) | {cpu_ms:.1f}')


if __name__ == '__main__':
    main()
