"""
Turns the raw heads of MoveNet into keypoints.

MoveNet follows CenterNet (Zhou et al., "Objects as Points", 2019): a heat map of person centres,
at each centre the offsets to the person's 17 keypoints, and for each kind of keypoint a heat map
and a sub-cell offset that mark it exactly. The regressed position says which of the peaks of the
heat map is this person's. The weights given to the distance between the two are those of the
original graphs.

All heads are (channels, rows, columns); pairs of channels hold y before x, in cells. Positions
are returned in cells from the outer corner of the first cell, so that they scale with the image.
"""
from __future__ import annotations

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray

N_COCO17 = 17

#: A person's centre is the highest within this many cells, as in the original graph.
_PEAK_WINDOW = np.ones((5, 5), np.uint8)
#: Variance of the distance between regressed and marked position, over half the shorter side.
_SPREAD_OF_SIDE = 0.30004883
#: A keypoint that scores less says nothing of how sure its person is.
_COUNTED_SCORE = 0.12695312
#: The single-person graphs divide scores by the distance in cells plus this.
_SINGLE_SOFTENING = 1.7998047

_KEYPOINTS = np.arange(N_COCO17)

Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Skeletons:
    """
    People in the cells of the heads.

    :ivar keypoints: (n, 17, 3) x, y, score, in the order of COCO-17.
    :ivar scores: (n,) how sure each person is, falling.
    :ivar boxes: (n, 4) x0, y0, x1, y1.
    """

    keypoints: Array
    scores: Array
    boxes: Array


def decode_single(center: Array, regression: Array, heatmap: Array, offset: Array) -> Array:
    """
    Return the one person whose centre is nearest the middle of the image and surest.

    :param center: (1, h, w) scores.
    :param regression: (34, h, w) from the centre.
    :param heatmap: (17, h, w) scores.
    :param offset: (34, h, w) from the cell.
    :returns: (17, 3) x, y, score.
    """
    rows, columns = (np.arange(size, dtype=np.float32) for size in center.shape[1:])
    from_middle = np.hypot((rows - len(rows) / 2)[:, None], columns - len(columns) / 2)
    weighted = center[0] / (from_middle + _SINGLE_SOFTENING)
    row, column = np.unravel_index(weighted.argmax(), weighted.shape)
    regressed = regression[:, row, column].reshape(N_COCO17, 2) + np.array([row, column], np.float32)
    y, x = regressed.T
    distance = np.hypot(
        (rows - y[:, None])[:, :, None], (columns - x[:, None])[:, None, :])
    weighted = (heatmap / (distance + _SINGLE_SOFTENING)).reshape(N_COCO17, -1)
    row, column = np.unravel_index(weighted.argmax(1), center.shape[1:])
    return _at_cells(_KEYPOINTS, row, column, offset, heatmap[_KEYPOINTS, row, column])


def decode_multi(
    center: Array, regression: Array, heatmap: Array, offset: Array, box_scale: Array,
    box_offset: Array, *, min_score: float, max_people: int,
) -> Skeletons:
    """
    Return everyone whose centre is a peak, surest first; one person may still come twice.

    Keypoints that score min_score or more are what the original graph finds; below, the search
    may have ended before the highest.

    :param center: (1, h, w) scores; the other heads as in decode_single.
    :param box_scale: (2, h, w) height and width of the person.
    :param box_offset: (2, h, w) from the cell to the middle of the person's box.
    """
    rows, columns = _peaks(center[0], min_score=min_score, at_most=max_people)
    cells = np.stack([rows, columns], 1).astype(np.float32)
    regressed = regression[:, rows, columns].T.reshape(-1, N_COCO17, 2) + cells[:, None]
    middle = cells + box_offset[:, rows, columns].T
    half = np.maximum(box_scale[:, rows, columns].T, 0) / 2
    limits = np.array(center.shape[1:], np.float32)
    low, high = (np.clip(middle + sign * half, 0, limits) for sign in (-1, 1))

    spread = _SPREAD_OF_SIDE * min(center.shape[1:])
    # Beyond this the weight alone is below min_score, and no score exceeds 1.
    reach = 1 + math.ceil(math.sqrt(spread * -math.log(max(min_score, 1e-6))))
    steps = np.arange(-reach, reach + 1)
    window = np.rint(regressed).astype(np.intp)[..., None] + steps  # (n, 17, 2, steps)
    weight = np.exp(-(window - regressed[..., None]) ** 2 / spread)
    weight *= (window >= low[:, None, :, None]) & (window < high[:, None, :, None])
    np.clip(window, 0, (limits - 1).astype(np.intp)[:, None], out=window)
    near = heatmap[
        _KEYPOINTS[:, None, None], window[:, :, 0, :, None], window[:, :, 1, None, :]]
    near = near * weight[:, :, 0, :, None] * weight[:, :, 1, None, :]
    near = near.reshape(*near.shape[:2], len(steps) ** 2)
    best = near.argmax(2)[..., None]
    score = np.take_along_axis(near, best, 2)[..., 0]
    best_row, best_column = np.divmod(best, len(steps))
    keypoints = _at_cells(
        np.broadcast_to(_KEYPOINTS, score.shape),
        np.take_along_axis(window[:, :, 0], best_row, 2)[..., 0],
        np.take_along_axis(window[:, :, 1], best_column, 2)[..., 0], offset, score)
    counted = score > _COUNTED_SCORE
    mean = np.where(counted, score, 0).sum(1) / np.maximum(counted.sum(1), 1)
    people = center[0, rows, columns] * mean
    order = np.argsort(-people, kind='stable')
    boxes = np.concatenate([low[:, ::-1], high[:, ::-1]], 1)
    return Skeletons(keypoints[order], people[order].astype(np.float32), boxes[order])


def _peaks(
    center: Array, *, min_score: float, at_most: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    highest = cv2.dilate(np.ascontiguousarray(center), _PEAK_WINDOW)
    rows, columns = np.nonzero((center >= highest) & (center >= min_score))
    order = np.argsort(-center[rows, columns], kind='stable')[:at_most]
    return rows[order], columns[order]


def _at_cells(
    keypoints: NDArray[np.intp], rows: NDArray[np.intp], columns: NDArray[np.intp],
    offset: Array, score: Array,
) -> Array:
    """Return x, y, score of keypoints marked at cells, with their sub-cell offsets."""
    y = rows + offset[2 * keypoints, rows, columns]
    x = columns + offset[2 * keypoints + 1, rows, columns]
    return np.stack([x, y, score], -1).astype(np.float32)
