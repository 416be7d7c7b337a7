"""
Measures the time from an image's stamp to its scan in another process, idle and under load.

    python test/benchmarks/scan_latency.py [--fps 15] [--seconds 20] [--loads 0 2 4]

Frames of the demo's scene are handed to pose_node and depth_node in one process, as camera_node
hands them over, each stamped when it is handed over. A second process subscribes to
person_depth/scan. Each load is so many processes that do nothing but count.
"""
from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
import multiprocessing
import os
from pathlib import Path
import subprocess
import sys
import threading
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

from depth_person.camera.frame import Frame
from depth_person.camera.sources import open_source
from depth_person.nodes.base import StageNode
from depth_person.nodes.depth_node import DepthNode
from depth_person.nodes.pose_node import PoseNode
from depth_person.nodes.spin import leave
from depth_person.nodes.worker import Worker

SCENE = Path(__file__).parents[2] / 'demo' / 'walk'
TOPIC = 'person_depth/scan'
WARM_UP_S = 3.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--fps', type=float, default=15.0)
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--loads', type=int, nargs='+', default=[0, 2, 4])
    parser.add_argument('--input-size', type=int, default=512)
    parser.add_argument('--threads', type=int, default=0, help='of the network, 0 for all')
    parser.add_argument('--listen', action='store_true', help=argparse.SUPPRESS)
    args = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    if args.listen:
        listen()
        return
    with open_source(str(SCENE)) as source:
        frames = list(iter(source.read, None))
    print(f'{args.fps:g} images a second offered, input {args.input_size}, '
          f'{os.cpu_count()} processors')
    print(' load  scans/s  median ms  p99 ms  max ms  images dropped  scans too old')
    for load in args.loads:
        with burning(load):
            print(f'{load:5d} {measure(frames, args)}', flush=True)


def measure(frames: list[Frame], args: argparse.Namespace) -> str:
    """Return what comes out of the pipeline while frames are handed in."""
    with pipeline(args) as (pose, depth), listening() as listener:
        feed(pose, frames, fps=args.fps, seconds=WARM_UP_S)
        before = counts(pose, depth)
        feed(pose, frames, fps=args.fps, seconds=args.seconds)
        dropped, old = np.subtract(counts(pose, depth), before)
        until = time.time()
    arrived = np.array([line.split() for line in listener.stdout.splitlines()], float)
    arrived = arrived.reshape(-1, 2)
    kept = arrived[arrived[:, 0] > until - args.seconds, 1]
    if not len(kept):
        return f'{0:8.1f} {"-":>10} {"-":>7} {"-":>7} {dropped:15d} {old:14d}'
    return (f'{len(kept) / args.seconds:8.1f} {np.median(kept):10.0f} '
            f'{np.percentile(kept, 99):7.0f} {kept.max():7.0f} {dropped:15d} {old:14d}')


def feed(pose: PoseNode, frames: list[Frame], *, fps: float, seconds: float) -> None:
    """Hand frames over at a rate, each stamped as it goes."""
    start = time.monotonic()
    for index in range(int(seconds * fps)):
        time.sleep(max(start + index / fps - time.monotonic(), 0.0))
        pose.take(replace(frames[index % len(frames)], stamp_ns=time.time_ns()))


def counts(pose: StageNode[Any], depth: StageNode[Any]) -> tuple[int, int]:
    """Return how many images and results have been dropped so far."""
    return figure(pose, 'dropped frames'), figure(depth, 'results dropped for their age')


def figure(node: StageNode[Any], name: str) -> int:
    figures = {pair.key: pair.value for pair in node.monitor.status('').values}
    return int(figures.get(name, '0'))


@contextmanager
def pipeline(args: argparse.Namespace) -> Iterator[tuple[PoseNode, DepthNode]]:
    """Run pose_node and depth_node in this process."""
    rclpy.init(args=[
        '--ros-args', '-p', f'input_size:={args.input_size}', '-p', f'threads:={args.threads}',
        '--log-level', 'fatal'])
    depth = DepthNode(listen=False)
    pose = PoseNode(deliver=depth.take, listen=False)
    executor = SingleThreadedExecutor()
    for node in (depth, pose):
        executor.add_node(node)
        node.start()
    spinning = Worker('spin', lambda _: executor.spin())
    spinning.start()
    yield pose, depth
    for node in (pose, depth):
        node.close()
    executor.shutdown()
    spinning.stop()
    for node in (pose, depth):
        node.destroy_node()
    rclpy.shutdown()


class Listener:
    """What the other process has said when it ended."""

    stdout = ''


@contextmanager
def listening() -> Iterator[Listener]:
    """Run a subscriber in another process."""
    result = Listener()
    process = subprocess.Popen(
        [sys.executable, __file__, '--listen'], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        text=True)
    assert process.stdout is not None
    process.stdout.readline()
    yield result
    result.stdout = process.communicate(timeout=20)[0]


def listen() -> None:
    """Print the arrival and the age of each scan until stdin closes."""
    rclpy.init(args=['--ros-args', '--log-level', 'error'])
    node = Node('scan_listener')

    def note(scan: LaserScan) -> None:
        stamp = scan.header.stamp
        now = time.time()
        print(f'{now:.6f} {1e3 * (now - stamp.sec - 1e-9 * stamp.nanosec):.3f}')

    node.create_subscription(LaserScan, TOPIC, note, 10)
    ending = threading.Thread(target=sys.stdin.read, daemon=True)
    ending.start()
    print('ready', flush=True)
    while ending.is_alive():
        rclpy.spin_once(node, timeout_sec=0.2)
    node.destroy_node()
    rclpy.shutdown()


@contextmanager
def burning(number: int) -> Iterator[None]:
    """Keep so many processes busy."""
    processes = [multiprocessing.Process(target=burn, daemon=True) for _ in range(number)]
    for process in processes:
        process.start()
    yield
    for process in processes:
        process.terminate()
        process.join()


def burn() -> None:
    number = 0
    while True:
        number += 1


if __name__ == '__main__':
    main()
    sys.exit(leave(0))
