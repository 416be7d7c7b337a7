"""
Measures camera_node on streams of this machine: latency, coming back after a loss, endurance.

    python test/benchmarks/camera_latency.py latency [--size 1280x720] [--fps 30]
    python test/benchmarks/camera_latency.py reconnect
    python test/benchmarks/camera_latency.py soak [--minutes 30] [--loss 0.01] [--kind rtsp-udp]

FFmpeg (of the PyPI package imageio-ffmpeg) encodes the test pattern, whose frames carry a number,
with x264; camera_node reads them in a process of its own, and this one subscribes to image_raw.
V4L2 is v4l2_double.c (needs cc), which is loaded into camera_node and stands for a driver.
Latency is from the drawing of a frame to its arrival here: encoding, transport, decoding and DDS.
CPU is what camera_node takes of one core for a frame that it publishes.
"""
from __future__ import annotations

import argparse
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

import imageio_ffmpeg
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import Image

sys.path.insert(0, str(Path(__file__).parents[1]))
from streams import Stream, STREAMS

from depth_person.camera.pattern import read_number
from depth_person.nodes.image_messages import decode_image
from depth_person.settings.camera import parse_size

FFMPEG = imageio_ffmpeg.get_ffmpeg_exe()
#: A character device that every Linux has; the double takes its place.
V4L2_DEVICE = '/dev/full'
#: Frames of the start are left out of what is measured.
SETTLE_S = 3.0


