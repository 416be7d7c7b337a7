"""Peaks of heat maps, between the cells."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

#: Where two neighbouring cells share a peak, the upper, or the left, has it.
_BEFORE = np.array([[1, 1, 1], [1, 0, 0], [0, 0, 0]], np.uint8)
_ALL = np.ones((3, 3), np.uint8)
#: Logarithms are taken of no less.
_LEAST = np.float32(1e-6)


@dataclass(frozen=True, eq=False)
class Peaks:
    """
    Peaks of several heat maps, those of the first map first, each map's highest first.

    :ivar maps: (n,) the map that each is of.
    :ivar points: (n, 2) x, y in cells, their centres at integers.
    :ivar scores: (n,) the heat at the highest cell, at most 1.
    """

    maps: NDArray[np.intp]
    points: Array
    scores: Array


def find_peaks(heat: Array, *, min_score: float, per_map: int = 64) -> Peaks:
    """
    Return the peaks of heat maps, with sub-cell positions.

    Networks are trained on Gaussians, whose logarithm is a parabola: the peak of the parabola
    through the highest cell and its two neighbours is exact, in x and y each.

    :param heat: (h, w, maps).
    :param min_score: peaks that are lower are none.
    :param per_map: the highest so many are kept.
    """
    heat = np.ascontiguousarray(heat)
    padded = np.pad(heat, ((1, 1), (1, 1), (0, 0)), constant_values=-np.inf)
    highest = _dilated(padded, _ALL)
    before = _dilated(padded, _BEFORE)
    found = np.nonzero((heat >= highest) & (heat > before) & (heat >= min_score))
    order = np.lexsort((-heat[found], found[2]))
    starts = np.searchsorted(found[2][order], np.arange(heat.shape[2]))
    order = order[np.arange(len(order)) - starts[found[2][order]] < per_map]
    rows, columns, maps = (each[order] for each in found)
    scores = heat[rows, columns, maps]
    x = columns + _offsets(heat, rows, columns, maps, step=(0, 1))
    y = rows + _offsets(heat, rows, columns, maps, step=(1, 0))
    return Peaks(maps, np.stack([x, y], 1).astype(np.float32), np.minimum(scores, 1))


def _dilated(padded: Array, kernel: NDArray[np.uint8]) -> Array:
    """Return the highest of each cell's neighbours, map by map."""
    dilated = cv2.dilate(padded, kernel)
    return dilated.reshape(padded.shape)[1:-1, 1:-1]


def _offsets(
    heat: Array, rows: NDArray[np.intp], columns: NDArray[np.intp], maps: NDArray[np.intp], *,
    step: tuple[int, int],
) -> Array:
    """Return how far peaks lie from their cells in one direction; 0 at the edge of the map."""
    down, right = step
    last_row, last_column = heat.shape[0] - 1, heat.shape[1] - 1
    edge = (rows < down) | (columns < right) | (rows + down > last_row) | (
        columns + right > last_column)
    rows, columns = np.where(edge, down, rows), np.where(edge, right, columns)
    if last_row < 2 * down or last_column < 2 * right:
        return np.zeros(len(maps), np.float32)
    low, middle, high = (
        np.log(np.maximum(heat[rows + sign * down, columns + sign * right, maps], _LEAST))
        for sign in (-1, 0, 1))
    curvature = low - 2 * middle + high
    curved = ~edge & (curvature < 0)
    offsets = (low - high) / (2 * np.where(curved, curvature, -1))
    return np.where(curved, np.clip(offsets, -0.5, 0.5), 0).astype(np.float32)
