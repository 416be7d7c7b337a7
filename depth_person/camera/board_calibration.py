"""Intrinsics from views of a calibration board, refused where the views cannot tell them."""
from __future__ import annotations

from dataclasses import dataclass, field
import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.boards import BoardView
from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]
#: Where OpenCV keeps the flags of its fisheye model: moved, with other values, in version 5.
_FISHEYE: Any = cv2.fisheye if hasattr(cv2.fisheye, 'CALIB_FIX_SKEW') else cv2

#: The distortion models of sensor_msgs/CameraInfo that can be fitted.
MODELS = ('plumb_bob', 'rational_polynomial', 'equidistant')
#: Views whose corners all lie closer to those of another are that view again, over the width.
SAME_VIEW = 0.03
#: Fewer views fit anything.
FEWEST_VIEWS = 8
#: The image is divided into so many cells across and down to see where corners were.
CELLS = (8, 6)
#: Corners in fewer of the cells leave the distortion of the rest unknown.
LEAST_COVERAGE = 0.5
#: A focal length that the views leave more uncertain than this (relative) is not known.
LARGEST_FOCAL_SIGMA = 0.005
#: Views whose error is so many times the median, and more than a pixel, are left out: a corner
#: was mistaken, or the camera moved.
OUTLIER = 3.0


@dataclass(frozen=True)
class BoardCalibration:
    """
    What the views tell.

    :ivar reprojection_error: root mean square over all corners, pixels.
    :ivar focal_sigma: one standard deviation of fx and fy, relative.
    :ivar views: how many were used.
    :ivar outliers: how many did not fit the others and were left out.
    """

    intrinsics: Intrinsics
    reprojection_error: float
    focal_sigma: float
    views: int
    outliers: int


@dataclass(eq=False)
class BoardViews:
    """The views of one board that differ from each other, and what they cover of the image."""

    width: int
    height: int
    views: list[BoardView] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._outlines: list[_Array] = []

    def offer(self, view: BoardView) -> bool:
        """Keep a view unless it shows the board where another has; return whether it was kept."""
        outline = _outline(view)
        for other in self._outlines:
            if np.abs(outline - other).max() < SAME_VIEW * self.width:
                return False
        self._outlines.append(outline)
        self.views.append(view)
        return True

    def coverage(self) -> NDArray[np.bool_]:
        """Return (rows, columns) which cells of the image have held a corner."""
        columns, rows = CELLS
        seen = np.zeros((rows, columns), np.bool_)
        for view in self.views:
            across, down = (view.image / (self.width, self.height) * CELLS).astype(int).T
            seen[np.clip(down, 0, rows - 1), np.clip(across, 0, columns - 1)] = True
        return seen


def calibrate(views: BoardViews, *, model: str = 'plumb_bob') -> BoardCalibration:
    """
    Return the intrinsics that explain the views best.

    :param model: of MODELS.
    :raises DepthPersonError: when the views are too few or too alike to tell; says what to add.
    """
    if model not in MODELS:
        raise DepthPersonError(f'no distortion model {model!r}; choose {", ".join(MODELS)}')
    _check_enough(views)
    chosen = list(views.views)
    solution = _solve(chosen, views, model)
    limit = max(1.0, OUTLIER * float(np.median(solution.errors)))
    kept = [view for view, error in zip(chosen, solution.errors, strict=True) if error <= limit]
    if len(kept) < FEWEST_VIEWS:
        raise DepthPersonError(
            f'only {len(kept)} of {len(chosen)} views fit one camera; check the size of the '
            'board, that it is flat, and that the focus and zoom stay as they are')
    if len(kept) < len(chosen):
        solution = _solve(kept, views, model)
    focal_sigma = _focal_sigma(kept, views, model, solution)
    if not focal_sigma <= LARGEST_FOCAL_SIGMA:
        raise DepthPersonError(
            f'the views leave the focal length uncertain by {focal_sigma:.1%}: they are too '
            'alike; add views with the board tilted by 30 to 45 degrees to all sides, and near')
    return BoardCalibration(
        intrinsics=solution.intrinsics, reprojection_error=solution.rms, focal_sigma=focal_sigma,
        views=len(kept), outliers=len(chosen) - len(kept))


@dataclass(frozen=True, eq=False)
class _Solution:
    intrinsics: Intrinsics
    rms: float
    errors: _Array  # (views,) root mean square of each, pixels
    focal_sigma: float


