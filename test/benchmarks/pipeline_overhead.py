"""
Measures what the pipeline costs beside its network, at 1280x720.

    python test/benchmarks/pipeline_overhead.py [--rounds 3] [--input-size 512]

The composed pipeline and the bare network take turns, so that other load falls on both alike. The
camera is a folder of JPEG images, a little slower than the network, so that every image counts.
Then come the hops that an image can take from one stage to the next, and the memory and the start
of `depth_person run`.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import threading
import time
from typing import Any

import cv2
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from depth_person.camera.frame import Frame
from depth_person.camera.sources import open_source
from depth_person.nodes.base import StageNode
from depth_person.nodes.composition import make_pipeline
from depth_person.nodes.image_messages import decode_image, encode_image, encode_jpeg, header
from depth_person.nodes.qos import publisher_profile
from depth_person.nodes.worker import Mailbox, Worker
from depth_person.pose.movenet import INPUT, Letterbox, SIDE_STEP
from depth_person.pose.runtime import open_session
from depth_person.pose.store import model_path

SCENE = Path(__file__).parents[2] / 'demo' / 'walk'
TURN_S = 8.0
LOAD = 0.7  # of the frames that the network alone could take
HOPS = 60


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--input-size', type=int, default=512)
    options = parser.parse_args()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    with open_source(str(SCENE)) as source:
        frames = list(iter(source.read, None))
    with tempfile.TemporaryDirectory() as folder:
        for index, frame in enumerate(frames):
            cv2.imwrite(f'{folder}/{index:03}.jpg', frame.image)
        report_overhead(frames, folder, options.rounds, options.input_size)
    report_hops(frames[0])
    report_process(options.input_size)


def report_overhead(frames: list[Frame], folder: str, rounds: int, input_size: int) -> None:
    """Print what a frame costs in the composed pipeline and in the bare network."""
    bare, composed = [], []
    for _ in range(rounds):
        bare.append(run_network(frames, input_size))
        composed.append(run_pipeline(folder, input_size, fps=LOAD / (1e-3 * bare[-1][0])))
    network_wall, network_cpu = np.median(bare, axis=0)
    wall, cpu = np.median(composed, axis=0)
    print(f'{"a frame, ms":36} {"time":>8} {"CPU":>8}')
    print(f'{f"bare network, input {input_size}":36} {network_wall:8.1f} {network_cpu:8.1f}')
    print(f'{"from frame to markers, composed":36} {wall:8.1f} {cpu:8.1f}')
    print(f'{"ratio":36} {wall / network_wall:8.2f} {cpu / network_cpu:8.2f}\n')


def run_network(frames: list[Frame], input_size: int) -> tuple[float, float]:
    """Return the milliseconds and CPU milliseconds of a frame in the network alone."""
    session = open_session(model_path('movenet-multipose'))
    letterbox = Letterbox(input_size, step=SIDE_STEP)
    inputs = [letterbox.fill(frame.image).copy() for frame in frames]
    session.run(None, {INPUT: inputs[0]})
    times = []
    cpu, end = time.process_time(), time.perf_counter() + TURN_S
    while time.perf_counter() < end:
        start = time.perf_counter()
        session.run(None, {INPUT: inputs[len(times) % len(inputs)]})
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times)), 1e3 * (time.process_time() - cpu) / len(times)


def run_pipeline(folder: str, input_size: int, *, fps: float) -> tuple[float, float]:
    """Return the milliseconds that a frame occupies the pipeline, and its CPU milliseconds."""
    with running_pipeline(folder, input_size, fps) as (pose, depth):
        wait_until(lambda: int(figure(depth, 'rate').split('.')[0]) > 0)
        cpu, before = time.process_time(), frames_done(pose)
        time.sleep(TURN_S)
        count = frames_done(pose) - before
        wall = sum(
            float(figure(node, 'processing median').split()[0]) for node in (pose, depth))
        return wall, 1e3 * (time.process_time() - cpu) / count


@contextmanager
def running_pipeline(
    folder: str, input_size: int, fps: float,
) -> Iterator[tuple[StageNode[Any], StageNode[Any]]]:
    """Run the composed nodes on the images, again and again; give pose_node and depth_node."""
    # One look at the whole frame, and no crops: the network that runs alone, too.
    rclpy.init(args=[
        '--ros-args', '-p', f'input_size:={input_size}', '-p', 'refiner:=none', '--log-level',
        'error'])
    nodes = make_pipeline(
        {'source': folder, 'fps': fps, 'loop': True, 'horizontal_fov': 72.0})
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
        node.start()
    spinning = Worker('spin', lambda _: executor.spin())
    spinning.start()
    yield nodes[1], nodes[0]
    for node in reversed(nodes):
        node.close()
    executor.shutdown()
    spinning.stop()
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


def figure(node: StageNode[Any], name: str) -> str:
    """Return one of the figures that a node's diagnostics show."""
    return {pair.key: pair.value for pair in node.monitor.status('').values}.get(name, '0')


def frames_done(pose: StageNode[Any]) -> int:
    return int(figure(pose, 'frames'))


