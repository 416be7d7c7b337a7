"""Calibration boards: where in an image the corners of a chessboard or ChArUco board are."""
from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

#: Not in every build of OpenCV, and with another interface before 4.7.
_ARUCO: Any = getattr(cv2, 'aruco', None)
# When a corner is placed well enough: rounds, and the last step in pixels.
_CLOSE = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-3)
#: Fewer corners of a ChArUco board tell too little of its place.
FEWEST_CORNERS = 8


@dataclass(frozen=True, eq=False)
class BoardView:
    """
    A board as one image shows it.

    :ivar board: (k, 2) float32 places of the corners on the board, metres.
    :ivar image: (k, 2) float32 where they are in the image, raw pixels.
    """

    board: NDArray[np.float32]
    image: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.board)


class Board(ABC):
    """
    A flat pattern of known size.

    :param columns: corners between the squares of a row, or squares of a ChArUco board.
    :param rows: of a column, likewise.
    :param square: side of a square, metres.
    :raises DepthPersonError: when there can be no such board.
    """

    #: What the counts count, and the fewest there can be.
    counted = 'inner corners'
    fewest = 3

    def __init__(self, columns: int, rows: int, *, square: float) -> None:
        if min(columns, rows) < self.fewest:
            raise DepthPersonError(
                f'a board of {columns}x{rows} {self.counted} is too small; '
                f'{self.fewest}x{self.fewest} is the least')
        if not 0 < square < 10:
            raise DepthPersonError(
                f'a square of {square:g} m cannot be; give the side in metres, such as 0.025')
        self._size = (columns, rows)
        self._square = square

    @abstractmethod
    def find(self, image: NDArray[np.uint8]) -> BoardView | None:
        """Return the board in a BGR image; None where it cannot be seen well enough."""


class Chessboard(Board):
    """A chessboard, all of whose inner corners must be seen."""

    def __init__(self, columns: int, rows: int, *, square: float) -> None:
        super().__init__(columns, rows, square=square)
        across, down = np.meshgrid(np.arange(columns), np.arange(rows))
        self._corners = np.stack([across.ravel(), down.ravel()], -1).astype(np.float32) * square

    def find(self, image: NDArray[np.uint8]) -> BoardView | None:
        """Return the board in a BGR image; None where not every corner is seen."""
        gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        found, corners = cv2.findChessboardCornersSB(
            gray, self._size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY)
        if not found:
            return None
        return BoardView(self._corners, self._refined(gray, corners.reshape(-1, 2)))

    def _refined(self, gray: NDArray[np.uint8], corners: NDArray) -> NDArray[np.float32]:
        """Return the corners where the edges around each cross: half as far off, rendered."""
        grid = corners.reshape(*self._size[::-1], 2)
        nearest = min(np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1))
        reach = int(np.clip(nearest / 4, 2, 11))
        places = corners.reshape(-1, 1, 2).astype(np.float32)
        return cv2.cornerSubPix(gray, places, (reach, reach), (-1, -1), _CLOSE)[:, 0]


class CharucoBoard(Board):
    """
    A chessboard with a marker in each white square; part of it is enough.

    :param marker: side of a marker, metres.
    :param dictionary: of the markers, as OpenCV names it, such as 4X4_50.
    :raises DepthPersonError: when there can be no such board, or OpenCV was built without markers.
    """

    counted = 'squares'

    def __init__(
        self, columns: int, rows: int, *, square: float, marker: float, dictionary: str,
    ) -> None:
        super().__init__(columns, rows, square=square)
        if not 0 < marker < square:
            raise DepthPersonError(
                f'a marker of {marker:g} m does not fit into a square of {square:g} m')
        if _ARUCO is None:
            raise DepthPersonError(
                f'this OpenCV ({cv2.__version__}) was built without markers; install OpenCV 4.7 '
                'or later, or use a plain chessboard')
        name = f'DICT_{dictionary.upper().removeprefix("DICT_")}'
        number = getattr(_ARUCO, name, None)
        if number is None:
            known = (each.removeprefix('DICT_') for each in dir(_ARUCO)
                     if each.startswith('DICT_'))
            raise DepthPersonError(
                f'there are no markers {dictionary!r}; choose {", ".join(sorted(known))}')
        self._markers = _ARUCO.getPredefinedDictionary(number)
        self._set_up(marker)

    def find(self, image: NDArray[np.uint8]) -> BoardView | None:
        """Return what is seen of the board in a BGR image; None where that is too little."""
        corners, ids = self._detect(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
        if ids is None or len(ids) < FEWEST_CORNERS:
            return None
        places = np.asarray(self._corners, np.float32)[np.ravel(ids), :2]
        return BoardView(places, np.reshape(corners, (-1, 2)).astype(np.float32))

    # Ubuntu 24.04 has OpenCV 4.6.
    if hasattr(_ARUCO, 'CharucoBoard_create'):
        def _set_up(self, marker: float) -> None:
            self._board = _ARUCO.CharucoBoard_create(
                *self._size, self._square, marker, self._markers)
            self._corners = self._board.chessboardCorners

        def _detect(self, gray: NDArray[np.uint8]) -> tuple[NDArray, NDArray | None]:
            found, ids, _ = _ARUCO.detectMarkers(gray, self._markers)
            if ids is None:
                return np.empty((0, 2)), None
            _, corners, ids = _ARUCO.interpolateCornersCharuco(found, ids, gray, self._board)
            return corners, ids
    else:
        def _set_up(self, marker: float) -> None:
            board = _ARUCO.CharucoBoard(self._size, self._square, marker, self._markers)
            self._corners = board.getChessboardCorners()
            self._detector = _ARUCO.CharucoDetector(board)

        def _detect(self, gray: NDArray[np.uint8]) -> tuple[NDArray, NDArray | None]:
            corners, ids, _, _ = self._detector.detectBoard(gray)
            return corners, ids
