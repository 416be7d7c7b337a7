"""Plays the bundled bag through the nodes, and keeps what comes of it."""
import math
import os
import random
import socket
import sys
import threading

import numpy as np
from processes import BIN, DemoError, HERE, Processes, wait_until
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from report import decoded, draw_report, read_samples, write_video
from sensor_msgs.msg import CompressedImage, PointCloud2
from watch import points, stamp_s

from depth_person.replay.bags import BagReader

BAG = HERE / 'walk'
TRUTH = '/person_truth'
START_TIMEOUT_S = 60.0
PLAY_TIMEOUT_S = 60.0
LAST_IMAGE_TIMEOUT_S = 2.0


class Companion:
    """The demo's own node: sends the truth ahead of the images, and keeps the overlays."""

    def __init__(self):
        # SIGINT stays Python's: the children are to be ended in order.
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node('demo')
        self.overlays = []
        self.seen_the_last = threading.Event()
        self._last_s = math.inf
        kept = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._truth = self.node.create_publisher(PointCloud2, TRUTH, kept)
        self.node.create_subscription(
            CompressedImage, 'person_depth/image/compressed', self._on_overlay, 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def send_truth(self):
        """Publish every truth of the bag."""
        with BagReader(BAG) as bag:
            for _, _, data in bag.raw_messages([TRUTH]):
                self._truth.publish(bytes(data))
            self._last_s = max(stamp_s(message) for _, _, message in bag.messages([TRUTH]))

    def everyone_is_there(self):
        """Return whether the nodes and the watcher have found each other."""
        return (self.node.count_publishers('person_keypoints')
                and self.node.count_subscribers('person_keypoints')
                and self.node.count_publishers('person_depth/people')
                and self.node.count_subscribers('person_depth/people')
                and self.node.count_subscribers(TRUTH))

    def close(self):
        """Leave the graph."""
        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()
        rclpy.try_shutdown()

    def _on_overlay(self, message):
        self.overlays.append(message)
        if stamp_s(message) >= self._last_s:
            self.seen_the_last.set()


def free_domain():
    """Return a ROS domain that nobody on this machine seems to use."""
    for domain in random.sample(range(1, 101), 100):  # those above meet ports of other programs
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as unicast:
            try:
                # The port at which the first participant of a domain is found (RTPS 9.6.1).
                unicast.bind(('', 7410 + 250 * domain))
            except OSError:
                continue
        return domain
    raise DemoError('every ROS domain from 1 to 100 is in use; end some of the ROS programs')


def play(out):
    """
    Play the bag; return the overlays as messages.

    :param out: folder for logs and samples.csv.
    :raises DemoError: when a process fails, or nothing comes.
    """
    os.environ.update(
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', ROS_DOMAIN_ID=str(free_domain()))
    companion = Companion()
    try:
        with Processes(logs=out) as processes:
            ros_args = ('--ros-args', '--params-file', HERE / 'params.yaml')
            print('starting pose_node, depth_node and the watcher', flush=True)
            processes.start('pose_node', BIN / 'pose_node', *ros_args)
            processes.start('depth_node', BIN / 'depth_node', *ros_args)
            processes.start('watch', sys.executable, HERE / 'watch.py',
                            '--csv', out / 'samples.csv', quiet=False)
            wait_until(companion.everyone_is_there, what='the start of the nodes',
                       timeout_s=START_TIMEOUT_S, processes=processes)
            companion.send_truth()
            print(f'playing {BAG.name} with camera_node', flush=True)
            processes.start('camera_node', BIN / 'camera_node', *ros_args, '-p', f'source:={BAG}')
            wait_until(lambda: processes.check(may_end=('camera_node',)), what="the bag's end",
                       timeout_s=PLAY_TIMEOUT_S, processes=processes, may_end=('camera_node',))
            companion.seen_the_last.wait(LAST_IMAGE_TIMEOUT_S)  # it is still on its way
            if processes.end('watch'):
                raise DemoError(f'no person_depth/people came; the logs are in {out}')
        return companion.overlays
    finally:
        companion.close()


def write_results(overlays, out):
    """
    Write overlay.mp4 and report.png.

    :raises DemoError: when nobody was measured.
    """
    samples = read_samples(out / 'samples.csv')
    if not overlays or not samples:
        raise DemoError(f'the nodes ran, but measured nobody; their logs are in {out}')
    truth = true_rows()
    write_video(
        {stamp_s(each): each for each in overlays}, np.unique(truth[:, 0]), out / 'overlay.mp4')
    best = max(overlays, key=lambda each: (samples['stamp_s'] == stamp_s(each)).sum())
    draw_report(samples, truth, decoded(best), out / 'report.png')


def true_rows():
    """Return (stamp, id, x, z, range) of every person in every frame of the bag."""
    with BagReader(BAG) as bag:
        return np.array([
            (stamp_s(message), each['track_id'], each['x'], each['z'], each['range'])
            for _, _, message in bag.messages([TRUTH]) for each in points(message)])
