"""MoveNet: an image in, the keypoints of the people in it out."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import time

import cv2
import numpy as np
from numpy.typing import NDArray
import onnxruntime

from depth_person.errors import DepthPersonError
from depth_person.pose import decode
from depth_person.pose.bodies import likeness
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import check_image
from depth_person.pose.runtime import check_finite, open_session
from depth_person.pose.skeleton import from_coco17

INPUT = 'image'
#: What every MoveNet works out, and what only the one for many people does, which gives both.
HEADS = ('center', 'keypoint_regression', 'keypoint_heatmap', 'keypoint_offset')
BOX_HEADS = ('box_scale', 'box_offset')
#: What a network for one person gives: keypoints as the original graphs mark them, and fitted.
MARKED, FITTED = 'keypoints', 'keypoints_fitted'

#: Sides of the input of the network for many people are multiples of this.
SIDE_STEP = 32
#: Network pixels to a cell of the heads.
STRIDE = 4

#: Side of the images that the network was trained on, pixels. It misses parts of people who are
#: larger than that in its input, and their size: whoever seems to be larger than SUSPECT gives
#: reason for a second look, in an input of this side.
TRAINED_SIDE = 256
SUSPECT = 180

#: A skeleton with fewer keypoints is no person.
MIN_KEYPOINTS = 3
#: Buffers kept for sizes of images.
_MOST_LETTERBOXES = 16
#: Skeletons looked at in an image, some of them of the same person.
_CANDIDATES = 100
#: Two skeletons more alike than this are the same person; the spread of their marks, over the
#: mean side of their boxes.
_SAME_PERSON = 0.5
_MARK_SPREAD = 0.1


class MoveNet:
    """
    Finds people in BGR images.

    Where the network for many people finds nobody, or someone too large for it, it looks again
    at a smaller image.

    :ivar inference_s: seconds that the network took for the last image.
    :ivar side: of the square input of a network for one person, pixels; None for the network
        for many people.
    """

    convention = 'movenet'
    neck_measured = False

    def __init__(
        self, path: Path, *, input_size: int, min_score: float, max_people: int,
        threads: int = 0, provider: str = 'cpu',
    ) -> None:
        """
        Open the network.

        :param path: an ONNX file that `depth_person models install` has written.
        :param input_size: longer side of the network's input, pixels; a network for one person
            has its own.
        :param min_score: keypoints and people that score less are missing.
        :raises DepthPersonError: when the file is not such a network.
        """
        self._session = open_session(path, threads=threads, provider=provider)
        self.side, self._outputs = read_interface(self._session, path)
        self._min_score, self._max_people = min_score, max_people
        self._input_size = input_size if self.side is None else self.side
        self._looks_again = self.side is None and input_size > TRAINED_SIDE
        self._letterboxes: dict[tuple[int, int, int], Letterbox] = {}
        self.inference_s = 0.0

    def __call__(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """
        Return the people in an image, surest first.

        :param image: (height, width, 3) BGR.
        :returns: (n, 18, 3) COCO-18: raw pixels with centres at integers, score; NaN for a
            keypoint that is missing.
        """
        self.inference_s = 0.0
        keypoints, boxes = self.look(image, self._input_size)
        raw_per_input = max(image.shape[:2]) / self._input_size
        if self._looks_again and (
                not len(boxes) or _longer_side(boxes).max() > SUSPECT * raw_per_input):
            near, near_boxes = self.look(image, TRAINED_SIDE)
            better = _longer_side(near_boxes) > (
                TRAINED_SIDE * raw_per_input if len(boxes) else 0)
            keypoints = np.concatenate([near[better], keypoints])
            boxes = np.concatenate([near_boxes[better], boxes])
        if self.side is None:
            keypoints = keypoints[one_per_person(keypoints, boxes)]
        return from_coco17(keypoints[:self._max_people])

    def look(
        self, image: NDArray[np.uint8], input_side: int,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """
        Return whoever is found in an image, surest first; one person may come twice.

        :param image: (height, width, 3) BGR.
        :param input_side: longer side of the image in the network's input, pixels.
        :returns: (n, 17, 3) u, v, score in pixels of the image, NaN where missing, and (n, 4)
            boxes x0, y0, x1, y1.
        :raises DepthPersonError: when it is no such image, or the network gives NaN.
        """
        check_image(image)
        letterbox = self._letterbox(image, input_side)
        network_image = letterbox.fill(image)
        start = time.perf_counter()
        outputs = self._session.run(self._outputs, {INPUT: network_image})
        self.inference_s += time.perf_counter() - start
        check_finite(outputs[-1], output=self._outputs[-1], network=self._session.name)
        keypoints, boxes = self._decode(outputs)
        keypoints[..., :2] = letterbox.to_raw(keypoints[..., :2] * STRIDE)
        corners = letterbox.to_raw(boxes.reshape(-1, 2, 2) * STRIDE)
        return keypoints, corners.reshape(-1, 4)

    def _letterbox(self, image: NDArray[np.uint8], input_side: int) -> Letterbox:
        """Return the one kept for images of this size."""
        key = (image.shape[1], image.shape[0], input_side)
        if key not in self._letterboxes:
            if len(self._letterboxes) >= _MOST_LETTERBOXES:
                self._letterboxes.clear()
            self._letterboxes[key] = Letterbox(input_side, step=self.side or SIDE_STEP)
        return self._letterboxes[key]

    def _decode(
        self, outputs: Sequence[NDArray[np.float32]],
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return (n, 17, 3) x, y, score and (n, 4) boxes in cells; NaN for what is missing."""
        if self.side is None:
            keypoints, boxes = decode.decode_multi(
                *(head[0] for head in outputs), min_score=self._min_score, max_people=_CANDIDATES)
        else:
            keypoints, = outputs
            boxes = np.full((1, 4), np.nan, np.float32)
        keypoints[keypoints[..., 2] < self._min_score] = np.nan
        people = np.isfinite(keypoints[..., 2]).sum(1) >= MIN_KEYPOINTS
        return keypoints[people], boxes[people]


