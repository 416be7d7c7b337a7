"""
Lens distortion on the plane z = 1: the forward models and their inverses.

The models are those of sensor_msgs/CameraInfo, the formulas those of OpenCV's calib3d. The
inverses are Newton iterations of our own, started from a table of the radial part: the fixed-point
iteration behind cv2.undistortPoints stops short at wide angles (1e-4 and more after its default
five rounds), fails near the fold of a barrel distortion, and its versions differ in what they
return for NaN and for pixels without a ray.
"""
from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coefficients = tuple[float, ...]

#: Rounds of Newton's iteration at most. Two or three do but near the fold of a lens.
ROUNDS = 12
#: The iteration ends with a step below this: it doubles the valid digits each time.
LAST_STEP = 1e-7
#: A solution must reproduce the distorted point this closely on the plane z = 1.
TOLERANCE = 1e-9
#: Rays farther off the axis are not looked for, except with the equidistant model.
WIDEST = np.radians(89.0)
#: How far beyond the radial fold a point may lie that tangential distortion has moved there.
SLACK = 1.02


def distort_brown(x: Array, y: Array, coefficients: Coefficients) -> tuple[Array, Array]:
    """
    Apply the plumb_bob or rational_polynomial model.

    :param x: x/z of the view rays.
    :param y: y/z of the view rays.
    :param coefficients: k1, k2, p1, p2, k3 and, for the rational model, k4, k5, k6.
    :returns: the distorted x and y.
    """
    xd, yd, _ = _brown(x, y, coefficients)
    return xd, yd


def undistort_brown(xd: Array, yd: Array, coefficients: Coefficients) -> tuple[Array, Array]:
    """
    Invert distort_brown.

    :returns: x/z and y/z; NaN where no ray is seen at the point, which is so beyond the fold
        of a barrel distortion.
    """
    with np.errstate(all='ignore'):  # wild points turn into infinity and NaN, which is the answer
        distorted_radii, radii = _brown_table(coefficients)
        scale = _first_guess(np.hypot(xd, yd), distorted_radii, radii)
        x, y = xd * scale, yd * scale
        for _ in range(ROUNDS):
            xe, ye, (xx, xy, yy) = _brown(x, y, coefficients)
            xe, ye = xe - xd, ye - yd
            determinant = xx * yy - xy * xy
            dx, dy = (yy * xe - xy * ye) / determinant, (xx * ye - xy * xe) / determinant
            x, y = x - dx, y - dy
            if not np.any(np.maximum(np.abs(dx), np.abs(dy)) > LAST_STEP):
                break
        xe, ye = distort_brown(x, y, coefficients)
        seen = np.hypot(xe - xd, ye - yd) < TOLERANCE
        # Past the fold the polynomials run backwards and may rise again, which no lens does.
        seen &= np.hypot(x, y) <= SLACK * radii[-1]
    return np.where(seen, x, np.nan), np.where(seen, y, np.nan)


@lru_cache(maxsize=16)
def _brown_table(coefficients: Coefficients) -> tuple[Array, Array]:
    """Return distorted radii up to the fold, and the radii they come from."""
    k1, k2, _, _, *others = coefficients
    radius = np.tan(np.linspace(0, WIDEST, 512))
    distorted, _, _ = _brown(radius, np.zeros_like(radius), (k1, k2, 0.0, 0.0, *others))
    return _up_to_fold(distorted, radius)


def _brown(
    x: Array, y: Array, coefficients: Coefficients,
) -> tuple[Array, Array, tuple[Array, Array, Array]]:
    """Return the distorted point and its derivatives dxd/dx, dxd/dy = dyd/dx, dyd/dy."""
    k1, k2, p1, p2, k3, *denominator = coefficients
    with np.errstate(all='ignore'):
        r2 = x * x + y * y
        gain = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2 * k2 + r2 * (3 * k3))  # d gain / d r2
        if any(denominator):
            k4, k5, k6 = denominator
            divisor = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
            gain = gain / divisor
            slope = (slope - gain * (k4 + r2 * (2 * k5 + r2 * (3 * k6)))) / divisor
        # Both tangential terms, gathered: x (2 p1 y + 2 p2 x) + p2 r2, and the same for y.
        gain = gain + (2 * p1) * y + (2 * p2) * x
        sx, sy = 2 * x * slope, 2 * y * slope
        xx, yy = gain + x * (sx + 4 * p2), gain + y * (sy + 4 * p1)
        xy = x * (sy + 2 * p1) + (2 * p2) * y
        return x * gain + p2 * r2, y * gain + p1 * r2, (xx, xy, yy)


def distort_equidistant(x: Array, y: Array, coefficients: Coefficients) -> tuple[Array, Array]:
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
    xd: Array, yd: Array, coefficients: Coefficients,
) -> tuple[Array, Array]:
    """
    Invert distort_equidistant.

    :returns: x/z and y/z; NaN where no ray is seen at the point, or one that is 90 degrees or
        more off the axis and never meets the plane z = 1.
    """
    with np.errstate(all='ignore'):
        bent = np.hypot(xd, yd)
        angle = bent * _first_guess(bent, *_equidistant_table(coefficients))
        for _ in range(ROUNDS):
            value, slope = _equidistant(angle, coefficients)
            step = (value - bent) / slope
            angle = angle - step
            if not np.any(np.abs(step) > LAST_STEP):
                break
        value, slope = _equidistant(angle, coefficients)
        seen = (np.abs(value - bent) < TOLERANCE) & (slope > 0) & (angle < np.pi / 2)
        scale = np.where(bent > 0, np.tan(angle) / bent, 1.0)
    return np.where(seen, xd * scale, np.nan), np.where(seen, yd * scale, np.nan)


@lru_cache(maxsize=16)
def _equidistant_table(coefficients: Coefficients) -> tuple[Array, Array]:
    """Return distorted angles up to the fold, and the angles they come from."""
    angle = np.linspace(0, np.pi / 2, 512)
    return _up_to_fold(_equidistant(angle, coefficients)[0], angle)


def _equidistant(angle: Array, coefficients: Coefficients) -> tuple[Array, Array]:
    """Return the distorted angle and its derivative by the angle."""
    k1, k2, k3, k4 = coefficients
    a2 = angle * angle
    value = angle * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
    slope = 1 + a2 * (3 * k1 + a2 * (5 * k2 + a2 * (7 * k3 + a2 * 9 * k4)))
    return value, slope


def _up_to_fold(distorted: Array, true: Array) -> tuple[Array, Array]:
    """Return both as far as the distorted values rise."""
    falls = np.flatnonzero(~(np.diff(distorted) > 0))
    end = falls[0] + 1 if falls.size else len(distorted)
    return distorted[:end], true[:end]


def _first_guess(distorted: Array, table_distorted: Array, table_true: Array) -> Array:
    """Return about what distorted radii are to be scaled by; NaN well beyond the table."""
    true = np.interp(distorted, table_distorted, table_true)
    scale = np.where(distorted > 0, true / distorted, 1.0)
    return np.where(distorted <= SLACK * table_distorted[-1], scale, np.nan)
