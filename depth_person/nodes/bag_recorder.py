"""Writes topics into a bag as they come."""
from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from depth_person.errors import DepthPersonError
from depth_person.nodes.bag_player import message_type
from depth_person.nodes.qos import full_profile
from depth_person.nodes.result_codec import recorded_profile
from depth_person.replay.bags import BagWriter

#: What a report of a fault needs, as far as it is published; see msg_docs/bags.md.
REPORT_TOPICS = (
    'image_raw', 'camera_info', 'imu', 'pose', 'odometry', 'rangefinder', 'rel_alt', '/tf',
    '/tf_static', 'transforms', 'transforms_static', 'person_keypoints', 'person_depth',
    'person_depth/people', 'person_depth/scan', 'person_depth/nearest', 'person_depth/target',
    '/diagnostics')
#: How often new publishers are looked for, seconds.
_PERIOD_S = 0.2
#: Messages of a topic that wait while one is written, and for simulated time to begin.
_QUEUE = 50


class BagRecorder:
    """
    Subscribes through a node to whichever of some topics are published, now or later.

    :param topics: names, relative ones in the node's namespace.
    :ivar counts: messages written, by topic.
    :ivar left_out: what is published and cannot be recorded, and why.
    """

    def __init__(self, node: Node, writer: BagWriter, topics: Iterable[str]) -> None:
        self.counts: Counter[str] = Counter()
        self.left_out: list[str] = []
        self._node = node
        self._writer = writer
        self._awaited = {node.resolve_topic_name(topic) for topic in topics}
        self._waiting: defaultdict[str, deque[bytes]] = defaultdict(lambda: deque(maxlen=_QUEUE))
        # A player may wait for subscribers before it publishes the first /clock.
        self._timer = node.create_timer(
            _PERIOD_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        self._write()
        for topic in sorted(self._awaited):
            publishers = self._node.get_publishers_info_by_topic(topic)
            if publishers:
                self._awaited.discard(topic)
                self._subscribe(topic, publishers)

    def _subscribe(self, topic: str, publishers: list[TopicEndpointInfo]) -> None:
        msgtype = publishers[0].topic_type
        try:
            kind = message_type(msgtype)
            self._writer.add_topic(
                topic, msgtype,
                qos=[recorded_profile(publisher.qos_profile) for publisher in publishers])
        except (ImportError, AttributeError):
            self.left_out.append(f'{topic}: the type {msgtype} is not installed')
            return
        except DepthPersonError as error:
            self.left_out.append(str(error))
            return

        def take(data: bytes) -> None:
            self._waiting[topic].append(data)
            self._write()

        self._node.create_subscription(kind, topic, take, asked_profile(
            [publisher.qos_profile for publisher in publishers]), raw=True)

    def _write(self) -> None:
        """Write what has come, but nothing at zero, where simulated time stands before /clock."""
        time_ns = self._node.get_clock().now().nanoseconds
        if not time_ns:
            return
        for topic, messages in self._waiting.items():
            while messages:
                self._writer.write_raw(topic, time_ns, messages.popleft())
                self.counts[topic] += 1


def asked_profile(offered: list[QoSProfile]) -> QoSProfile:
    """Return the strongest profile that all publishers can serve."""
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered)
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return full_profile(
        ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT, depth=_QUEUE,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))
