"""
Turns the raw heads of the MoveNet for many people into keypoints.

MoveNet follows CenterNet (Zhou et al., "Objects as Points", 2019): a heat map of person centres,
at each centre the offsets to the person's 17 keypoints, and for each kind of keypoint a heat map
and a sub-cell offset that mark it exactly. The regressed position says which of the peaks of the
heat map is this person's. The weights given to the distance between the two are those of the
original graphs.

All heads are (channels, rows, columns); pairs of channels hold y before x, in cells. Positions
are returned in cells from the outer corner of the first cell, so that they scale with the image.
"""
from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

N_COCO17 = 17

#: A person's centre is the highest within this many cells, as in the original graph.
_PEAK_WINDOW = np.ones((5, 5), np.uint8)
#: Variance of the distance between regressed and marked position, over half the shorter side.
_SPREAD_OF_SIDE = 0.30004883
#: No crowd has more; keeps the work on an image of noise within limits.
_MAX_PEAKS = 200
#: A keypoint that scores less says nothing of how sure its person is.
_COUNTED_SCORE = 0.12695312

_KEYPOINTS = np.arange(N_COCO17)

Array = NDArray[np.float32]


def decode_multi(
    center: Array, regression: Array, heatmap: Array, offset: Array, box_scale: Array,
    box_offset: Array, *, min_score: float, max_people: int,
) -> tuple[Array, Array]:
    """
    Return everyone whose centre is a peak, surest first; one person may still come twice.

    Keypoints that score min_score or more are those of the original graph; below, the search may
    have ended before the best.

    :param center: (1, h, w) scores.
    :param regression: (34, h, w) from the centre.
    :param heatmap: (17, h, w) scores.
    :param offset: (34, h, w) from the cell.
    :param box_scale: (2, h, w) height and width of the person.
    :param box_offset: (2, h, w) from the cell to the middle of the person's box.
    :returns: (n, 17, 3) x, y, score, and (n, 4) boxes x0, y0, x1, y1.
    """
    rows, columns = _peaks(center[0], min_score=min_score)
    cells = np.stack([rows, columns], 1).astype(np.float32)
    middle = cells + box_offset[:, rows, columns].T
    half = np.maximum(box_scale[:, rows, columns].T, 0) / 2
    sides = np.array(center.shape[1:], np.float32)
    low, high = np.clip(middle - half, 0, sides), np.clip(middle + half, 0, sides)
    regressed = regression[:, rows, columns].T.reshape(-1, N_COCO17, 2) + cells[:, None]
    marked, score = _search(heatmap, regressed, low, high, min_score=min_score)
    keypoints = _at_cells(
        np.broadcast_to(_KEYPOINTS, score.shape), marked[..., 0], marked[..., 1], offset, score)
    counted = score > _COUNTED_SCORE
    sureness = np.where(counted, score, 0).sum(1) / np.maximum(counted.sum(1), 1)
    order = np.argsort(-sureness * center[0, rows, columns], kind='stable')[:max_people]
    boxes = np.concatenate([low[:, ::-1], high[:, ::-1]], 1)
    return keypoints[order], boxes[order]


def _peaks(center: Array, *, min_score: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of the highest peaks, at most _MAX_PEAKS."""
    highest = cv2.dilate(np.ascontiguousarray(center), _PEAK_WINDOW)
    rows, columns = np.nonzero((center >= highest) & (center >= min_score))
    order = np.argsort(-center[rows, columns], kind='stable')[:_MAX_PEAKS]
    return rows[order], columns[order]


def _search(
    heatmap: Array, regressed: Array, low: Array, high: Array, *, min_score: float,
) -> tuple[NDArray[np.intp], Array]:
    """
    Return the cell that marks each keypoint best, and its score.

    Best is the product of the heat map and a Gaussian around the regressed position, within the
    person's box.

    :param regressed: (n, 17, 2) y, x.
    :param low: (n, 2) y, x where the boxes start; high, where they end.
    :returns: (n, 17, 2) row, column, and (n, 17) scores.
    """
    sides = np.array(heatmap.shape[1:])
    spread = _SPREAD_OF_SIDE * sides.min()
    # Beyond this the Gaussian alone is below min_score, and no heat exceeds 1.
    reach = 1 + math.ceil(math.sqrt(spread * -math.log(max(min_score, 1e-6))))
    steps = np.arange(-reach, reach + 1)
    window = np.rint(regressed).astype(np.intp)[..., None] + steps  # (n, 17, 2, steps)
    weight = np.exp(-(window - regressed[..., None]) ** 2 / np.float32(spread))
    weight *= (window >= low[:, None, :, None]) & (window < high[:, None, :, None])
    window = np.clip(window, 0, (sides - 1)[:, None])
    near = heatmap[_KEYPOINTS[:, None, None], window[:, :, 0, :, None], window[:, :, 1, None, :]]
    near = near * weight[:, :, 0, :, None] * weight[:, :, 1, None, :]
    near = near.reshape(*near.shape[:2], steps.size ** 2)
    best = near.argmax(2)[..., None]
    score = np.take_along_axis(near, best, 2)[..., 0]
    best_steps = np.stack(np.divmod(best, steps.size), 2)  # (n, 17, 2, 1)
    return np.take_along_axis(window, best_steps, 3)[..., 0], score


def _at_cells(
    keypoints: NDArray[np.intp], rows: NDArray[np.intp], columns: NDArray[np.intp],
    offset: Array, score: Array,
) -> Array:
    """Return x, y, score of keypoints marked at cells, with their sub-cell offsets."""
    y = rows + offset[2 * keypoints, rows, columns]
    x = columns + offset[2 * keypoints + 1, rows, columns]
    return np.stack([x, y, score], -1).astype(np.float32)