class CameraProcess:
    """
    A camera_node in a process of its own, and our subscription to it.

    :ivar received: number (None if unreadable), time of arrival and stamp of each image, ns.
    """

    def __init__(self, source, environment=None, **parameters):
        words = [word for name, value in {'source': source, **parameters}.items()
                 for word in ('-p', f'{name}:={value}')]
        program = Path(sys.executable).parent / 'camera_node'
        self._process = subprocess.Popen(
            [program, '--ros-args', '--log-level', 'fatal', *words],
            env={**os.environ, **(environment or {})})
        self.received = []
        self._node = rclpy.create_node('camera_latency')
        self._node.create_subscription(Image, 'image_raw', self._receive, 1)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.send_signal(signal.SIGINT)
        self._process.wait()
        self._node.destroy_node()

    def spin(self, seconds):
        """Take images for a while."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left_s)

    def spin_until_new(self, timeout_s=60.0):
        """Take images until one more has come; return when that was."""
        before, end_s = len(self.received), time.monotonic() + timeout_s
        while len(self.received) == before:
            if time.monotonic() > end_s:
                raise SystemExit('no image; is the machine too busy?')
            self._executor.spin_once(timeout_sec=0.1)
        return time.monotonic()

    def cpu_s(self):
        """Return the processor time that camera_node has taken."""
        fields = Path(f'/proc/{self._process.pid}/stat').read_text().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def memory_mb(self):
        """Return the resident memory of camera_node."""
        pages = int(Path(f'/proc/{self._process.pid}/statm').read_text().split()[1])
        return pages * os.sysconf('SC_PAGE_SIZE') / 1e6

    def _receive(self, message):
        now_ns = time.time_ns()
        frame = decode_image(message)
        self.received.append((read_number(frame.image), now_ns, frame.stamp_ns))


def latency(args):
    """Print one row a kind of source."""
    print('| source | latency ms (p95) | stamp error ms (spread) | CPU ms a frame | rate Hz |')
    print('|---|---|---|---|---|')
    with tempfile.TemporaryDirectory() as folder:
        for kind in STREAMS:
            with Stream(kind, FFMPEG, folder, size=args.size, fps=args.fps) as stream, \
                    CameraProcess(stream.source, rtsp_transport=stream.rtsp_transport) as camera:
                print(f'| {kind} | {_row(camera, args.seconds, stream.sender.sent_ns)}',
                      flush=True)
        width, height = args.size
        with CameraProcess(V4L2_DEVICE, environment=_v4l2_double(folder), fps=float(args.fps),
                           size=f'{width}x{height}') as camera:
            print(f'| V4L2 | {_row(camera, args.seconds, None)}', flush=True)
        video = Path(folder) / 'pattern.mp4'
        _write_video(video, args)
        for name, source in (('video file', str(video)),
                             ('test pattern', f'test://{width}x{height}@{args.fps}')):
            with CameraProcess(source) as camera:
                print(f'| {name} | {_row(camera, args.seconds, None)}', flush=True)


def _row(camera, seconds, sent_ns):
    """Return the cells of a row; without times of drawing, frames are drawn when stamped."""
    camera.spin_until_new()
    camera.spin(SETTLE_S)
    camera.received.clear()
    cpu_s = camera.cpu_s()
    camera.spin(seconds)
    cpu_ms = 1000 * (camera.cpu_s() - cpu_s) / len(camera.received)
    drawn = [(now, stamp, stamp if sent_ns is None else sent_ns[number])
             for number, now, stamp in camera.received
             if sent_ns is None or number in sent_ns]
    late_ms, error_ms = (
        np.array([(row[i] - row[2]) * 1e-6 for row in drawn]) for i in (0, 1))
    spread_ms = np.percentile(error_ms, 95) - np.percentile(error_ms, 5)
    return (f'{np.median(late_ms):.0f} ({np.percentile(late_ms, 95):.0f}) | '
            f'{np.median(error_ms):.0f} ({spread_ms:.0f}) | {cpu_ms:.1f} | '
            f'{len(camera.received) / seconds:.1f} |')


def _v4l2_double(folder):
    """Build the double of a driver; return the environment that puts it into a program."""
    library = Path(folder) / 'v4l2_double.so'
    source = Path(__file__).with_name('v4l2_double.c')
    subprocess.run(['cc', '-shared', '-fPIC', '-O1', '-o', library, source, '-ldl'], check=True)
    return {'LD_PRELOAD': str(library), 'V4L2_DOUBLE': V4L2_DEVICE}


def _write_video(path, args):
    width, height = args.size
    subprocess.run(
        [FFMPEG, '-v', 'error', '-f', 'lavfi', '-i',
         f'testsrc2=size={width}x{height}:rate={args.fps}', '-t', str(args.seconds + 30),
         '-c:v', 'libx264', '-preset', 'ultrafast', '-pix_fmt', 'yuv420p', path], check=True)


def reconnect(args):
    """Print how long a loss takes to be over once the sender is back, by how long it was gone."""
    print('| stream | gone for s | back after s | old frames seen |')
    print('|---|---|---|---|')
    with tempfile.TemporaryDirectory() as folder:
        for kind in STREAMS:
            with Stream(kind, FFMPEG, folder, size=(640, 480), fps=25) as stream, \
                    CameraProcess(stream.source, rtsp_transport=stream.rtsp_transport) as camera:
                camera.spin_until_new()
                for gone_s in (1.0, 5.0, 20.0):
                    camera.spin(SETTLE_S)
                    stream.stop()
                    camera.spin(gone_s)
                    since = len(camera.received)
                    stream.start()
                    started_s = time.monotonic()
                    back_s = camera.spin_until_new() - started_s
                    camera.spin(1.0)
                    newest = max(list(stream.sender.sent_ns))
                    old = sum(number is not None and number > newest
                              for number, *_ in camera.received[since:])
                    print(f'| {kind} | {gone_s:g} | {back_s:.1f} | {old} |', flush=True)


def soak(args):
    """Print latency and memory twice a minute, and how they grow."""
    print('minute  frames  unreadable  latency ms (p95)  memory MB')
    rows = []
    with tempfile.TemporaryDirectory() as folder, \
            Stream(args.kind, FFMPEG, folder, size=args.size, fps=args.fps,
                   loss=args.loss) as stream, \
            CameraProcess(stream.source, rtsp_transport=stream.rtsp_transport) as camera:
        camera.spin_until_new()
        start_s = time.monotonic()
        while (minute := (time.monotonic() - start_s) / 60) < args.minutes:
            camera.spin(30.0)
            seen, camera.received = camera.received, []
            sent_ns = stream.sender.sent_ns
            late_ms = [(now - sent_ns[number]) * 1e-6 for number, now, _ in seen
                       if number in sent_ns]
            rows.append((minute + 0.5, np.median(late_ms), camera.memory_mb()))
            print(f'{minute + 0.5:6.1f}  {len(seen):6}  {len(seen) - len(late_ms):10}  '
                  f'{np.median(late_ms):6.0f} ({np.percentile(late_ms, 95):.0f})  '
                  f'{rows[-1][2]:.1f}', flush=True)
    minutes, late_ms, memory_mb = np.array(rows).T
    second = slice(len(minutes) // 2, None)
    for name, unit, values in (('latency', 'ms', late_ms), ('memory', 'MB', memory_mb)):
        print(f'{name}: {values[0]:.1f} {unit} at first, {values[-1]:.1f} at last, '
              f'{_slope(minutes[second], values[second]):+.3f} {unit} a minute in the second half')


def _slope(x, y):
    """Return the median slope between all pairs of points (Theil and Sen): spikes do not count."""
    earlier, later = np.triu_indices(len(x), 1)
    return np.median((y[later] - y[earlier]) / (x[later] - x[earlier]))


def main():
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition('\n\n')[0])
    parser.add_argument('what', choices=('latency', 'reconnect', 'soak'))
    parser.add_argument('--size', type=parse_size, default=(1280, 720))
    parser.add_argument('--fps', type=int, default=30)
    parser.add_argument('--seconds', type=float, default=10.0, help='of each source')
    parser.add_argument('--minutes', type=float, default=30.0, help='of soak')
    parser.add_argument('--loss', type=float, default=0.01, help='part of packets lost in soak')
    parser.add_argument('--kind', choices=STREAMS, default='rtsp-udp', help='of soak')
    args = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', '77')
    rclpy.init()
    {'latency': latency, 'reconnect': reconnect, 'soak': soak}[args.what](args)
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