class Letterbox:
    """
    Fits images into the upper left of a network's input, which is reused.

    :ivar size: width and height of the image in the input.
    """

    def __init__(self, long_side: int, *, step: int) -> None:
        self._long_side, self._step = long_side, step
        self._raw_size = self.size = (0, 0)
        self._input = np.empty(0, np.uint8)

    def fill(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """
        Return the image as the network takes it, valid until the next call.

        :param image: (height, width, 3) BGR.
        :returns: (1, h, w, 3) RGB; black where the image does not reach.
        """
        height, width = image.shape[:2]
        if (width, height) != self._raw_size:
            self._resize_buffers(width, height)
        cv2.resize(image, self.size, dst=self._resized, interpolation=cv2.INTER_LINEAR)
        cv2.cvtColor(self._resized, cv2.COLOR_BGR2RGB, dst=self._view)
        return self._input

    def to_raw(self, xy: NDArray[np.float32]) -> NDArray[np.float32]:
        """
        Return where in the raw image positions in the network's input lie.

        :param xy: (..., 2) from the outer corner of the first pixel.
        :returns: (..., 2) with pixel centres at integers.
        """
        return xy * (np.array(self._raw_size) / self.size).astype(np.float32) - np.float32(0.5)

    def _resize_buffers(self, width: int, height: int) -> None:
        scale = self._long_side / max(width, height)
        self._raw_size = (width, height)
        self.size = (max(round(width * scale), 1), max(round(height * scale), 1))
        columns, rows = (-(-side // self._step) * self._step for side in self.size)
        self._input = np.zeros((1, rows, columns, 3), np.uint8)
        self._view = self._input[0, :self.size[1], :self.size[0]]
        self._resized = np.empty(self._view.shape, np.uint8)


def is_movenet(graph: Graph) -> bool:
    """Return whether a network seems to be one that depth_person writes."""
    names = {value.name for value in (*graph.inputs, *graph.outputs)}
    return {INPUT, *HEADS} <= names or {INPUT, FITTED} <= names


def read_interface(
    session: onnxruntime.InferenceSession, path: Path, *, keypoints: str = MARKED,
) -> tuple[int | None, tuple[str, ...]]:
    """
    Return the side of a network's input, None for any, and the outputs to read.

    :param keypoints: which ones a network for one person should give, MARKED or FITTED.
    :raises DepthPersonError: when it is no MoveNet that depth_person has written.
    """
    inputs = {value.name: value for value in session.get_inputs()}
    outputs = {value.name for value in session.get_outputs()}
    if (set(inputs) == {INPUT} and inputs[INPUT].type == 'tensor(uint8)'
            and len(inputs[INPUT].shape) == 4):
        side = inputs[INPUT].shape[1]
        if outputs.issuperset(HEADS + BOX_HEADS):
            return None, HEADS + BOX_HEADS
        if isinstance(side, int) and keypoints in outputs:
            return side, (keypoints,)
    raise DepthPersonError(
        f'{path} has not the input ({INPUT}) and the outputs ({MARKED}, {FITTED}; for many people '
        f'{", ".join(HEADS + BOX_HEADS)}) of a MoveNet that depth_person writes; install one: '
        'depth_person models install')


def one_per_person(
    keypoints: NDArray[np.float32], boxes: NDArray[np.float32],
) -> NDArray[np.intp]:
    """
    Return which skeletons to keep so that nobody is counted twice; earlier ones win.

    :param keypoints: (n, 17, 3) x, y, score; NaN where missing.
    :param boxes: (n, 4) x0, y0, x1, y1.
    """
    sizes = np.sqrt(np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 1), axis=1))
    points = keypoints[..., :2]
    alike = likeness(points, points, sizes, sizes, spread=_MARK_SPREAD) > _SAME_PERSON
    kept: list[int] = []
    for index in range(len(keypoints)):
        if not alike[index, kept].any():
            kept.append(index)
    return np.array(kept, np.intp)


def _longer_side(boxes: NDArray[np.float32]) -> NDArray[np.float32]:
    return (boxes[:, 2:] - boxes[:, :2]).max(axis=1)
