"""RTMO: one network that gives everyone's box and keypoints at once."""
from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import check_image, ImageTensor, Pixels
from depth_person.pose.movenet import MIN_KEYPOINTS
from depth_person.pose.options import PoseOptions
from depth_person.pose.skeleton import from_coco17
from depth_person.pose.warps import to_raw

#: Grey that surrounded the images in training.
_BORDER = 114
#: Two boxes that share more than this part of their union are of the same person.
_SAME_PERSON = 0.65


def is_rtmo(graph: Graph) -> bool:
    """Return whether a network gives dets (1, n, 5) and keypoints (1, n, 17, 3)."""
    shapes = {value.name: value.shape for value in graph.outputs}
    return (shapes.get('dets', ())[2:] == (5,) and shapes.get('keypoints', ())[2:] == (17, 3))


class Rtmo:
    """
    Finds people in BGR images with an RTMO that mmdeploy has exported.

    Doubles are dropped here too, so an export without that step will do.
    """

    convention = 'coco'
    neck_measured = False

    def __init__(self, graph: Graph, options: PoseOptions) -> None:
        """Take an open network over; raise DepthPersonError when it takes no images."""
        pixels = Pixels('bgr', 'bytes').told(
            order=options.pixel_order, values=options.pixel_values)
        self._tensor = ImageTensor(graph, pixels, border=_BORDER)
        self._graph, self._options = graph, options

    @property
    def inference_s(self) -> float:
        """Seconds that the network took for the last image."""
        return self._graph.inference_s

    def __call__(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the people in an image; see PoseNetwork."""
        check_image(image)
        self._graph.restart()
        options = self._options
        tensor, matrix, _ = self._tensor.fit(image, options.input_size)
        dets, marks = self._graph.run(tensor, ('dets', 'keypoints'))
        rows = _distinct(dets[0], min_score=options.min_score)
        keypoints = marks[0, rows]
        keypoints[..., :2] = to_raw(matrix, keypoints[..., :2].reshape(1, -1, 2)).reshape(
            -1, 17, 2)
        keypoints[..., 2] = np.minimum(keypoints[..., 2], 1)
        keypoints[keypoints[..., 2] < options.min_score] = np.nan
        people = np.isfinite(keypoints[..., 2]).sum(1) >= MIN_KEYPOINTS
        return from_coco17(keypoints[people][:options.max_people])


def _distinct(dets: NDArray[np.float32], *, min_score: float) -> NDArray[np.intp]:
    """Return which of the boxes x0, y0, x1, y1, score are of different people, surest first."""
    corners, scores = dets[:, :4], dets[:, 4]
    boxes = np.concatenate([corners[:, :2], corners[:, 2:] - corners[:, :2]], axis=1)
    kept = cv2.dnn.NMSBoxes(boxes.tolist(), scores.tolist(), min_score, _SAME_PERSON)
    rows = np.array(kept, np.intp).reshape(-1)
    return rows[np.argsort(-scores[rows], kind='stable')]
