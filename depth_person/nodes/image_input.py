"""The images that a node subscribes to."""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.subscription import Subscription
from sensor_msgs.msg import CompressedImage, Image

from depth_person.nodes.base import StageNode


class ImageInput:
    """
    A subscription to image_raw or image_raw/compressed that can be opened and closed.

    :param compressed: which of the two.
    :param optional: whether silence is not worth a report.
    """

    def __init__(
        self, node: StageNode[Any], callback: Callable[[Image | CompressedImage], None], *,
        compressed: bool, optional: bool = False,
    ) -> None:
        self._node = node
        self._callback = callback
        self._optional = optional
        self._type, self._topic = (
            (CompressedImage, 'image_raw/compressed') if compressed else (Image, 'image_raw'))
        self._subscription: Subscription | None = None

    def open(self) -> None:
        """Subscribe, unless that has been done."""
        if self._subscription is None:
            self._subscription = self._node.listen(
                self._type, self._topic, self._callback, optional=self._optional)

    def close(self) -> None:
        """Cancel the subscription, if there is one."""
        if self._subscription is not None:
            self._node.stop_listening(self._subscription)
            self._subscription = None
