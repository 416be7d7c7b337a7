from __future__ import annotations

from dataclasses import dataclass, replace
import math

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from depth_person.errors import DepthPersonError

#: How many coefficients each distortion model of sensor_msgs/CameraInfo has.
DISTORTION_MODELS = {'plumb_bob': 5, 'rational_polynomial': 8, 'equidistant': 4}


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

        :param pixels: (..., 2) u, v.
        :returns: (..., 2) x/z, y/z; NaN where the pixel is NaN or has no ray.
        """
        pixels = np.asarray(pixels, np.float64)
        flat = pixels.reshape(-1, 1, 2)
        if flat.size == 0:
            return np.empty(pixels.shape)
        coefficients = np.asarray(self.distortion)
        if not coefficients.any() and self.distortion_model != 'equidistant':
            return (pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        if self.distortion_model == 'equidistant':
            rays = cv2.fisheye.undistortPoints(flat, self.matrix, coefficients)
        else:
            rays = cv2.undistortPoints(flat, self.matrix, coefficients)
        return rays.reshape(pixels.shape)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """
        Return the raw pixels at which points in the camera optical frame appear.

        :param points: (..., 3) metres.
        :returns: (..., 2) u, v.
        """
        points = np.asarray(points, np.float64)
        flat = points.reshape(-1, 1, 3)
        if flat.size == 0:
            return np.empty((*points.shape[:-1], 2))
        zero, coefficients = np.zeros(3), np.asarray(self.distortion)
        if self.distortion_model == 'equidistant':
            pixels, _ = cv2.fisheye.projectPoints(flat, zero, zero, self.matrix, coefficients)
        else:
            pixels, _ = cv2.projectPoints(flat, zero, zero, self.matrix, coefficients)
        return pixels.reshape(*points.shape[:-1], 2)
