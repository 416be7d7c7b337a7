"""Heads of MoveNet as a network would give them for people at known places."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: A person in cells, about the centre: COCO-17 x, y.
FIGURE = np.array([
    [0.3, -9.2], [0.8, -9.7], [-0.4, -9.6], [1.5, -9.3], [-1.2, -9.4], [2.9, -6.1], [-2.8, -6.3],
    [3.7, -2.6], [-3.6, -2.4], [3.9, 0.7], [-4.1, 0.6], [1.6, 0.4], [-1.5, 0.3], [1.8, 5.2],
    [-1.7, 5.1], [1.9, 9.6], [-1.8, 9.7]], np.float32)


class DrawnHeads:
    """Empty heads of so many rows and columns of cells; people are drawn into them."""

    def __init__(self, rows: int, columns: int) -> None:
        self.center = np.zeros((1, rows, columns), np.float32)
        self.regression = np.zeros((34, rows, columns), np.float32)
        self.heatmap = np.zeros((17, rows, columns), np.float32)
        self.offset = np.zeros((34, rows, columns), np.float32)
        self.box_scale = np.zeros((2, rows, columns), np.float32)
        self.box_offset = np.zeros((2, rows, columns), np.float32)

    def draw(
        self, x: float, y: float, *, score: float = 0.9, regressed_off: float = 0.0,
    ) -> NDArray[np.float32]:
        """
        Draw FIGURE about a point; return its 17 keypoints x, y.

        :param regressed_off: by how many cells each regressed position is wrong, in x.
        """
        keypoints = FIGURE + np.array([x, y], np.float32)
        row, column = int(y), int(x)
        _bump(self.center[0], row, column, score)
        regressed = keypoints[:, ::-1] - (row, column) + (0, regressed_off)
        self.regression[:, row, column] = regressed.ravel()
        self.box_scale[:, row, column] = (22, 11)
        self.box_offset[:, row, column] = (y - row, x - column)
        for index, (u, v) in enumerate(keypoints):
            self.mark(index, u, v, score)
        return keypoints

    def mark(self, keypoint: int, x: float, y: float, score: float) -> None:
        """Let the heat map of a keypoint peak at a point, outside the heads nowhere."""
        rows, columns = self.center.shape[1:]
        row, column = int(np.floor(y)), int(np.floor(x))
        if 0 <= row < rows and 0 <= column < columns:
            _bump(self.heatmap[keypoint], row, column, score)
            self.offset[2 * keypoint:2 * keypoint + 2, row, column] = (y - row, x - column)

    @property
    def single(self) -> tuple[NDArray[np.float32], ...]:
        return self.center, self.regression, self.heatmap, self.offset

    @property
    def multi(self) -> tuple[NDArray[np.float32], ...]:
        return *self.single, self.box_scale, self.box_offset


def _bump(plane: NDArray[np.float32], row: int, column: int, score: float) -> None:
    rows, columns = np.indices(plane.shape)
    distance2 = (rows - row) ** 2 + (columns - column) ** 2
    np.maximum(plane, score * np.exp2(-distance2.astype(np.float32)), out=plane)
