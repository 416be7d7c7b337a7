"""What all nodes of the package have in common."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Generic, TypeVar

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.lifecycle import LifecycleState
from rclpy.lifecycle import TransitionCallbackReturn as Outcome
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from depth_person.errors import DepthPersonError
from depth_person.nodes.diagnostics_output import DiagnosticsOutput
from depth_person.nodes.lifecycle import ManagedNode
from depth_person.nodes.managed_publisher import ManagedPublisher
from depth_person.nodes.monitor import Level
from depth_person.nodes.qos import mismatches, overridable, publisher_profile, sensor_profile
from depth_person.nodes.ros_parameters import declare, given_parameters, watch
from depth_person.nodes.subscribers import wait_for_delivery
from depth_person.nodes.traffic import Traffic
from depth_person.settings.node import NodeSettings
from depth_person.settings.parameter import ParameterValue, specs
from depth_person.settings.table import unknown_parameter

#: How long a closing node waits for slow subscribers.
_FAREWELL_S = 1.0

Settings = TypeVar('Settings', bound=NodeSettings)


class StageNode(ManagedNode, Generic[Settings]):
    """
    A lifecycle node with checked parameters, QoS that can be overridden, and diagnostics.

    :ivar settings: the parameters in force; replaced as a whole when one is set, so a thread
        that reads it once sees one state.
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
        self._offered: list[Publisher] = []
        self._traffic: dict[Subscription, Traffic] = {}
        self._handed_over: list[Traffic] = []
        table = specs(settings)
        self._given = given_parameters(self)
        for key in self._given:
            if wrong := unknown_parameter(key, table):
                self.monitor.fault(f'parameter {key}', Level.WARN, wrong, lasting=True)
        self.settings = settings(**declare(self, table, self._given))  # type: ignore[arg-type]
        watch(self, table, try_out=self._with, commit=self._commit)
        DiagnosticsOutput(self, self.monitor, check=self._check)

    @property
    def now_ns(self) -> int:
        """The time of the node's clock, which may be simulated."""
        return self.get_clock().now().nanoseconds

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to do; a node that only listens never is."""
        return False

    def start(self) -> None:
        """
        Configure and activate the node, unless someone else is to do that.

        :raises DepthPersonError: when it cannot be configured.
        """
        if self.settings.autostart:
            self.bring_up()

    def raise_failure(self) -> None:
        """Raise what ended a job; a node that someone else manages becomes inactive instead."""
        if not self.active:
            return
        try:
            super().raise_failure()
        except DepthPersonError as error:
            if self.settings.autostart:
                raise
            self.trigger_deactivate()
            self.fail(error)

    def on_configure(self, state: LifecycleState) -> Outcome:
        """Configure, and report QoS parameters that nothing has asked for."""
        result = super().on_configure(state)
        for key in self._given if result == Outcome.SUCCESS else ():
            if key.startswith('qos_overrides.') and not self.has_parameter(key):
                self.monitor.fault(
                    f'parameter {key}', Level.WARN,
                    f'{key} has no effect: {self.get_name()} has no such publisher or '
                    'subscription, or not that policy', lasting=True)
        return result

    def on_activate(self, state: LifecycleState) -> Outcome:
        """Activate; topics may be silent from now on, not from when they were last heard."""
        for traffic in (*self._traffic.values(), *self._handed_over):
            traffic.restart()
        return super().on_activate(state)

    def cleanup(self) -> None:
        """Forget the topics."""
        self._offered.clear()
        self._traffic.clear()
        self._handed_over.clear()

    def close(self) -> None:
        """Stop the threads, and let what has been published go out."""
        self.stop_jobs()
        if self.context.ok():
            wait_for_delivery(self._offered, timeout_s=_FAREWELL_S)

    def settings_changed(self) -> None:
        """Take the changed settings over; called once configured."""

    def advertise(self, message_type: type, topic: str) -> Publisher:
        """
        Return a publisher that is silent while the node is not active.

        It has the package's profile, unless parameters override it.
        """
        events = PublisherEventCallbacks(incompatible_qos=lambda _: self._check_qos())
        publisher = self.create_publisher(
            message_type, topic, publisher_profile(), event_callbacks=events,
            qos_overriding_options=overridable(), publisher_class=ManagedPublisher)
        self.add_managed_entity(publisher)
        self._offered.append(publisher)
        return publisher

    def listen(
        self, message_type: type, topic: str, callback: Callable[[Any], None], *,
        optional: bool = False, while_inactive: bool = False,
        shared: bool = False, profile: QoSProfile | None = None,
    ) -> Subscription:
        """
        Return a subscription with the package's profile, unless parameters override it.

        :param optional: whether silence on the topic is not worth a report.
        :param while_inactive: whether messages are taken while the node is inactive, too: those
            that stay true until the next one.
        :param shared: whether several publishers on the topic are not worth a report.
        :param profile: in the place of the package's.
        """
        traffic = Traffic(
            self.resolve_topic_name(topic), self.monitor, optional=optional, shared=shared)

        def receive(message: Any) -> None:
            traffic.receive()
            if self.active or while_inactive:
                callback(message)

        events = SubscriptionEventCallbacks(
            incompatible_qos=lambda _: self._check_qos(),
            message_lost=lambda event: traffic.lose(event.total_count_change))
        subscription = self.create_subscription(
            message_type, topic, receive, profile or sensor_profile(), event_callbacks=events,
            qos_overriding_options=overridable())
        self._traffic[subscription] = traffic
        return subscription

    def crowded(self, subscription: Subscription) -> str:
        """Return what is wrong if a topic that listen subscribed has several publishers."""
        return self._traffic[subscription].crowded

    def stop_listening(self, subscription: Subscription) -> None:
        """Destroy a subscription that listen made."""
        self._traffic.pop(subscription).forget()
        self.monitor.clear(_qos_key(subscription))
        self.destroy_subscription(subscription)

    def expect(self, what: str) -> Traffic:
        """Return the traffic of what is handed over in memory; silence is reported."""
        traffic = Traffic(what, self.monitor)
        self._handed_over.append(traffic)
        return traffic

    def _with(self, changed: Mapping[str, ParameterValue]) -> Settings:
        return replace(self.settings, **changed)  # type: ignore[arg-type]

    def _commit(self, changed: Mapping[str, ParameterValue]) -> None:
        self.settings = self._with(changed)
        if self.configured:
            self.settings_changed()

    def _check_qos(self) -> None:
        for endpoint in (*self._offered, *self._traffic):
            key = _qos_key(endpoint)
            if sentences := mismatches(self, endpoint):
                self.monitor.fault(key, Level.ERROR, '; '.join(sentences))
            else:
                self.monitor.clear(key)

    def _check(self) -> None:
        self._check_qos()
        if not self.active:
            return
        for subscription, traffic in self._traffic.items():
            traffic.check(publishers=self.count_publishers(subscription.topic_name))
        for traffic in self._handed_over:
            traffic.check()


def _qos_key(endpoint: Publisher | Subscription) -> str:
    return f'qos of the {type(endpoint).__name__} of {endpoint.topic_name}'
