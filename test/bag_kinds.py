"""Profiles and message types of the bags that tests make."""
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import get_types_from_msg, get_typestore, Stores


def profile(*, reliability='RELIABLE', durability='VOLATILE', depth=5):
    never = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST, depth, QosReliability[reliability], QosDurability[durability],
        never, never, QosLiveliness.AUTOMATIC, never, False)


LATCHED = profile(durability='TRANSIENT_LOCAL', depth=1)


def types_with(msgtype, definition):
    """Return the types of ROS 2 Jazzy, and one that only a bag knows."""
    types = get_typestore(Stores.ROS2_JAZZY)
    types.register(get_types_from_msg(definition, msgtype))
    return types
