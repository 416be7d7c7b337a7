"""Finds people anywhere in a frame by several looks of a network for many people."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import Array, body_sizes, Bools, boxes, same_people
from depth_person.pose.looks import Look
from depth_person.pose.movenet import MoveNet
from depth_person.pose.skeleton import from_coco17, N_KEYPOINTS

#: So many of the surest keypoints tell how sure a person is.
_SUREST = 5


class Detector:
    """
    Joins what looks at different sizes find.

    :param network: for many people.
    """

    def __init__(self, network: MoveNet) -> None:
        self._network = network

    @property
    def inference_s(self) -> float:
        """Seconds that the network took for the last frame."""
        return self._network.inference_s

    def find(self, image: NDArray[np.uint8], looks: Sequence[Look]) -> NDArray[np.float32]:
        """
        Return the people whom looks show, each once, surest first.

        :returns: (n, 18, 3) u, v in raw pixels, score; NaN for a keypoint that is missing.
        """
        self._network.inference_s = 0.0
        found, largest = [np.empty((0, N_KEYPOINTS, 3), np.float32)], [np.empty(0)]
        for look in looks:
            keypoints, _ = self._network.look(look.part(image), look.input_side)
            keypoints[..., :2] += np.array([look.x, look.y], np.float32)
            found.append(from_coco17(keypoints))
            largest.append(np.full(len(keypoints), look.largest))
        people, limits = np.concatenate(found), np.concatenate(largest)
        return people[_once(people, limits)] if len(people) > 1 else people


def sureness(people: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (n,) the mean score of each person's surest keypoints; missing ones score 0."""
    scores = people[..., 2]
    scores = np.sort(np.where(np.isnan(scores), np.float32(0), scores), axis=1)
    sure: NDArray[np.float32] = scores[:, -_SUREST:].sum(1) / np.float32(_SUREST)
    return sure


def limbs(
    points: Array, largest: NDArray[np.float64], others: Array, other_sizes: Array,
) -> Bools:
    """
    Return (n, m) whether somebody may be but a limb of another, who is too large for the look.

    A limb of somebody whom a look does not see as a whole may seem a person of its own there.

    :param points: (n, 18, 2) of people whom looks show.
    :param largest: (n,) body that the look sees as a whole, raw pixels.
    :param others: (m, 18, 2), of sizes (m,).
    """
    own, around = boxes(points), boxes(others)
    middle = ((own[:, :2] + own[:, 2:]) / 2)[:, None]
    within = ((middle > around[:, :2]) & (middle < around[:, 2:])).all(2)
    limb: Bools = within & (other_sizes > largest[:, None])
    return limb


def _once(people: NDArray[np.float32], largest: NDArray[np.float64]) -> NDArray[np.intp]:
    """
    Return which skeletons to keep so that nobody is counted twice, surest first.

    :param largest: (n,) body that each one's look sees as a whole, raw pixels.
    """
    points = people[..., :2]
    sizes = body_sizes(points)
    sure = sureness(people) * np.minimum(largest / sizes, 1.0)
    double = same_people(points, sizes) | limbs(points, largest, points, sizes)
    kept: list[int] = []
    for index in np.argsort(-sure, kind='stable'):
        if not double[index, kept].any():
            kept.append(int(index))
    return np.array(kept, np.intp)
