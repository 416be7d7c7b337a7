"""Networks that mark one person on a crop, with another that finds the people."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import boxes
from depth_person.pose.detector import sureness
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import check_image, ImageTensor
from depth_person.pose.movenet import MIN_KEYPOINTS, one_per_person
from depth_person.pose.network import KeypointNetwork, PoseNetwork
from depth_person.pose.options import PoseOptions
from depth_person.pose.skeleton import Keypoint
from depth_person.pose.warps import Matrix

Array = NDArray[np.float32]

#: A detection this sure needs no crop to confirm it. On 120 rendered frames that keeps all of
#: the 5 people of 185 whom BlazePose did not see, and 1 of the 5 detections that were nobody.
_SURE_DETECTION = 0.4
#: Joints lie inside the body: its box is larger than theirs by this part of the longer side.
_FLESH = 0.08


class CropNetwork(KeypointNetwork, Protocol):
    """Marks people whose places are roughly known."""

    def __call__(self, image: NDArray[np.uint8], people: Array) -> Array:
        """
        Return the keypoints of people, marked on crops.

        :param people: (n, 18, 3) as PoseNetwork gives them, n at least 1.
        :returns: the same; who is no person after all has no keypoints.
        """
        ...


class TopDown:
    """
    Finds people with one network and marks each on a crop with another.

    People and their order are the detector's; keypoints and scores the other's, but of people
    whom the detector is sure of and the other does not see (it may know whole bodies only, where
    no more than a head shows).
    """

    def __init__(
        self, detector: PoseNetwork, marker: CropNetwork, options: PoseOptions,
    ) -> None:
        self._detector, self._marker, self._options = detector, marker, options
        self.convention, self.neck_measured = marker.convention, marker.neck_measured
        self.inference_s = 0.0

    def __call__(self, image: NDArray[np.uint8]) -> Array:
        """Return the people in an image; see PoseNetwork."""
        check_image(image)
        people = self._detector(image)
        self.inference_s = self._detector.inference_s
        if not len(people):
            return people
        marked = self._marker(image, people)
        self.inference_s += self._marker.inference_s
        marked[..., 2] = np.minimum(marked[..., 2], 1)
        marked[~(marked[..., 2] >= self._options.min_score)] = np.nan
        seen = self._is_person(marked)
        sure = ~seen & (sureness(people) >= _SURE_DETECTION)
        if self.neck_measured and not self._detector.neck_measured:
            people[:, Keypoint.NECK] = np.nan  # or a computed one would pass for seen
        # Those who were seen on their crops come first: they outlast their doubles.
        marked = np.concatenate([marked[seen], people[sure]])
        kept = one_per_person(marked, body_boxes(marked))
        rows = np.concatenate([np.flatnonzero(seen), np.flatnonzero(sure)])[kept]
        return marked[kept[np.argsort(rows)]]

    def _is_person(self, marked: Array) -> NDArray[np.bool_]:
        """Return who has enough keypoints (n,); a neck that was computed is none."""
        there = np.isfinite(marked[..., 2])
        there[:, Keypoint.NECK] &= self.neck_measured
        enough: NDArray[np.bool_] = there.sum(1) >= MIN_KEYPOINTS
        return enough


def body_boxes(people: Array) -> Array:
    """
    Return the boxes (n, 4) x0, y0, x1, y1 of people's bodies.

    :param people: (n, 18, 3); each with some keypoint.
    """
    low, high = np.split(boxes(people[..., :2]), 2, axis=1)
    flesh = np.maximum(_FLESH * (high - low).max(1, keepdims=True), 1)
    return np.concatenate([low - flesh, high + flesh], 1)


def run_crops(
    graph: Graph, tensor: ImageTensor, image: NDArray[np.uint8], matrices: Matrix,
    size: tuple[int, int], outputs: Sequence[str],
) -> list[Array]:
    """
    Return a network's outputs for crops: in one run, or one by one where it takes one image.

    :param matrices: (n, 2, 3) from raw pixels to those of the crops.
    :param size: width and height of the crops.
    """
    graph.restart()
    batch = len(matrices) if tensor.batched else 1
    runs = [graph.run(tensor.fill(image, matrices[start:start + batch], size), outputs)
            for start in range(0, len(matrices), batch)]
    return [np.concatenate(each) for each in zip(*runs, strict=True)]
