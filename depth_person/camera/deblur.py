"""Wiener deconvolution of motion blur whose kernel is known."""
from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError


def motion_kernel(length_px: float, angle_deg: float) -> NDArray[np.float64]:
    """
    Return the kernel of a camera that moved evenly along a straight line during the exposure.

    :param length_px: of the line, pixels.
    :param angle_deg: of the line against the image's x axis, clockwise as the image is seen.
    :returns: (k, k) with k odd; its sum is 1.
    :raises DepthPersonError: for a length below one pixel, or values that are not finite.
    """
    if not (math.isfinite(angle_deg) and 1 <= length_px < math.inf):
        raise DepthPersonError(
            f'a motion of {length_px:g} px at {angle_deg:g} degrees blurs nothing; '
            'the length has to be 1 px or more')
    size = 2 * math.ceil(length_px / 2) + 3
    # Many points along the line, each shared among the four pixels round it.
    along = np.linspace(-0.5, 0.5, 16 * size + 1) * (length_px - 1)
    turn = math.radians(angle_deg)
    x, y = along * math.cos(turn) + size // 2, along * math.sin(turn) + size // 2
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    kernel = np.zeros((size, size))
    for right in (0, 1):
        for below in (0, 1):
            weight = np.abs(1 - right - (x - column)) * np.abs(1 - below - (y - row))
            np.add.at(kernel, (row + below, column + right), weight)
    return kernel / kernel.sum()


def wiener_deblur(
    image: NDArray[np.uint8], kernel: NDArray[np.float64], *, noise_to_signal: float,
) -> NDArray[np.uint8]:
    """
    Return an image with a known blur undone as far as its noise allows.

    The filter is conj(H) / (|H|^2 + noise_to_signal), H being the kernel's spectrum (Wiener 1949;
    Gonzalez and Woods, Digital Image Processing, 5.8), applied to each channel. The image is
    continued by its mirror image, which the kernel blends into the opposite border, since
    borders that do not fit ring through the whole image.

    :param image: (h, w, 3) uint8.
    :param kernel: (k, k) with k odd and a sum of 1, such as motion_kernel gives.
    :param noise_to_signal: power of the noise over that of the image; 0.01 suits good light.
    :raises DepthPersonError: when noise_to_signal is not positive: the filter may divide by zero.
    """
    if not 0 < noise_to_signal < math.inf:
        raise DepthPersonError(
            f'a noise-to-signal ratio of {noise_to_signal:g} is not positive; 0.01 is usual')
    height, width = image.shape[:2]
    border = 2 * kernel.shape[0]
    rows, columns = (cv2.getOptimalDFTSize(side + 2 * border) for side in (height, width))
    framed = cv2.copyMakeBorder(
        image, border, rows - height - border, border, columns - width - border,
        cv2.BORDER_REFLECT_101)
    spread = np.zeros((rows, columns))
    spread[:kernel.shape[0], :kernel.shape[1]] = kernel
    middle = kernel.shape[0] // 2
    spectrum = np.fft.rfft2(np.roll(spread, (-middle, -middle), axis=(0, 1)))
    inverse = np.conj(spectrum) / (np.abs(spectrum) ** 2 + noise_to_signal)
    # The filter must not darken the image: a constant has to stay as it is.
    inverse /= inverse[0, 0].real
    smooth = _filtered(framed, spectrum)
    kept = np.minimum(_ramp(rows, border)[:, None], _ramp(columns, border))[..., None]
    sharp = _filtered(smooth + kept * (framed - smooth), inverse)
    inside = sharp[border:border + height, border:border + width]
    return np.clip(np.rint(inside), 0, 255).astype(np.uint8)


def _filtered(
    image: NDArray[Any], spectrum: NDArray[Any],
) -> NDArray[np.float64]:
    """Return an image (h, w, 3), which goes on periodically, times a filter's spectrum."""
    size = image.shape[:2]
    return np.fft.irfft2(
        np.fft.rfft2(image, axes=(0, 1)) * spectrum[..., None], s=size, axes=(0, 1))


def _ramp(size: int, border: int) -> NDArray[np.float64]:
    """Return weights that rise from 0 at both ends to 1 a border away."""
    inward = np.minimum(np.arange(size), np.arange(size)[::-1])
    return np.minimum(inward / border, 1.0)