def report_hops(frame: Frame) -> None:
    """Print how long an image takes from one stage to the next, and how often it is copied."""
    image_header = header(stamp_ns=0, frame_id='camera_optical_frame')
    message = encode_image(frame.image, image_header)
    jpeg = encode_jpeg(frame.image, image_header, quality=90)
    rows = [
        ('handed on in memory', hop_in_memory(frame), 0),
        ('into an Image message', timed(lambda: encode_image(frame.image, image_header)), 1),
        ('out of an Image message', timed(lambda: decode_image(message)), 0),
        ('Image over DDS, one process', hop_over_dds(message, remote=False), 3),
        ('Image over DDS, two processes', hop_over_dds(message, remote=True), 3),
        ('into JPEG', timed(lambda: encode_jpeg(frame.image, image_header, quality=90)), 1),
        ('out of JPEG', timed(lambda: decode_image(jpeg)), 1),
    ]
    print(f'{"hop of a 1280x720 image":36} {"ms":>8} {"copies":>8}')
    for name, milliseconds, copies in rows:
        print(f'{name:36} {milliseconds:8.2f} {copies:8}')
    print()


def timed(step: Callable[[], object]) -> float:
    """Return the median milliseconds of a step."""
    times = []
    for _ in range(HOPS):
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def hop_in_memory(frame: Frame) -> float:
    """Return the median milliseconds until another thread has a frame."""
    mailbox: Mailbox[tuple[float, Frame]] = Mailbox()
    times: list[float] = []

    def take(_: threading.Event) -> None:
        while (item := mailbox.take()) is not None:
            times.append(time.perf_counter() - item[0])

    worker = Worker('take', take)
    worker.start()
    for _ in range(HOPS):
        mailbox.put((time.perf_counter(), frame))
        time.sleep(0.005)
    mailbox.close()
    worker.stop()
    return 1e3 * float(np.median(times))


def hop_over_dds(message: Image, *, remote: bool) -> float:
    """Return the median milliseconds from publishing an Image until its callback."""
    rclpy.init(args=['--ros-args', '--log-level', 'error'])
    node = Node('benchmark_receiver')
    times: list[float] = []

    def receive(received: Image) -> None:
        stamp = received.header.stamp
        times.append(time.time() - stamp.sec - 1e-9 * stamp.nanosec)

    node.create_subscription(Image, 'benchmark_image', receive, publisher_profile())
    sender = start_sender() if remote else None
    send = None if remote else make_sender(node, message)
    while len(times) < HOPS:
        if send is not None:
            send()
        rclpy.spin_once(node, timeout_sec=1.0)
    if sender is not None:
        sender.kill()
        sender.wait()
    node.destroy_node()
    rclpy.shutdown()
    return 1e3 * float(np.median(times))


def make_sender(node: Node, message: Image) -> Callable[[], None]:
    """Return what publishes the message with the time as its stamp."""
    publisher = node.create_publisher(Image, 'benchmark_image', publisher_profile())

    def send() -> None:
        message.header = header(stamp_ns=time.time_ns(), frame_id='')
        publisher.publish(message)

    return send


def start_sender() -> subprocess.Popen[bytes]:
    """Start a process that publishes an image ten times a second."""
    return subprocess.Popen([sys.executable, __file__, '--send'])


def send_for_ever() -> None:
    """Be that process."""
    rclpy.init(args=['--ros-args', '--log-level', 'error'])
    node = Node('benchmark_sender')
    image = np.zeros((720, 1280, 3), np.uint8)
    send = make_sender(node, encode_image(image, header(stamp_ns=0, frame_id='')))
    while True:
        send()
        time.sleep(0.1)


def report_process(input_size: int) -> None:
    """Print the start-up and peak memory of `depth_person run`."""
    rclpy.init(args=['--ros-args', '--log-level', 'error'])
    node = Node('benchmark_watcher')
    arrays: list[MarkerArray] = []
    node.create_subscription(MarkerArray, 'person_depth', arrays.append, publisher_profile())
    start = time.perf_counter()
    run = subprocess.Popen(
        [Path(sys.executable).parent / 'depth_person', 'run', '--source', SCENE, '--loop',
         '--ros-args', '-p', f'input_size:={input_size}', '--log-level', 'error'])
    while not arrays:
        rclpy.spin_once(node, timeout_sec=0.1)
    first = time.perf_counter() - start
    time.sleep(TURN_S)
    status = Path(f'/proc/{run.pid}/status').read_text()
    peak = int(status.partition('VmHWM:')[2].split()[0]) / 1024
    run.send_signal(signal.SIGINT)
    run.wait()
    print(f'{"start-up to the first marker, s":36} {first:8.1f}')
    print(f'{"peak memory of depth_person run, MB":36} {peak:8.0f}')
    node.destroy_node()
    rclpy.shutdown()


def wait_until(done: Callable[[], bool]) -> None:
    while not done():
        time.sleep(0.05)


if __name__ == '__main__':
    if sys.argv[1:] == ['--send']:
        send_for_ever()
    else:
        main()
