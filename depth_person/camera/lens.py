"""
Lens distortion on the plane z = 1: the forward models and their inverses.

The models are those of sensor_msgs/CameraInfo, the formulas those of OpenCV's calib3d. The
inverses are Newton iterations of our own: the fixed-point iteration behind cv2.undistortPoints
stops short at wide angles (1e-4 and more after its default five rounds), its versions differ in
what they return for NaN and for pixels without a ray, and Newton needs fewer rounds.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Rounds of Newton's iteration; from the middle of an image to its corner three to eight do.
ROUNDS = 20
#: A solution must reproduce the distorted point this closely on the plane z = 1.
TOLERANCE = 1e-9


def distort_brown(x: Array, y: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """
    Apply the plumb_bob or rational_polynomial model.

    :param x: x/z of the view rays.
    :param y: y/z of the view rays.
    :param coefficients: k1, k2, p1, p2, k3 and, for the rational model, k4, k5, k6.
    :returns: the distorted x and y.
    """
    xd, yd, _ = _brown(x, y, coefficients)
    return xd, yd


def undistort_brown(xd: Array, yd: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """
    Invert distort_brown.

    :returns: x/z and y/z; NaN where no ray is seen at the point, which is so beyond the fold
        of a barrel distortion.
    """
    x, y = xd, yd
    with np.errstate(all='ignore'):  # wild points turn into infinity and NaN, which is the answer
        for _ in range(ROUNDS):
            xe, ye, (xx, xy, yy) = _brown(x, y, coefficients)
            xe, ye = xe - xd, ye - yd
            determinant = xx * yy - xy * xy
            dx, dy = (yy * xe - xy * ye) / determinant, (xx * ye - xy * xe) / determinant
            x, y = x - dx, y - dy
            if not np.any(np.abs(dx) + np.abs(dy) > TOLERANCE / 10):
                break
        xe, ye, (xx, xy, yy) = _brown(x, y, coefficients)
        # Past the fold the image runs backwards: there the determinant is negative.
        seen = (np.hypot(xe - xd, ye - yd) < TOLERANCE) & (xx * yy > xy * xy) & (xx + yy > 0)
    return np.where(seen, x, np.nan), np.where(seen, y, np.nan)


def _brown(
    x: Array, y: Array, coefficients: Sequence[float],
) -> tuple[Array, Array, tuple[Array, Array, Array]]:
    """Return the distorted point and its derivatives dxd/dx, dxd/dy = dyd/dx, dyd/dy."""
    k1, k2, p1, p2, k3, *denominator = coefficients
    with np.errstate(all='ignore'):
        r2 = x * x + y * y
        gain = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2 * k2 + r2 * 3 * k3)  # d gain / d r2
        if denominator:
            k4, k5, k6 = denominator
            divisor = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
            gain = gain / divisor
            slope = (slope - gain * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / divisor
        xd = x * gain + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        yd = y * gain + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        xx = gain + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x
        yy = gain + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x
        xy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
    return xd, yd, (xx, xy, yy)


def distort_equidistant(x: Array, y: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """
    Apply the equidistant (fisheye, Kannala-Brandt) model.

    :param x: x/z of the view rays.
    :param y: y/z of the view rays.
    :param coefficients: k1 to k4.
    :returns: the distorted x and y.
    """
    with np.errstate(all='ignore'):
        radius = np.hypot(x, y)
        bent, _ = _equidistant(np.arctan(radius), coefficients)
        scale = np.where(radius > 0, bent / radius, 1.0)
        return x * scale, y * scale


def undistort_equidistant(
    xd: Array, yd: Array, coefficients: Sequence[float],
) -> tuple[Array, Array]:
    """
    Invert distort_equidistant.

    :returns: x/z and y/z; NaN where no ray is seen at the point, or one that is 90 degrees or
        more off the axis and never meets the plane z = 1.
    """
    with np.errstate(all='ignore'):
        bent = np.hypot(xd, yd)
        angle = np.minimum(bent, np.pi / 2)
        for _ in range(ROUNDS):
            value, slope = _equidistant(angle, coefficients)
            step = (value - bent) / slope
            angle = angle - step
            if not np.any(np.abs(step) > TOLERANCE / 10):
                break
        value, slope = _equidistant(angle, coefficients)
        seen = (np.abs(value - bent) < TOLERANCE) & (slope > 0) & (angle >= 0)
        seen &= angle < np.pi / 2
        scale = np.where(bent > 0, np.tan(angle) / bent, 1.0)
    return np.where(seen, xd * scale, np.nan), np.where(seen, yd * scale, np.nan)


def _equidistant(angle: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """Return the distorted angle and its derivative by the angle."""
    k1, k2, k3, k4 = coefficients
    a2 = angle * angle
    value = angle * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
    slope = 1 + a2 * (3 * k1 + a2 * (5 * k2 + a2 * (7 * k3 + a2 * 9 * k4)))
    return value, slope
