"""Affine maps from raw images to what networks see, and back."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def letterbox_matrix(raw_size: tuple[int, int], size: tuple[int, int]) -> Matrix:
    """
    Return the matrix (2, 3) that fits an image into the upper left of another.

    :param raw_size: width and height.
    :param size: width and height to fit it into.
    """
    scale = min(size[0] / raw_size[0], size[1] / raw_size[1])
    half_pixel = (scale - 1) / 2
    return np.array([[scale, 0.0, half_pixel], [0.0, scale, half_pixel]])


def crop_matrices(
    centres: NDArray[np.floating], widths: NDArray[np.floating], size: tuple[int, int], *,
    angles: NDArray[np.floating] | float = 0.0,
) -> Matrix:
    """
    Return the matrices (n, 2, 3) that cut crops out of an image.

    As in the top-down affine transform of mmpose and MediaPipe, the centre falls on the middle
    of the crop counted from the centre of its first pixel.

    :param centres: (n, 2) raw pixels.
    :param widths: (n,) of the crops, raw pixels.
    :param size: width and height of the crops in their own pixels.
    :param angles: (n,) by which the image is turned clockwise, radians.
    """
    scale = size[0] / widths
    cos, sin = scale * np.cos(angles), scale * np.sin(angles)
    linear = np.moveaxis(np.array([[cos, -sin], [sin, cos]]), 2, 0)
    shift = np.array(size) / 2 - np.einsum('nij,nj->ni', linear, centres)
    return np.concatenate([linear, shift[..., None]], axis=2)


def to_raw(matrices: Matrix, points: NDArray[np.floating]) -> NDArray[np.float32]:
    """
    Return where points of warped images lie in the raw one.

    :param matrices: (n, 2, 3) from raw pixels.
    :param points: (n, k, 2).
    """
    inverse = np.linalg.inv(matrices[:, :, :2])
    apart = points - matrices[:, None, :, 2]
    return np.einsum('nij,nkj->nki', inverse, apart).astype(np.float32)


def fitted_size(raw_size: tuple[int, int], long_side: int, *, step: int) -> tuple[int, int]:
    """
    Return the size, in multiples of a step, that holds an image scaled to a longer side.

    :param raw_size: width and height of the image.
    """
    scale = long_side / max(raw_size)
    width, height = (max(round(side * scale), 1) for side in raw_size)
    return -(-width // step) * step, -(-height // step) * step
