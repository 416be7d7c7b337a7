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

from functools import lru_cache
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

#: The heat of the cells so far about the highest tells where a peak is.
_PEAK_STEPS = np.arange(-2, 3)
_NO_HEAT = np.float32(1e-9)

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
    grid = _grid(height, width)
    middle = (center.reshape(n, -1) / grid.from_middle).argmax(1)
    regressed = regression.reshape(n, 2 * N_COCO17, -1)[np.arange(n), :, middle]
    regressed = regressed.reshape(n, N_COCO17, 2)
    regressed += grid.cells[middle][:, None]
    distance = np.square(grid.rows - regressed[..., :1])[..., None] + np.square(
        grid.columns - regressed[..., 1:])[..., None, :]
    np.sqrt(distance, out=distance)
    distance += np.float32(_SINGLE_SOFTENING)
    weighted = np.divide(heatmap, distance, out=distance).reshape(n, N_COCO17, -1)
    marked = weighted.argmax(2)
    crop = np.arange(n)[:, None]
    place = grid.cells[marked] + offset.reshape(n, N_COCO17, 2, -1)[crop, _KEYPOINTS, :, marked]
    heat = heatmap.reshape(weighted.shape)
    if fit_peaks:
        place = (place + _centres_of_heat(heat, marked, grid)) / 2
    keypoints = np.empty((n, N_COCO17, 3), np.float32)
    keypoints[..., 1::-1] = place
    keypoints[..., 2] = heat[crop, _KEYPOINTS, marked]
    return keypoints


class _Grid:
    """
    What follows from the size of heads alone; cells are counted row after row.

    :ivar rows: (h,) the numbers of the rows; of the columns likewise.
    :ivar cells: (h w, 2) row and column of each cell.
    :ivar from_middle: (h w,) their distance from the middle of the image, softened.
    :ivar around: (h w, 25) the cells around each; where there is none, any.
    :ivar inside: (h w, 25) 1 where there is one, else 0.
    """

    def __init__(self, height: int, width: int) -> None:
        self.rows, self.columns = (np.arange(side, dtype=np.float32) for side in (height, width))
        self.from_middle = (_SINGLE_SOFTENING + np.hypot(
            (self.rows - height / 2)[:, None], self.columns - width / 2)).ravel()
        cells = np.indices((height, width)).reshape(2, -1).T
        self.cells = cells.astype(float)
        steps = np.stack(np.meshgrid(_PEAK_STEPS, _PEAK_STEPS, indexing='ij'), 2).reshape(-1, 2)
        around = cells[:, None] + steps
        inside = ((around >= 0) & (around < (height, width))).all(2)
        self.around = np.where(inside, around @ (width, 1), 0)
        self.inside = inside.astype(np.float32)


_grid = lru_cache(_Grid)


def _centres_of_heat(heat: Array, marked: NDArray[np.intp], grid: _Grid) -> NDArray[np.float64]:
    """Return y, x (n, 17, 2) of the centre of the heat around cells, from the first's corner."""
    crop = np.arange(len(heat))[:, None, None]
    near = heat[crop, _KEYPOINTS[:, None], grid.around[marked]] * grid.inside[marked]
    near /= np.maximum(near.sum(2, keepdims=True), _NO_HEAT)
    near = near.reshape(*marked.shape, len(_PEAK_STEPS), len(_PEAK_STEPS))
    sums = np.empty((*marked.shape, 2, len(_PEAK_STEPS)), np.float32)
    near.sum(3, out=sums[:, :, 0])
    near.sum(2, out=sums[:, :, 1])
    places = grid.cells[marked][..., None] + _PEAK_STEPS
    return (sums * places).sum(3) + 0.5


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
