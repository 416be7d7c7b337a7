"""RTMPose and other networks with SimCC outputs: a row of bins for x, and one for y."""
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

_OUTPUTS = ('simcc_x', 'simcc_y')
#: The crop is so much larger than the body's box, as in training.
_PADDING = 1.25
#: Layouts by their number of keypoints, and where each has the neck: COCO-17, Halpe's 26 and
#: COCO-WholeBody's 133 all begin with COCO-17.
_NECKS: dict[int, int | None] = {17: None, 26: 18, 133: None}


def is_simcc(graph: Graph) -> bool:
    """Return whether a network gives simcc_x (n, k, w) and simcc_y (n, k, h)."""
    ranks = {value.name: len(value.shape) for value in graph.outputs}
    return all(ranks.get(name) == 3 for name in _OUTPUTS)


class SimCC:
    """Marks people on upright crops of BGR images with an RTMPose."""

    convention = 'coco'

    def __init__(self, graph: Graph, options: PoseOptions) -> None:
        """Take an open network over; raise DepthPersonError when its layout is not known."""
        pixels = Pixels('rgb', 'imagenet').told(
            order=options.pixel_order, values=options.pixel_values)
        self._tensor = ImageTensor(graph, pixels)
        counts = {value.shape[1] for value in graph.outputs if value.name in _OUTPUTS}
        count = counts.pop()
        if counts or count not in _NECKS or self._tensor.size is None:
            raise DepthPersonError(
                f'{graph.path} {graph}: SimCC outputs should have '
                f'{", ".join(map(str, _NECKS))} keypoints each, and the input a fixed size')
        self._size, self._neck = self._tensor.size, _NECKS[count]
        self._graph = graph

    @property
    def neck_measured(self) -> bool:
        """Whether the layout has a neck."""
        return self._neck is not None

    @property
    def inference_s(self) -> float:
        """Seconds that the network took for the last crops."""
        return self._graph.inference_s

    def __call__(self, image: NDArray[np.uint8], people: Array) -> Array:
        """Return the keypoints of people; see CropNetwork."""
        boxes = body_boxes(people)
        sides = _PADDING * (boxes[:, 2:] - boxes[:, :2])
        widths = np.maximum(sides[:, 0], sides[:, 1] * self._size[0] / self._size[1])
        matrices = crop_matrices((boxes[:, :2] + boxes[:, 2:]) / 2, widths, self._size)
        bins = run_crops(self._graph, self._tensor, image, matrices, self._size, _OUTPUTS)
        (x, x_score), (y, y_score) = (
            _highest(each, side) for each, side in zip(bins, self._size, strict=True))
        points = to_raw(matrices, np.stack([x, y], -1))
        marked = np.dstack([points, np.minimum(x_score, y_score)])
        marked[marked[..., 2] <= 0] = np.nan
        keypoints = from_coco17(marked[:, :17])
        if self._neck is not None:
            keypoints[:, Keypoint.NECK] = marked[:, self._neck]
        return keypoints


def _highest(bins: Array, side: int) -> tuple[Array, Array]:
    """
    Return the place of the highest bin, pixels of the crop, between the bins; and its value.

    :param bins: (n, k, bins), as many to a pixel as fit.
    :param side: of the crop.
    """
    best = bins.argmax(2)[..., None]
    last = bins.shape[2] - 1
    low, middle, high = (
        np.take_along_axis(bins, np.clip(best + step, 0, last), 2)[..., 0] for step in (-1, 0, 1))
    curvature = low - 2 * middle + high
    inside = (best[..., 0] > 0) & (best[..., 0] < last) & (curvature < 0)
    between = np.where(inside, (low - high) / (2 * np.where(inside, curvature, -1)), 0)
    return ((best[..., 0] + between) * (side / bins.shape[2])).astype(np.float32), middle
