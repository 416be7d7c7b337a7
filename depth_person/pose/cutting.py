"""Cuts square crops out of frames, without aliasing where they shrink."""
from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import Array

#: The frame is halved, by averaging, until no crop shrinks by more than this.
_MOST_SHRINKING = 2.0
#: So many pixels around crops are made ready, too, for interpolation.
_MARGIN = 2

Image = NDArray[np.uint8]


class _Square(NamedTuple):
    """
    Where a crop lies, in numbers of Python: arrays would take longer for the few crops there are.

    :ivar x: of its centre, raw pixels.
    :ivar y: likewise.
    :ivar scale: raw pixels to one of the crop's.
    """

    x: float
    y: float
    scale: float

    @property
    def halvings(self) -> int:
        """How often the frame is halved before it is cut out."""
        return math.ceil(math.log2(max(self.scale / _MOST_SHRINKING, 1.0)))


class CropCutter:
    """
    Cuts crops of one size, into buffers that are kept.

    :param side: of the crops in their own pixels.
    """

    def __init__(self, side: int) -> None:
        self._side = side
        self._crops = np.empty((0, side, side, 3), np.uint8)
        self._warped = np.empty((side, side, 4), np.uint8)
        self._shape: tuple[int, ...] = ()
        self._buffers: dict[tuple[int, ...], Image] = {}

    def cut(self, image: Image, centres: Array, sides: Array) -> Image:
        """
        Return (n, side, side, 3) RGB crops, valid until the next call.

        :param image: (height, width, 3) BGR.
        :param centres: (n, 2) of the square crops, raw pixels; n is not 0.
        :param sides: (n,) of the crops, raw pixels; they may reach beyond the image.
        """
        if image.shape != self._shape:
            self._shape = image.shape
            self._buffers.clear()
        if len(self._crops) < len(centres):
            self._crops = np.empty((len(centres), self._side, self._side, 3), np.uint8)
        crops = self._crops[:len(centres)]
        squares = [_Square(x, y, float(side / self._side)) for (x, y), side in zip(
            centres.tolist(), sides, strict=True)]
        sources = self._halved(image, [square for square in squares if square.halvings])
        for crop, square in zip(crops, squares, strict=True):
            self._cut_one(image, sources[square.halvings], square, crop)
        return crops

    def _halved(self, image: Image, squares: list[_Square]) -> list[Image]:
        """Return an image, and it halved once, twice and so on where crops need it."""
        sources = [image]
        if not squares:
            return sources
        times = max(square.halvings for square in squares)
        rows, columns = self._needed(image, squares, 2 ** times)
        for _ in range(times):
            height, width = (max(length // 2, 1) for length in sources[-1].shape[:2])
            source = sources[-1][rows, columns]
            sources.append(self._buffer((height, width, 3)))
            rows, columns = (
                slice(part.start // 2, max(part.stop // 2, 1)) for part in (rows, columns))
            half = sources[-1][rows, columns]
            cv2.resize(source, half.shape[1::-1], dst=half, interpolation=cv2.INTER_AREA)
        return sources

    def _needed(self, image: Image, squares: list[_Square], step: int) -> tuple[slice, slice]:
        """
        Return the rows and columns of an image that crops from its halves need.

        Its halves are those of the whole image, pixel by pixel, since it begins and ends with
        pixels of the smallest. It is all of an image that is not so divided into pixels of the
        smallest.

        :param step: raw pixels to one of the smallest half.
        """
        height, width, _ = image.shape
        if height % step or width % step:
            return slice(0, height), slice(0, width)
        reach = self._side / 2
        top = min(square.y - square.scale * reach for square in squares)
        bottom = max(square.y + square.scale * reach for square in squares)
        left = min(square.x - square.scale * reach for square in squares)
        right = max(square.x + square.scale * reach for square in squares)
        return _part(top, bottom, height, step=step), _part(left, right, width, step=step)

    def _cut_one(self, image: Image, source: Image, square: _Square, crop: Image) -> None:
        """Cut a crop out of an image, or out of a half of it, which is the source then."""
        height, width, _ = source.shape
        scale_x, left = self._from_crop(square.x, square.scale, width / image.shape[1])
        scale_y, top = self._from_crop(square.y, square.scale, height / image.shape[0])
        rows = _part(top, top + scale_y * self._side, height)
        columns = _part(left, left + scale_x * self._side, width)
        # Some versions of OpenCV warp four channels in less than half the time of three.
        four = self._buffer((height, width, 4))
        cv2.cvtColor(source[rows, columns], cv2.COLOR_BGR2BGRA, dst=four[rows, columns])
        cv2.warpAffine(
            four, np.array([[scale_x, 0.0, left], [0.0, scale_y, top]]), (self._side, self._side),
            dst=self._warped, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        cv2.cvtColor(self._warped, cv2.COLOR_BGRA2RGB, dst=crop)

    def _from_crop(self, centre: float, scale: float, smaller: float) -> tuple[float, float]:
        """
        Return the pixels of a source to one of the crop's, and where the crop's first one lies.

        :param centre: of the crop, along one axis; raw pixels, as in scale.
        :param smaller: pixels of the source to a raw one.
        """
        scale *= smaller
        return scale, (centre + 0.5) * smaller - 0.5 - scale * (self._side - 1) / 2

    def _buffer(self, shape: tuple[int, ...]) -> Image:
        """Return the buffer of a shape, which is kept while frames have one size."""
        if shape not in self._buffers:
            self._buffers[shape] = np.empty(shape, np.uint8)
        return self._buffers[shape]


def _part(begin: float, end: float, length: int, *, step: int = 1) -> slice:
    """Return the part, in whole steps, of a length that interpolation from begin to end needs."""
    steps = length // step
    first = min(max(math.floor(begin / step) - _MARGIN, 0), steps - 1)
    last = max(min(math.ceil(end / step) + _MARGIN, steps), first + 1)
    return slice(first * step, last * step)
