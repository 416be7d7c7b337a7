"""How right and how true the lifter is on held-out bodies, in groups."""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.lifter import Lifted
from depth_person.distance.training.views import Examples
from depth_person.pose.skeleton import Keypoint

_Array = NDArray[np.float64]

_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
_LOWER = [Keypoint.R_HIP, Keypoint.L_HIP, Keypoint.R_KNEE, Keypoint.L_KNEE,
          Keypoint.R_ANKLE, Keypoint.L_ANKLE]
_FACE = [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR]


def groups(examples: Examples) -> dict[str, NDArray[np.bool_]]:
    """Return which examples belong to each group of the report."""
    known = examples.inputs.known > 0
    facing = np.cos(examples.yaw)
    down = np.degrees(examples.elevation)
    whole = known[:, [*_SHOULDERS, *_LOWER]].all(axis=1)
    face = known[:, _FACE].sum(axis=1)
    headless = ~known[:, _LOWER].any(axis=1)
    return {
        'all': np.ones(len(facing), bool),
        'near (below 8 m)': examples.range < 8, 'far (8 m and more)': examples.range >= 8,
        'front': facing > 0.8, 'side': np.abs(facing) < 0.5, 'back': facing < -0.8,
        'whole body': whole, 'occluded': ~whole,
        'street (below 10 degrees)': down < 10, 'drone (above 20 degrees)': down > 20,
        'upper body only': headless & known[:, _SHOULDERS].all(axis=1) & (face > 0),
        'head only': headless & ~known[:, _SHOULDERS].any(axis=1) & (face >= 3),
        'gravity known': examples.inputs.gravity[:, 3] > 0,
        'gravity unknown': examples.inputs.gravity[:, 3] == 0,
    }


def report(examples: Examples, lifted: Lifted) -> dict[str, dict[str, Any]]:
    """Return for each group the number, the errors and how often truth lies within sigmas."""
    error = lifted.log_correction - examples.log_correction
    result = {}
    for name, rows in groups(examples).items():
        off = np.abs(error[rows])
        sigmas = off / lifted.log_sigma[rows]
        result[name] = {
            'n': int(rows.sum()),
            'median_relative_error': _rounded(np.median(off)),
            'bias': _rounded(error[rows].mean()),
            'within_1_sigma': _rounded((sigmas < 1).mean()),
            'within_2_sigma': _rounded((sigmas < 2).mean()),
        }
    return result


def _rounded(value: np.floating) -> float:
    return round(float(value), 4)


def temperature(examples: Examples, lifted: Lifted) -> float:
    """Return what sigma has to be multiplied with for 68.3 % to lie within one."""
    sigmas = np.abs(lifted.log_correction - examples.log_correction) / lifted.log_sigma
    return float(np.quantile(sigmas, 0.683))
