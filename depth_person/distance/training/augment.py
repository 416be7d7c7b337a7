"""Augmentation for users who train on images of their own: brightness, shift and scale."""
from __future__ import annotations

from dataclasses import dataclass, replace
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError


@dataclass(frozen=True, eq=False)
class AnnotatedImage:
    """
    An image with what is marked in it.

    :ivar image: (h, w, 3) uint8.
    :ivar keypoints: (n, k, 3): u, v, score; NaN where missing.
    :ivar boxes: (n, 4): x0, y0, x1, y1.
    :ivar intrinsics: of the image. Shift and scale move them with it, so the distances of the
        people stay true for a model that takes angles. A model that takes pixels of one camera
        (`paper`) knows nothing of them: for it a person scaled by s is s times as near.
    """

    image: NDArray[np.uint8]
    keypoints: NDArray[np.float64]
    boxes: NDArray[np.float64]
    intrinsics: Intrinsics


def brightened(example: AnnotatedImage, *, gain: float, offset: float = 0.0) -> AnnotatedImage:
    """Return the image with every value times gain plus offset, cut off at 0 and 255."""
    if not (0 < gain < math.inf and math.isfinite(offset)):
        raise DepthPersonError(
            f'a gain of {gain:g} with an offset of {offset:g} is no brightness; the gain has to '
            'be positive')
    table = np.clip(np.rint(np.arange(256) * gain + offset), 0, 255).astype(np.uint8)
    return replace(example, image=cv2.LUT(example.image, table))


def shifted(example: AnnotatedImage, *, right: float, down: float = 0.0) -> AnnotatedImage:
    """
    Return the image moved by so many pixels; what it uncovers is black.

    Keypoints that leave it are missing; boxes go on beyond its border.
    """
    return _mapped(example, 1.0, (right, down))


def scaled(example: AnnotatedImage, *, factor: float) -> AnnotatedImage:
    """Return the image enlarged about its centre, in its old size: a zoom."""
    if not 0 < factor < math.inf:
        raise DepthPersonError(f'a scale of {factor:g} is not positive')
    height, width = example.image.shape[:2]
    return _mapped(
        example, factor, ((1 - factor) * (width - 1) / 2, (1 - factor) * (height - 1) / 2))


def _mapped(
    example: AnnotatedImage, factor: float, offset: tuple[float, float],
) -> AnnotatedImage:
    """Return the example with every pixel p at factor * p + offset."""
    height, width = example.image.shape[:2]
    matrix = np.array([[factor, 0, offset[0]], [0, factor, offset[1]]])
    keypoints = np.array(example.keypoints, np.float64)
    keypoints[..., :2] = factor * keypoints[..., :2] + offset
    with np.errstate(invalid='ignore'):
        inside = ((keypoints[..., :2] >= -0.5)
                  & (keypoints[..., :2] < (width - 0.5, height - 0.5))).all(axis=-1)
    camera = example.intrinsics
    return AnnotatedImage(
        image=cv2.warpAffine(example.image, matrix, (width, height)),
        keypoints=np.where(np.expand_dims(inside, -1), keypoints, np.nan),
        boxes=factor * np.asarray(example.boxes, np.float64) + np.tile(offset, 2),
        intrinsics=replace(
            camera, fx=factor * camera.fx, fy=factor * camera.fy,
            cx=factor * camera.cx + offset[0], cy=factor * camera.cy + offset[1]))
