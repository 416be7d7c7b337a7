from __future__ import annotations

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depth_person.camera.lens import (
    distort_brown,
    distort_equidistant,
    undistort_brown,
    undistort_equidistant,
)
from depth_person.errors import DepthPersonError

#: How many coefficients each distortion model of sensor_msgs/CameraInfo has.
DISTORTION_MODELS = {'plumb_bob': 5, 'rational_polynomial': 8, 'equidistant': 4}

#: What others write for them; '' is no distortion.
MODEL_ALIASES = {'none': '', 'fisheye': 'equidistant'}


@dataclass(frozen=True)
class Intrinsics:
    """
    The pinhole and lens parameters of one camera at one resolution.

    The conventions are those of sensor_msgs/CameraInfo: pixels, centres at integers, and a
    distortion model with its coefficients in OpenCV's order.

    :raises DepthPersonError: when a value cannot belong to a camera.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion_model: str = 'plumb_bob'
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        values = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if not all(math.isfinite(value) for value in values):
            raise DepthPersonError('intrinsics hold NaN or infinity; calibrate the camera again')
        if self.fx <= 0 or self.fy <= 0:
            raise DepthPersonError(
                f'focal length {self.fx:g}, {self.fy:g} px is not positive; calibrate the camera')
        if self.width <= 0 or self.height <= 0:
            raise DepthPersonError(
                f'intrinsics for an image of {self.width}x{self.height} px; a size must be given')
        count = DISTORTION_MODELS.get(self.distortion_model)
        if count is None:
            raise DepthPersonError(
                f'unknown distortion model {self.distortion_model!r}; '
                f'known are {", ".join(DISTORTION_MODELS)}')
        if len(self.distortion) != count:
            raise DepthPersonError(
                f'{self.distortion_model} takes {count} coefficients, not {len(self.distortion)}')

    @classmethod
    def from_horizontal_fov(cls, degrees: float, *, width: int, height: int) -> Intrinsics:
        """Return the undistorted camera with square pixels that sees this many degrees across."""
        if not 0 < degrees < 180:
            raise DepthPersonError(
                f'a horizontal field of view of {degrees:g} degrees is not between 0 and 180')
        focal_length = width / 2 / math.tan(math.radians(degrees) / 2)
        return cls(width, height, focal_length, focal_length, (width - 1) / 2, (height - 1) / 2)

    @classmethod
    def from_camera_info_fields(
        cls, width: int, height: int, distortion_model: str, d: ArrayLike, k: ArrayLike,
    ) -> Intrinsics | None:
        """
        Return the intrinsics that a CameraInfo states; None for an uncalibrated one (K[0] 0).

        Real cameras deviate from REP 104, so these are understood too: coefficients left out at
        the end are zero; more than the model has (OpenCV writes up to 14) are dropped when
        they are zero; no model with no or zero coefficients is no distortion; fisheye is
        equidistant.

        :param d: the distortion coefficients, in OpenCV's order.
        :param k: the nine values of the camera matrix, row by row.
        :raises DepthPersonError: when the values cannot belong to a camera.
        """
        matrix, coefficients = np.ravel(k), [float(value) for value in np.ravel(d)]
        if matrix.size != 9:
            raise DepthPersonError(
                f'a camera matrix K of {matrix.size} values, not 9; calibrate the camera again')
        fx, fy, cx, cy = (float(matrix[i]) for i in (0, 4, 2, 5))
        if fx == 0:
            return None
        model = MODEL_ALIASES.get(distortion_model, distortion_model)
        if model == '':
            if any(coefficients):
                raise DepthPersonError(
                    f'distortion coefficients {coefficients} without a distortion_model; name '
                    f'it: {", ".join(DISTORTION_MODELS)}')
            return cls(int(width), int(height), fx, fy, cx, cy)
        count = DISTORTION_MODELS.get(model, len(coefficients))
        if not any(coefficients[count:]):  # else the constructor says what is wrong with them
            coefficients = coefficients[:count] + [0.0] * (count - len(coefficients))
        return cls(int(width), int(height), fx, fy, cx, cy, model, tuple(coefficients))

    @property
    def distorted(self) -> bool:
        """Whether pixels deviate from the pinhole; a fisheye's always do."""
        return self.distortion_model == 'equidistant' or any(self.distortion)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The 3x3 camera matrix K."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def fits(self, image: NDArray[np.uint8]) -> bool:
        """Return whether the image has the resolution that these intrinsics belong to."""
        return image.shape[:2] == (self.height, self.width)

    def scaled(self, *, width: int, height: int) -> Intrinsics:
        """Return the intrinsics of the same view resized to width x height."""
        sx, sy = width / self.width, height / self.height
        return replace(
            self, width=width, height=height, fx=self.fx * sx, fy=self.fy * sy,
            cx=(self.cx + 0.5) * sx - 0.5, cy=(self.cy + 0.5) * sy - 0.5)

    def undistort(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """
        Return where on the plane z = 1 the view rays of raw pixels go.

        Within the image the answer projects back onto its pixel within 1e-6 px.

        :param pixels: (..., 2) u, v; any value, NaN and infinity too.
        :returns: (..., 2) x/z, y/z; NaN where the pixel is not finite or has no ray.
        """
        pixels = np.asarray(pixels, np.float64)
        with np.errstate(invalid='ignore'):
            rays = np.where(np.isfinite(pixels), (pixels - (self.cx, self.cy)), np.nan)
        rays = rays / (self.fx, self.fy)
        if not self.distorted:
            return rays
        undistort = (undistort_equidistant if self.distortion_model == 'equidistant'
                     else undistort_brown)
        return np.stack(undistort(rays[..., 0], rays[..., 1], self.distortion), axis=-1)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """
        Return the raw pixels at which points in the camera optical frame appear.

        :param points: (..., 3) metres.
        :returns: (..., 2) u, v; NaN for points that are not in front of the camera.
        """
        points = np.asarray(points, np.float64)
        with np.errstate(all='ignore'):
            z = np.where(points[..., 2] > 0, points[..., 2], np.nan)
            x, y = points[..., 0] / z, points[..., 1] / z
        if self.distorted:
            distort = (distort_equidistant if self.distortion_model == 'equidistant'
                       else distort_brown)
            x, y = distort(x, y, self.distortion)
        return np.stack((x * self.fx + self.cx, y * self.fy + self.cy), axis=-1)