def _check_enough(views: BoardViews) -> None:
    if len(views.views) < FEWEST_VIEWS:
        raise DepthPersonError(
            f'{len(views.views)} different views of the board are too few, {FEWEST_VIEWS} the '
            'least and 20 good; move the board about between them, and check its counts')
    share = float(views.coverage().mean())
    if share < LEAST_COVERAGE:
        raise DepthPersonError(
            f'the board has been seen in {share:.0%} of the image only; hold it into the '
            f'corners and edges, too, until it was in {LEAST_COVERAGE:.0%} and more')


def _outline(view: BoardView) -> _Array:
    """Return where the board's corners would be, whichever of them are seen: (4, 2) pixels."""
    low, high = view.board.min(axis=0), view.board.max(axis=0)
    homography, _ = cv2.findHomography(view.board, view.image)
    if homography is None:
        return np.full((4, 2), np.inf)
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])], np.float64)
    return cv2.perspectiveTransform(corners[None], homography)[0]


def _solve(chosen: list[BoardView], views: BoardViews, model: str) -> _Solution:
    board = [np.column_stack([view.board, np.zeros(len(view), np.float32)])[None]
             for view in chosen]
    image = [view.image[None] for view in chosen]
    size = (views.width, views.height)
    try:
        if model == 'equidistant':
            return _solve_fisheye(board, image, size)
        return _solve_brown(board, image, size, rational=model == 'rational_polynomial')
    except cv2.error as error:
        raise DepthPersonError(
            f'OpenCV cannot fit a camera of the model {model} to the views: {error.err or error}; '
            'add views with the board tilted, or choose another model') from error


def _solve_brown(
    board: list[NDArray], image: list[NDArray], size: tuple[int, int], *, rational: bool,
) -> _Solution:
    rms, matrix, distortion, _, _, spread, _, errors = cv2.calibrateCameraExtended(
        board, image, size, None, None, flags=cv2.CALIB_RATIONAL_MODEL if rational else 0)
    spread = np.ravel(spread)
    count, model = (8, 'rational_polynomial') if rational else (5, 'plumb_bob')
    intrinsics = _intrinsics(size, matrix, model, np.ravel(distortion)[:count])
    focal_sigma = max(spread[0] / intrinsics.fx, spread[1] / intrinsics.fy)
    return _Solution(intrinsics, float(rms), np.ravel(errors), float(focal_sigma))


def _solve_fisheye(
    board: list[NDArray], image: list[NDArray], size: tuple[int, int],
) -> _Solution:
    board = [each.astype(np.float64) for each in board]
    image = [each.astype(np.float64) for each in image]
    matrix, distortion = np.eye(3), np.zeros((4, 1))
    rms, matrix, distortion, turns, shifts = cv2.fisheye.calibrate(
        board, image, size, matrix, distortion,
        flags=_FISHEYE.CALIB_RECOMPUTE_EXTRINSIC | _FISHEYE.CALIB_FIX_SKEW)
    errors = []
    for places, pixels, turn, shift in zip(board, image, turns, shifts, strict=True):
        again, _ = cv2.fisheye.projectPoints(places, turn, shift, matrix, distortion)
        errors.append(math.sqrt(2 * np.mean((again.reshape(pixels.shape) - pixels) ** 2)))
    # OpenCV gives no covariance here; the halves of the views have to do.
    return _Solution(
        _intrinsics(size, matrix, 'equidistant', np.ravel(distortion)), float(rms),
        np.array(errors), 0.0)


def _intrinsics(
    size: tuple[int, int], matrix: _Array, model: str, distortion: _Array,
) -> Intrinsics:
    if not (np.isfinite(matrix).all() and np.isfinite(distortion).all()):
        raise DepthPersonError(
            'the views fit no camera; add views with the board tilted to all sides')
    return Intrinsics(
        *size, float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]),
        float(matrix[1, 2]), model, tuple(distortion.tolist()))


def _focal_sigma(
    chosen: list[BoardView], views: BoardViews, model: str, solution: _Solution,
) -> float:
    """
    Return the relative spread of the focal length.

    The covariance of the fit takes corner errors for independent. Odd and even views, fitted
    apart, differ by twice the spread on average, with what is systematic in a view in it.
    """
    first, second = (
        _solve(half, views, model).intrinsics.fx for half in (chosen[::2], chosen[1::2]))
    return max(solution.focal_sigma, abs(math.log(first / second)) / 2)
