"""The pose stage as one object: a frame in, tracked people out."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions
from depth_person.pose.people import People
from depth_person.pose.tracking import Tracker


class PoseEstimator:
    """Finds the people of one camera's frames, taken in the order of their stamps."""

    def __init__(self, options: PoseOptions) -> None:
        """Open the network; raise DepthPersonError when it cannot be had."""
        self._network = open_network(options)
        self._tracker = Tracker()

    @property
    def inference_s(self) -> float:
        """Seconds that the network alone took for the last frame."""
        return self._network.inference_s

    def estimate(self, frame: Frame) -> People:
        """Return the people in a frame, surest first."""
        return self.recall(frame, self._network(frame.image))

    def recall(self, frame: Frame, keypoints: NDArray[np.float32]) -> People:
        """
        Return the people whose keypoints the network found in a frame, now or before.

        :param keypoints: (n, 18, 3) as the network gave them.
        """
        keypoints = np.ascontiguousarray(keypoints)  # sums over another layout round otherwise
        return People(
            keypoints, self._tracker.update(keypoints, frame.stamp_ns),
            neck_measured=self._network.neck_measured, convention=self._network.convention)
