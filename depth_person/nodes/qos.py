"""Quality of service: the profiles, how they are overridden, and a clear word on a mismatch."""
from __future__ import annotations

from rclpy.duration import Infinite
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    qos_check_compatible,
    QoSCompatibility,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

_OVERRIDABLE = (
    QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY, QoSPolicyKind.HISTORY,
    QoSPolicyKind.DEPTH)


def overridable() -> QoSOverridingOptions:
    """Return the options by which parameters `qos_overrides./topic.publisher.*` are declared."""
    return QoSOverridingOptions(_OVERRIDABLE)


def publisher_profile() -> QoSProfile:
    """Return what is published with: the system's default, reliable, and a short queue."""
    return full_profile(ReliabilityPolicy.RELIABLE, depth=5)


def sensor_profile(*, depth: int = 1) -> QoSProfile:
    """Return what sensor data is subscribed with: best effort, of images the newest only."""
    return full_profile(ReliabilityPolicy.BEST_EFFORT, depth=depth)


def transform_profile(*, static: bool) -> QoSProfile:
    """Return what transforms are subscribed with: all of them, static ones of the past, too."""
    return full_profile(
        ReliabilityPolicy.RELIABLE, depth=100,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if static else DurabilityPolicy.VOLATILE)


def mismatches(node: Node, endpoint: Publisher | Subscription) -> list[str]:
    """Return a sentence for each other end that cannot be connected to this one."""
    topic = endpoint.topic_name
    publishes = isinstance(endpoint, Publisher)
    own = endpoint.qos_profile
    if publishes:
        side, others = 'subscriber', node.get_subscriptions_info_by_topic(topic)
    else:
        side, others = 'publisher', node.get_publishers_info_by_topic(topic)
    sentences = []
    for other in others:
        offered, asked = (own, other.qos_profile) if publishes else (other.qos_profile, own)
        compatibility, reason = qos_check_compatible(offered, asked)
        if compatibility == QoSCompatibility.ERROR:
            name = f'{other.node_namespace.rstrip("/")}/{other.node_name}'
            sentences.append(
                f'no message passes on {topic}: the publisher offers {_text(offered)}, the '
                f'subscriber asks {_text(asked)} ({reason.strip().rstrip(";")}); the {side} is '
                f'{name}. Change it there, or here with the parameter qos_overrides.{topic}.'
                f'{"publisher" if publishes else "subscription"}.reliability (or .durability)')
    return sentences


def _text(profile: QoSProfile) -> str:
    return f'{profile.reliability.name.lower()}, {profile.durability.name.lower()}'


def full_profile(
    reliability: ReliabilityPolicy, *, depth: int,
    durability: DurabilityPolicy = DurabilityPolicy.VOLATILE,
) -> QoSProfile:
    """Return a profile without unset policies, so that it can be compared with others."""
    return QoSProfile(
        reliability=reliability, depth=depth, durability=durability,
        deadline=Infinite, lifespan=Infinite, liveliness=LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=Infinite)
