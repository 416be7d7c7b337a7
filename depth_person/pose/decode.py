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
#: The single-person graphs divide scores by the distance in cells plus this.
_SINGLE_SOFTENING = 1.7998047

#: The heat within so many cells of the highest tells where a peak is.
_PEAK_REACH = 2

_KEYPOINTS = np.arange(N_COCO17)

Array = NDArray[np.float32]


def decode_single(center: Array, regression: Array, heatmap: Array, offset: Array) -> Array:
    """
    Return the one person whose centre is nearest the middle of the image and surest.

    :param center: (1, h, w) scores.
    :param regression: (34, h, w) from the centre.
    :param heatmap: (17, h, w) scores.
    :param offset: (34, h, w) from the cell.
    :returns: (17, 3) x, y, score, as the original graph marks them.
    """
    heads = (head[None] for head in (center, regression, heatmap, offset))
    return decode_crops(*heads, fit_peaks=False)[0]


def decode_crops(
    center: Array, regression: Array, heatmap: Array, offset: Array, *, fit_peaks: bool = True,
) -> Array:
    """
    Return the one person of each crop, the surest near its middle.

    A peak is fitted by the mean of two estimates whose errors differ: the cell with its offset,
    and the centre of the heat around it.

    :param center: (n, 1, h, w) scores; the others likewise as in decode_single.
    :param fit_peaks: otherwise the highest cell and its offset mark a keypoint.
    :returns: (n, 17, 3) x, y, score.
    """
    n, _, height, width = center.shape
    rows, columns = (np.arange(size, dtype=np.float32) for size in (height, width))
    from_middle = np.hypot((rows - height / 2)[:, None], columns - width / 2)
    weighted = center[:, 0] / (from_middle + _SINGLE_SOFTENING)
    row, column = np.divmod(weighted.reshape(n, -1).argmax(1), width)
    regressed = regression[np.arange(n), :, row, column].reshape(n, N_COCO17, 2)
    y, x = np.moveaxis(regressed + np.stack([row, column], 1)[:, None].astype(np.float32), 2, 0)
    distance = np.square(rows - y[..., None])[..., None] + np.square(
        columns - x[..., None])[..., None, :]
    np.sqrt(distance, out=distance)
    distance += np.float32(_SINGLE_SOFTENING)
    weighted = np.divide(heatmap, distance, out=distance).reshape(n, N_COCO17, -1)
    row, column = np.divmod(weighted.argmax(2), width)
    crop = np.arange(n)[:, None]
    y = row + offset[crop, 2 * _KEYPOINTS, row, column]
    x = column + offset[crop, 2 * _KEYPOINTS + 1, row, column]
    if fit_peaks:
        heat_y, heat_x = _centres_of_heat(heatmap, row, column)
        y, x = (y + heat_y) / 2, (x + heat_x) / 2
    score = heatmap[crop, _KEYPOINTS, row, column]
    return np.stack([x, y, score], -1).astype(np.float32)


def _centres_of_heat(
    heatmap: Array, row: NDArray[np.intp], column: NDArray[np.intp],
) -> tuple[Array, Array]:
    """Return y, x (n, 17) of the centre of the heat around cells, from the corner of the first."""
    steps = np.arange(-_PEAK_REACH, _PEAK_REACH + 1)
    y, x = row[..., None] + steps, column[..., None] + steps
    height, width = heatmap.shape[2:]
    inside = ((y >= 0) & (y < height))[..., :, None] & ((x >= 0) & (x < width))[..., None, :]
    crop, keypoint = np.arange(len(heatmap))[:, None, None, None], _KEYPOINTS[:, None, None]
    heat = heatmap[
        crop, keypoint, np.clip(y, 0, height - 1)[..., None],
        np.clip(x, 0, width - 1)[..., None, :]] * inside
    heat = heat / np.maximum(heat.sum((2, 3), keepdims=True), 1e-9)
    half = np.float32(0.5)
    return (heat.sum(3) * y).sum(2) + half, (heat.sum(2) * x).sum(2) + half


def decode_multi(
    center: Array, regression: Array, heatmap: Array, offset: Array, box_scale: Array,
    box_offset: Array, *, min_score: float, max_people: int,
) -> tuple[Array, Array]:
    """
    Return everyone whose centre is a peak, surest first; one person may still come twice.

    Keypoints that score min_score or more are those of the original graph; below, the search may
    have ended before the best.

    :param center: (1, h, w) scores; the next three heads as in decode_single.
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
