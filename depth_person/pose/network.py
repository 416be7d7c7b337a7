"""What every pose network is to the pose stage, whatever is inside."""
from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class KeypointNetwork(Protocol):
    """What is known of any network that marks keypoints."""

    @property
    def convention(self) -> str:
        """Where it marks keypoints: a name of depth_person.distance.conventions."""
        ...

    @property
    def neck_measured(self) -> bool:
        """Whether it marks the neck itself; otherwise that is the midpoint of the shoulders."""
        ...

    @property
    def inference_s(self) -> float:
        """Seconds that the networks alone took for the last image."""
        ...


class PoseNetwork(KeypointNetwork, Protocol):
    """An image in, the people in it out; networks.open_network makes one."""

    def __call__(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """
        Return the people in an image, surest first.

        :param image: (height, width, 3) BGR.
        :returns: (n, 18, 3) COCO-18: u and v in raw pixels with centres at integers, score 0 to
            1; all NaN for a keypoint that is missing.
        :raises DepthPersonError: when the image has no pixels, or the network's answer is none.
        """
        ...
