"""BlazePose's landmark network: 33 landmarks of one person on a turned square crop."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import ImageTensor, Pixels
from depth_person.pose.options import PoseOptions
from depth_person.pose.skeleton import from_coco17, Keypoint
from depth_person.pose.topdown import body_boxes, run_crops
from depth_person.pose.warps import crop_matrices, to_raw

Array = NDArray[np.float32]

#: Figures a landmark: x, y, z, visible, in the picture; and landmarks with the helpers that
#: place the next crop, and without.
_FIGURES = 5
_LANDMARKS = (39, 33)
#: For each COCO-17 row the landmark.
_COCO17 = [0, 2, 5, 7, 8, 11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28]
_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
_HIPS = [Keypoint.R_HIP, Keypoint.L_HIP]
#: The crop is so much larger than the person, as in training; and a person's circle about the
#: hips reaches so much further than the keypoints.
_PADDING = 1.25
_FLESH = 1.1
#: Landmarks are counted from the outer corner of the crop's first pixel: read from its centre,
#: people and their mirror images lay 0.69 +- 0.06 pixels of the crop too far to the right.
_CORNER = 0.5
#: Who is less surely a person is none, as in MediaPipe.
_PRESENT = 0.5


def is_blazepose(graph: Graph) -> bool:
    """Return whether a network gives 33 landmarks, (1, 195) or (1, 165), and a flag (1, 1)."""
    return _named(graph, *(_FIGURES * count for count in _LANDMARKS)) is not None and (
        _named(graph, 1) is not None)


def _named(graph: Graph, *sizes: int) -> str | None:
    return next((value.name for value in graph.outputs
                 if len(value.shape) == 2 and value.shape[1] in sizes), None)


class BlazePose:
    """
    Marks people on crops of BGR images.

    A crop is placed as MediaPipe does: a square about the middle of the hips, turned so that the
    shoulders are above them; about the box where shoulders or hips are not known.
    """

    convention = 'coco'
    neck_measured = False

    def __init__(self, graph: Graph, options: PoseOptions) -> None:
        """Take an open network over; raise DepthPersonError when it takes no images."""
        pixels = Pixels('rgb', 'unit').told(
            order=options.pixel_order, values=options.pixel_values)
        self._tensor = ImageTensor(graph, pixels)
        if self._tensor.size is None:
            raise DepthPersonError(f'{graph.path} {graph}: its input should have a fixed size')
        self._size = self._tensor.size
        landmarks, flag = _named(graph, *(_FIGURES * n for n in _LANDMARKS)), _named(graph, 1)
        assert landmarks is not None
        assert flag is not None
        self._outputs = landmarks, flag
        self._graph = graph

    @property
    def inference_s(self) -> float:
        """Seconds that the network took for the last crops."""
        return self._graph.inference_s

    def __call__(self, image: NDArray[np.uint8], people: Array) -> Array:
        """Return the keypoints of people; see CropNetwork."""
        matrices = _matrices(people, self._size)
        landmarks, flags = run_crops(
            self._graph, self._tensor, image, matrices, self._size, self._outputs)
        marks = landmarks.reshape(len(people), -1, _FIGURES)[:, _COCO17]
        logits = np.clip(marks[..., 3:].min(-1), -30, 30)
        points = to_raw(matrices, marks[..., :2] - _CORNER)
        keypoints = np.dstack([points, 1 / (1 + np.exp(-logits))])
        keypoints[flags[:, 0] < _PRESENT] = np.nan
        return from_coco17(keypoints)


def _matrices(people: Array, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the matrices (n, 2, 3) from raw pixels to those of each person's crop."""
    boxes = body_boxes(people).astype(np.float64)
    points = people[..., :2].astype(np.float64)
    hips, shoulders = points[:, _HIPS].mean(1), points[:, _SHOULDERS].mean(1)
    up = shoulders - hips
    aligned = np.isfinite(up).all(1) & (np.hypot(*up.T) > 1)
    apart = points - hips[:, None]
    reach = np.nan_to_num(np.hypot(apart[..., 0], apart[..., 1])).max(1)
    widths = np.where(
        aligned, 2 * _FLESH * reach, (boxes[:, 2:] - boxes[:, :2]).max(1, initial=0))
    centres = np.where(aligned[:, None], hips, (boxes[:, :2] + boxes[:, 2:]) / 2)
    angles = np.where(aligned, -np.arctan2(up[:, 0], -up[:, 1]), 0)
    matrices = crop_matrices(centres, _PADDING * widths, size, angles=angles)
    matrices[..., 2] -= _CORNER
    return matrices
