"""The pose stage as one object: a frame in, tracked people out."""
from __future__ import annotations

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
        keypoints = self._network(frame.image)
        return People(
            keypoints, self._tracker.update(keypoints, frame.stamp_ns),
            neck_measured=self._network.neck_measured, convention=self._network.convention)
