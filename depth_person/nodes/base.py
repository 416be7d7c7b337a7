"""What all nodes of the package have in common."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import time
from typing import Any, Generic, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.qos import mismatches, overridable, publisher_profile, sensor_profile
from depth_person.nodes.ros_parameters import declare, given_parameters, watch
from depth_person.nodes.traffic import Traffic
from depth_person.nodes.worker import Worker
from depth_person.settings.parameter import ParameterValue, specs
from depth_person.settings.table import unknown_parameter

_DIAGNOSTICS_PERIOD_S = 1.0
#: How long a closing node waits for slow subscribers.
_FAREWELL_S = 1.0

Settings = TypeVar('Settings')


class StageNode(Node, Generic[Settings]):
    """
    A node with checked parameters, QoS that can be overridden, and diagnostics.

    :ivar settings: the parameters in force; replaced as a whole when one is set, so a thread
        that reads it once sees one state.
    :ivar monitor: what the diagnostics say.
    :param overrides: parameters that come before those of files and the command line.
    :raises DepthPersonError: when a parameter is out of range or of a wrong type.
    """

    def __init__(
        self, name: str, settings: type[Settings], *,
        overrides: Mapping[str, ParameterValue] | None = None,
    ) -> None:
        super().__init__(
            name, automatically_declare_parameters_from_overrides=True,
            parameter_overrides=[
                Parameter(key, value=value) for key, value in (overrides or {}).items()])
        self.monitor = Monitor(self._log)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self._offered: list[Publisher] = []
        self._traffic: dict[Subscription, Traffic] = {}
        self._workers: list[Worker] = []
        table = specs(settings)
        self._given = given_parameters(self)
        for key in self._given:
            if wrong := unknown_parameter(key, table):
                self.monitor.fault(f'parameter {key}', Level.WARN, wrong)
        self.settings = settings(**declare(self, table, self._given))
        watch(self, table, try_out=self._with, commit=self._commit)
        # Wall time: with use_sim_time and no /clock there is something to report, too.
        self.create_timer(
            _DIAGNOSTICS_PERIOD_S, self._publish_diagnostics,
            clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def now_ns(self) -> int:
        """The time of the node's clock, which may be simulated."""
        return self.get_clock().now().nanoseconds

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to do; a node that only listens never is."""
        return False

    def work(self, name: str, target: Callable[[], None]) -> Worker:
        """Return a thread that runs beside the executor from start to close."""
        worker = Worker(name, target)
        self._workers.append(worker)
        return worker

    def start(self) -> None:
        """Start the threads."""
        for key in self._given:
            if key.startswith('qos_overrides.') and not self.has_parameter(key):
                self.monitor.fault(
                    f'parameter {key}', Level.WARN,
                    f'{key} has no effect: {self.get_name()} has no such publisher or '
                    'subscription, or not that policy')
        for worker in self._workers:
            worker.start()

    def raise_failure(self) -> None:
        """Raise what ended a thread before its time."""
        for worker in self._workers:
            if worker.failure is not None:
                raise worker.failure

    def close(self) -> None:
        """Stop the threads, and let what has been published go out."""
        for worker in self._workers:
            if not worker.stop():
                self.get_logger().warning(f'the thread {worker.name} does not end; leaving it')
        deadline = time.monotonic() + _FAREWELL_S
        for publisher in self._offered if self.context.ok() else ():
            left_s = max(deadline - time.monotonic(), 0.0)
            publisher.wait_for_all_acked(Duration(seconds=left_s))

    def settings_changed(self) -> None:
        """Take the changed settings over."""

    def advertise(self, message_type: type, topic: str) -> Publisher:
        """Return a publisher with the package's profile, unless parameters override it."""
        events = PublisherEventCallbacks(incompatible_qos=lambda _: self._check_qos())
        publisher = self.create_publisher(
            message_type, topic, publisher_profile(), event_callbacks=events,
            qos_overriding_options=overridable())
        self._offered.append(publisher)
        return publisher

    def listen(
        self, message_type: type, topic: str, callback: Callable[[Any], None], *,
        optional: bool = False,
    ) -> Subscription:
        """
        Return a subscription with the package's profile, unless parameters override it.

        :param optional: whether silence on the topic is not worth a report.
        """
        traffic = Traffic(self.resolve_topic_name(topic), self.monitor, optional=optional)

        def receive(message: Any) -> None:
            traffic.receive()
            callback(message)

        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda _: self._check_qos(),
            message_lost=lambda event: traffic.lose(event.total_count_change))
        subscription = self.create_subscription(
            message_type, topic, receive, sensor_profile(), event_callbacks=events,
            qos_overriding_options=overridable())
        self._traffic[subscription] = traffic
        return subscription

    def stop_listening(self, subscription: Subscription) -> None:
        """Destroy a subscription that listen made."""
        self._traffic.pop(subscription).forget()
        self.monitor.clear(_qos_key(subscription))
        self.destroy_subscription(subscription)

    def _with(self, changed: Mapping[str, ParameterValue]) -> Settings:
        return replace(self.settings, **changed)  # type: ignore[type-var]

    def _commit(self, changed: Mapping[str, ParameterValue]) -> None:
        self.settings = self._with(changed)
        self.settings_changed()

    def _check_qos(self) -> None:
        for endpoint in (*self._offered, *self._traffic):
            key = _qos_key(endpoint)
            if sentences := mismatches(self, endpoint):
                self.monitor.fault(key, Level.ERROR, '; '.join(sentences))
            else:
                self.monitor.clear(key)

    def _publish_diagnostics(self) -> None:
        self._check_qos()
        for subscription, traffic in self._traffic.items():
            traffic.check(publishers=self.count_publishers(subscription.topic_name))
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        name = self.get_fully_qualified_name().lstrip('/')
        message.status = [self.monitor.status(name)]
        self._diagnostics.publish(message)

    def _log(self, level: Level, message: str) -> None:
        if level == Level.ERROR:
            self.get_logger().error(message)
        else:
            self.get_logger().warning(message)


def _qos_key(endpoint: Publisher | Subscription) -> str:
    return f'qos of the {type(endpoint).__name__} of {endpoint.topic_name}'
