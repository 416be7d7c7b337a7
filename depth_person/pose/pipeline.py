"""The pose stage as one object: a frame in, tracked people out."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.pose.detector import Detector
from depth_person.pose.lookout import Lookout
from depth_person.pose.movenet import MoveNet
from depth_person.pose.network import PoseNetwork
from depth_person.pose.networks import open_movenet, open_network
from depth_person.pose.options import NO_REFINER, PoseOptions, settled
from depth_person.pose.people import People
from depth_person.pose.refine import CONVENTION as CROPS_CONVENTION
from depth_person.pose.refine import Refiner
from depth_person.pose.runtime import halves
from depth_person.pose.schedule import Schedule
from depth_person.pose.scout import Scout
from depth_person.pose.store import model_path
from depth_person.pose.tracking import Tracker
from depth_person.pose.two_speed import TwoSpeed


class PoseEstimator:
    """
    Finds the people of one camera's frames, taken in the order of their stamps.

    :ivar warning: what the user should know of how the networks run; mostly empty.
    """

    def __init__(self, options: PoseOptions) -> None:
        """Open the networks; raise DepthPersonError when one cannot be had."""
        options, self.warning = settled(options)
        self._network = open_network(options)
        self._tracker = Tracker()
        self._two_speed = _two_speed(self._network, options, self._tracker)
        self._convention = (
            self._network.convention if self._two_speed is None else CROPS_CONVENTION)

    @property
    def inference_s(self) -> float:
        """Seconds that the networks alone took for the last frame."""
        return (self._network if self._two_speed is None else self._two_speed).inference_s

    def estimate(self, frame: Frame) -> People:
        """Return the people in a frame, nearest first; the surest first without a refiner."""
        if self._two_speed is None:
            return self._tracked(frame, self._network(frame.image))
        return self._people(*self._two_speed.estimate(frame))

    def recall(
        self, frame: Frame, keypoints: NDArray[np.float32], track_ids: NDArray[np.int32],
    ) -> People:
        """
        Return the people that were found in a frame before, without the networks.

        What comes of later frames is the same as if they had been found now.

        :param keypoints: (n, 18, 3) of those people, with their track ids (n,).
        """
        if self._two_speed is None:
            return self._tracked(frame, keypoints)
        return self._people(*self._two_speed.recall(frame, keypoints, track_ids))

    def _tracked(self, frame: Frame, keypoints: NDArray[np.float32]) -> People:
        return self._people(keypoints, self._tracker.update(keypoints, frame.stamp_ns))

    def _people(self, keypoints: NDArray[np.float32], track_ids: NDArray[np.int32]) -> People:
        # In one layout, since sums over another round differently.
        return People(
            np.ascontiguousarray(keypoints), track_ids, neck_measured=self._network.neck_measured,
            convention=self._convention)


def _two_speed(
    network: PoseNetwork, options: PoseOptions, tracker: Tracker,
) -> TwoSpeed | None:
    """Return the two speeds of a MoveNet for many people; None for any other network."""
    if not isinstance(network, MoveNet) or network.side is not None:
        return None
    if options.refiner == NO_REFINER:
        return None
    beside, crops_beside = halves(options.threads)
    refiner = Refiner(
        model_path(options.refiner), threads=options.threads, provider=options.provider,
        threads_beside=crops_beside if beside else 0)
    # A network of its own, where it runs while the others do.
    scout = Scout(
        Detector(open_movenet(replace(options, threads=beside)) if beside else network),
        beside=beside > 0)
    schedule = Schedule(budget_ms=options.detection_budget, input_side=options.input_size)
    return TwoSpeed(
        Detector(network), refiner, Lookout(schedule, scout, tracker), tracker,
        min_score=options.min_score, max_people=options.max_people)
