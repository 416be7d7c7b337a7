"""Cuts square crops out of frames, without aliasing where they shrink."""
from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import Array

#: The frame is halved, by averaging, until no crop shrinks by more than this.
_MOST_SHRINKING = 2.0
#: So many pixels of the smallest half are made around the crops, too, for interpolation.
_MARGIN = 2


class CropCutter:
    """
    Cuts crops of one size, into buffers that are kept.

    :param side: of the crops in their own pixels.
    """

    def __init__(self, side: int) -> None:
        self._side = side
        self._crops = np.empty((0, side, side, 3), np.uint8)
        self._halves: list[NDArray[np.uint8]] = []

    def cut(self, image: NDArray[np.uint8], centres: Array, sides: Array) -> NDArray[np.uint8]:
        """
        Return (n, side, side, 3) RGB crops, valid until the next call.

        :param image: (height, width, 3) BGR.
        :param centres: (n, 2) of the square crops, raw pixels; n is not 0.
        :param sides: (n,) of the crops, raw pixels; they may reach beyond the image.
        """
        if len(self._crops) < len(centres):
            self._crops = np.empty((len(centres), self._side, self._side, 3), np.uint8)
        crops = self._crops[:len(centres)]
        halvings = np.ceil(
            np.log2(np.maximum(sides / (self._side * _MOST_SHRINKING), 1))).astype(int)
        large = halvings > 0
        sources = self._halved(image, centres[large], sides[large], int(halvings.max()))
        for crop, centre, side, times in zip(crops, centres, sides, halvings, strict=True):
            source = sources[times]
            cv2.warpAffine(
                source, self._from_crop(centre, side, source, image), (self._side, self._side),
                dst=crop, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
            cv2.cvtColor(crop, cv2.COLOR_BGR2RGB, dst=crop)
        return crops

    def _halved(
        self, image: NDArray[np.uint8], centres: Array, sides: Array, times: int,
    ) -> list[NDArray[np.uint8]]:
        """Return an image, and it halved once, twice and so on where crops need it."""
        sources = [image]
        if not times:
            return sources
        low, high = _needed(image, centres, sides, times)
        for index in range(times):
            height, width = (max(length // 2, 1) for length in sources[-1].shape[:2])
            if index == len(self._halves) or self._halves[index].shape[:2] != (height, width):
                self._halves[index:] = [np.empty((height, width, 3), np.uint8)]
            sources.append(self._halves[index])
            source = sources[-2][low[1]:high[1], low[0]:high[0]]
            low, high = low // 2, np.maximum(high // 2, 1)
            half = sources[-1][low[1]:high[1], low[0]:high[0]]
            cv2.resize(source, half.shape[1::-1], dst=half, interpolation=cv2.INTER_AREA)
        return sources

    def _from_crop(
        self, centre: Array, side: np.float32, source: NDArray[np.uint8],
        image: NDArray[np.uint8],
    ) -> NDArray[np.float64]:
        """Return the matrix (2, 3) from pixels of the crop to those of the source."""
        smaller = np.array(source.shape[1::-1]) / image.shape[1::-1]
        scale = smaller * (side / self._side)
        middle = (centre.astype(np.float64) + 0.5) * smaller - 0.5
        corner = middle - scale * (self._side - 1) / 2
        return np.array([[scale[0], 0.0, corner[0]], [0.0, scale[1], corner[1]]])


def _needed(
    image: NDArray[np.uint8], centres: Array, sides: Array, times: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """
    Return x, y where the part of an image begins and ends that crops from its halves need.

    Its halves are those of the whole image, pixel by pixel, since it begins and ends with pixels
    of the smallest. It is all of an image that is not so divided into pixels of the smallest.
    """
    size, step = np.array(image.shape[1::-1]), 2 ** times
    if (size % step).any():
        return np.zeros_like(size), size
    reach = sides[:, None] / 2
    low = np.floor((centres - reach).min(0) / step).astype(int) - _MARGIN
    high = np.ceil((centres + reach).max(0) / step).astype(int) + _MARGIN
    low = np.clip(low, 0, size // step - 1)
    return low * step, np.clip(high, low + 1, size // step) * step
