"""Calibration boards as a known camera sees them."""
from __future__ import annotations

import cv2
import numpy as np

from depth_person.camera.intrinsics import Intrinsics

#: Rendered so many times finer in both directions, then averaged.
FINER = 2
#: Texture pixels to a square of the board.
SQUARE_PX = 40


def chessboard_texture(columns: int, rows: int) -> np.ndarray:
    """Return the picture of a board with so many inner corners and a white margin of a square."""
    across, down = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    squares = np.where((across + down) % 2, 255, 0).astype(np.uint8)
    picture = np.kron(squares, np.ones((SQUARE_PX, SQUARE_PX), np.uint8))
    return cv2.copyMakeBorder(picture, *[SQUARE_PX] * 4, cv2.BORDER_CONSTANT, value=255)


class BoardCamera:
    """Renders views of a flat texture through a lens."""

    def __init__(self, intrinsics: Intrinsics) -> None:
        self._size = intrinsics.width, intrinsics.height
        u, v = (np.arange(FINER * side) / FINER - (FINER - 1) / (2 * FINER)
                for side in self._size)
        plane = intrinsics.undistort(np.stack(np.meshgrid(u, v), axis=-1))
        self._rays = np.concatenate([plane, np.ones((*plane.shape[:2], 1))], axis=-1)

    def see(self, texture: np.ndarray, *, square: float, turn, shift) -> np.ndarray:
        """
        Return the BGR image of a board.

        :param turn: (3,) rotation vector of the board, whose middle is its origin.
        :param shift: (3,) metres in the camera frame to that middle.
        """
        rotation, _ = cv2.Rodrigues(np.asarray(turn, float))
        middle = (np.array(texture.shape[::-1]) - 1) / 2
        metre = SQUARE_PX / square
        # From the board's texture to the camera's plane z = 1, and back.
        board = np.column_stack([rotation[:, 0] / metre, rotation[:, 1] / metre, shift])
        board = board @ np.array([[1, 0, -middle[0]], [0, 1, -middle[1]], [0, 0, 1]])
        seen = self._rays @ np.linalg.inv(board).T
        with np.errstate(all='ignore'):
            places = (seen[..., :2] / seen[..., 2:]).astype(np.float32)
        places[~np.isfinite(places)] = -1
        image = cv2.remap(
            texture, places[..., 0], places[..., 1], cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT, borderValue=110)
        image = cv2.resize(image, self._size, interpolation=cv2.INTER_AREA)
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)


def poses(rng: np.random.Generator, n: int, *, distance: float, spread: float):
    """Yield turns and shifts of a board all over the image, tilted to all sides."""
    for i in range(n):
        turn = rng.uniform(-0.6, 0.6, 3) * (1, 1, 0.3)
        across, down = spread * np.array([i % 4 / 1.5 - 1, i // 4 % 3 - 1])
        z = distance * rng.uniform(0.8, 1.2)
        yield turn, np.array([across * z, 0.75 * down * z, z])
