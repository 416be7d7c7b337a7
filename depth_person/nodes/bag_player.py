"""Publishes the messages of a bag in their time."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib import import_module
import threading
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos
from rosgraph_msgs.msg import Clock

from depth_person.camera.bag import BagReader
from depth_person.errors import DepthPersonError
from depth_person.nodes.image_messages import header
from depth_person.nodes.lateness import Lateness
from depth_person.nodes.pacer import Pacer
from depth_person.nodes.qos import full_profile, mismatches, overridable, publisher_profile
from depth_person.nodes.subscribers import wait_for_subscribers
from depth_person.replay.ahead import ahead

#: Messages that are read before they are due.
_DEPTH = 20
#: Recorders do not know how long a publisher's queue was.
_QUEUE = 10
#: What a round of a loop lasts at least, of recorded time: a single message has no length.
_ROUND_NS = 100_000_000


@dataclass(frozen=True)
class PlayOptions:
    """
    How a bag is played.

    :ivar rate: how much faster than recorded.
    :ivar loop: start over at the end; stamps then jump back.
    :ivar clock_hz: how often /clock is published at least; 0 for not at all.
    :ivar topics: the only ones to play; empty for all.
    :ivar wait: for subscribers, before the first message.
    :raises DepthPersonError: when a number is out of its range.
    """

    rate: float = 1.0
    loop: bool = False
    clock_hz: float = 0.0
    topics: tuple[str, ...] = ()
    wait: bool = False

    def __post_init__(self) -> None:
        if not 0.001 <= self.rate <= 1000:
            raise DepthPersonError(f'a rate of {self.rate:g} is not from 0.001 to 1000')
        if not 0 <= self.clock_hz <= 1000:
            raise DepthPersonError(f'a clock of {self.clock_hz:g} Hz is not from 0 to 1000')


class BagPlayer:
    """
    Publishes a bag through a node.

    :ivar left_out: what is not published and why, a line each topic.
    :ivar lateness: how long after they were due all messages were published.
    :raises DepthPersonError: when a topic is not in the bag, or none can be published.
    """

    def __init__(
        self, node: Node, reader: BagReader, options: PlayOptions, stopping: threading.Event,
    ) -> None:
        self._node = node
        self._reader = reader
        self._options = options
        self._stopping = stopping
        self.left_out: list[str] = []
        self.lateness = Lateness()
        self._publishers = dict(self._advertise())
        if not self._publishers:
            raise DepthPersonError(
                f'nothing in {reader.path} can be published: '
                f'{"; ".join(self.left_out) or "it holds no topics"}')
        self._pacer = self._make_pacer()

    def play(self) -> None:
        """Publish everything; return at the end, or when told to stop."""
        if self._options.wait:
            wait_for_subscribers(self._count_subscribers, self._stopping)
        while not self._stopping.is_set():
            self._play_once()
            if not self._options.loop or not self.lateness.count:
                return

    def mismatches(self) -> list[str]:
        """Return a sentence for each subscriber that gets nothing for its QoS profile."""
        return [sentence for publisher in self._publishers.values()
                for sentence in mismatches(self._node, publisher)]

    def summary(self) -> str:
        """Return how many messages were published, and how late."""
        late = self.lateness
        if not late.count:
            return 'no message was published'
        middle, most, latest = (
            1000 * each for each in (late.within_s(0.5), late.within_s(0.99), late.most_s))
        return (
            f'{late.count} messages on {len(self._publishers)} topics; published late '
            f'by {middle:.2f} ms (median), {most:.2f} ms (99 %), {latest:.2f} ms (most)')

    def _advertise(self) -> Iterator[tuple[str, Publisher]]:
        topics = self._reader.topics
        if missing := [name for name in self._options.topics if name not in topics]:
            raise DepthPersonError(
                f'{self._reader.path} has no {", ".join(missing)}; it has {", ".join(topics)}')
        for topic in topics.values():
            if self._options.topics and topic.name not in self._options.topics:
                continue
            if topic.name == '/clock' and self._options.clock_hz:
                self.left_out.append('/clock: a clock of its own is asked for')
                continue
            try:
                kind = message_type(topic.msgtype)
            except (ImportError, AttributeError):
                self.left_out.append(f'{topic.name}: the type {topic.msgtype} is not installed')
                continue
            yield topic.name, self._node.create_publisher(
                kind, topic.name, offered_profile(topic.qos),
                qos_overriding_options=overridable())

    def _make_pacer(self) -> Pacer:
        rate, clock_hz = self._options.rate, self._options.clock_hz
        if not clock_hz:
            return Pacer(self._stopping, None, rate=rate)
        clock = self._node.create_publisher(Clock, '/clock', publisher_profile())

        def tick(time_ns: int) -> None:
            clock.publish(Clock(clock=header(stamp_ns=time_ns, frame_id='').stamp))

        return Pacer(self._stopping, tick, rate=rate, clock_period_s=1 / clock_hz)

    def _play_once(self) -> None:
        first_ns, last_ns = None, 0
        messages = self._reader.raw_messages(self._publishers)
        with closing(ahead(messages, depth=_DEPTH)) as read:
            for topic, last_ns, data in read:
                first_ns = last_ns if first_ns is None else first_ns
                self._pacer.wait(last_ns)
                if self._stopping.is_set():
                    return
                self._publishers[topic].publish(data)
                self.lateness.add(self._pacer.late_s)
        if self._options.loop and first_ns is not None and last_ns < first_ns + _ROUND_NS:
            self._pacer.wait(first_ns + _ROUND_NS)

    def _count_subscribers(self) -> int:
        return sum(publisher.get_subscription_count() for publisher in self._publishers.values())


def offered_profile(recorded: Sequence[Qos]) -> QoSProfile:
    """
    Return a profile that every subscriber of the recorded publishers can connect to.

    Of several, the strongest offer; of none, the package's own.
    """
    if not recorded:
        return publisher_profile()
    reliable = any(each.reliability.name != 'BEST_EFFORT' for each in recorded)
    latched = any(each.durability.name == 'TRANSIENT_LOCAL' for each in recorded)
    return full_profile(
        ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        depth=max(each.depth for each in recorded) or _QUEUE,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))


def message_type(name: str) -> Any:
    """Return the class of a message; raise ImportError or AttributeError if there is none."""
    package, _, kind = name.split('/')
    return getattr(import_module(f'{package}.msg'), kind)


