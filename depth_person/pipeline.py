"""The pose and distance stages of one camera as one object: a frame in, distances out."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.distance.estimator import Mounting
from depth_person.distance.stage import DistanceOptions, DistanceStage
from depth_person.distance.tracked import CameraPose, TrackedPeople
from depth_person.pose.people import People
from depth_person.pose.pipeline import PoseEstimator, PoseOptions


class Pipeline:
    """
    Measures the people of one camera's frames, taken in the order of their stamps.

    The two stages may be called in two threads: `find` for a frame while `measure` is at the one
    before.

    :raises DepthPersonError: when the network or the estimator cannot be had.
    """

    def __init__(self, pose: PoseOptions, distance: DistanceOptions) -> None:
        self._pose = PoseEstimator(pose)
        self._distance = DistanceStage(distance)

    def process(
        self, frame: Frame, mounting: Mounting = Mounting(), *,
        camera_pose: CameraPose | None = None,
    ) -> TrackedPeople:
        """
        Return how far the people of a frame are.

        :param mounting: what is known of the camera's attitude and height at the frame's stamp.
        :param camera_pose: where the camera is then; None where that is not known.
        """
        return self.measure(frame, self.find(frame), mounting, camera_pose=camera_pose)

    def find(self, frame: Frame) -> People:
        """Return the people in a frame; see PoseEstimator.estimate."""
        return self._pose.estimate(frame)

    def recall(
        self, frame: Frame, keypoints: NDArray[np.float32], track_ids: NDArray[np.int32],
    ) -> People:
        """Return the people that were found in a frame before; see PoseEstimator.recall."""
        return self._pose.recall(frame, keypoints, track_ids)

    def measure(
        self, frame: Frame, people: People, mounting: Mounting = Mounting(), *,
        camera_pose: CameraPose | None = None,
    ) -> TrackedPeople:
        """Return how far the people are that were found in a frame."""
        return self._distance.measure(
            people, frame.intrinsics, mounting, stamp_ns=frame.stamp_ns, camera_pose=camera_pose)
