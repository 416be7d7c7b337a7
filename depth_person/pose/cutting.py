"""Cuts square crops out of frames, without aliasing where they shrink."""
from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.pose.bodies import Array

#: A frame is shrunk by a power of two, by averaging, so that no crop shrinks further by more.
_MOST_SHRINKING = 2

Image = NDArray[np.uint8]


class Crops(NamedTuple):
    """
    Crops of a frame; they may reach beyond it, where they are black.

    :ivar images: (n, side, side, 3) RGB, valid until the next are cut.
    :ivar centres: (n, 2) raw pixels.
    :ivar sides: (n,) raw pixels.
    """

    images: Image
    centres: Array
    sides: Array


class CropCutter:
    """
    Cuts crops of one size, into buffers that are kept.

    :param side: of the crops in their own pixels.
    """

    def __init__(self, side: int) -> None:
        self._side = side
        self._crops = np.empty((0, side, side, 3), np.uint8)
        self._resized = np.empty((side, side, 3), np.uint8)
        self._canvas = np.empty((_MOST_SHRINKING * side, _MOST_SHRINKING * side, 3), np.uint8)

    def cut(self, image: Image, centres: Array, sides: Array) -> Crops:
        """
        Return crops where they are wanted; those that shrink, to whole pixels.

        They are pixels of the frame, or of what it is shrunk to.

        :param image: (height, width, 3) BGR.
        :param centres: (n, 2) of the square crops, raw pixels.
        :param sides: (n,) of the crops, raw pixels.
        """
        if len(self._crops) < len(centres):
            self._crops = np.empty((len(centres), self._side, self._side, 3), np.uint8)
        crops = self._crops[:len(centres)]
        places = np.column_stack([centres, sides])
        for crop, place in zip(crops, places, strict=True):
            (self._enlarge if place[2] < self._side else self._shrink)(image, place)
            cv2.cvtColor(self._resized, cv2.COLOR_BGR2RGB, dst=crop)
        return Crops(crops, places[:, :2], places[:, 2])

    def _enlarge(self, image: Image, place: Array) -> None:
        """Cut out what lies at a place: x and y of its centre, its side."""
        x, y, side = place.tolist()
        scale = side / self._side
        reach = scale * (self._side - 1) / 2
        cv2.warpAffine(
            image, np.array([[scale, 0, x - reach], [0, scale, y - reach]]),
            (self._side, self._side), dst=self._resized,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)

    def _shrink(self, image: Image, place: Array) -> None:
        """Cut out what lies about at a place, and let it say where that is."""
        x, y, side = place.tolist()
        times = 2 ** math.ceil(math.log2(max(side / (_MOST_SHRINKING * self._side), 1)))
        length = round(side / times)
        left, top = (
            math.floor((centre + 0.5) / times - length / 2 + 0.5) for centre in (x, y))
        cv2.resize(self._shrunk(image, left, top, length, times), (self._side, self._side),
                   dst=self._resized)
        place[:] = (
            times * (left + length / 2) - 0.5, times * (top + length / 2) - 0.5, times * length)

    def _shrunk(self, image: Image, left: int, top: int, length: int, times: int) -> Image:
        """Return a square of an image shrunk so many times, told in the shrunk one's pixels."""
        height, width = (size // times for size in image.shape[:2])
        rows, columns = _overlap(top, length, height), _overlap(left, length, width)
        part = image[rows.start * times:rows.stop * times,
                     columns.start * times:columns.stop * times]
        whole = (rows.stop - rows.start, columns.stop - columns.start) == (length, length)
        if whole and times == 1:
            return part
        square = self._canvas[:length, :length]
        above, left_of = rows.start - top, columns.start - left
        inside = square[above:rows.stop - top, left_of:columns.stop - left]
        if part.size:
            cv2.resize(part, inside.shape[1::-1], dst=inside, interpolation=cv2.INTER_AREA)
        for beyond in (square[:above], square[rows.stop - top:], square[:, :left_of],
                       square[:, columns.stop - left:]):
            beyond.fill(0)
        return square


def _overlap(begin: int, length: int, size: int) -> slice:
    """Return which of so many pixels a stretch of so great a length covers."""
    first = min(max(begin, 0), size)
    return slice(first, max(min(begin + length, size), first))
