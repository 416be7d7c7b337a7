"""The second paper's validation: RMSE, Pearson's r, a one-sample t-test, and its corrections."""
from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depth_person.errors import DepthPersonError

_Array = NDArray[np.float64]

#: Probability at which a test of the mean error decides.
SIGNIFICANCE = 0.05


@dataclass(frozen=True)
class Agreement:
    """
    How well predicted distances agree with actual ones; lengths in the unit of the distances.

    :ivar n: how many.
    :ivar rmse: root of the mean squared error, error being predicted less actual.
    :ivar pearson_r: correlation of predicted and actual distances.
    :ivar mean_error: the bias.
    :ivar error_spread: s, the errors' standard deviation (n - 1).
    :ivar standard_error: s / sqrt(n), how well the n errors fix the bias; the paper's dx.
    :ivar t: mean_error / standard_error, of the hypothesis that the true bias is zero.
    :ivar p_value: how often a |t| as large comes of chance where it is; two-sided.
    """

    n: int
    rmse: float
    pearson_r: float
    mean_error: float
    error_spread: float
    standard_error: float
    t: float
    p_value: float

    @property
    def degrees_of_freedom(self) -> int:
        """Those of the t-test."""
        return self.n - 1

    @property
    def biased(self) -> bool:
        """Whether the test rejects the hypothesis that the true bias is zero."""
        return self.p_value < SIGNIFICANCE


def t_test_p_value(t: float, degrees_of_freedom: int) -> float:
    """
    Return the two-sided probability of Student's t.

    :raises DepthPersonError: when scipy is missing.
    """
    try:
        from scipy.stats import t as student
    except ImportError as error:
        raise DepthPersonError(
            "the t-test needs scipy; install it with: pip install 'depth_person[train]'"
        ) from error
    return float(2 * student.sf(abs(t), degrees_of_freedom))


def agreement(actual: ArrayLike, predicted: ArrayLike) -> Agreement:
    """
    Return the figures for at least three pairs of distances that are not all the same.

    :raises DepthPersonError: when scipy is missing.
    :raises ValueError: for fewer pairs, or where r does not exist.
    """
    actual, predicted = np.asarray(actual, np.float64), np.asarray(predicted, np.float64)
    if len(actual) < 3 or np.ptp(actual) == 0 or np.ptp(predicted) == 0:
        raise ValueError('at least three distances that differ are needed')
    error = predicted - actual
    n, mean, spread = len(error), float(error.mean()), float(error.std(ddof=1))
    standard_error = spread / math.sqrt(n)
    if standard_error > 0:
        t = mean / standard_error
    else:
        t = math.copysign(math.inf, mean) if mean else 0.0
    return Agreement(
        n=n, rmse=float(np.sqrt((error ** 2).mean())),
        pearson_r=float(np.corrcoef(actual, predicted)[0, 1]), mean_error=mean,
        error_spread=spread, standard_error=standard_error, t=t,
        p_value=t_test_p_value(t, n - 1))


def moved_to_truth(actual: ArrayLike, predicted: ArrayLike, dx: float) -> _Array:
    """
    Return the paper's corrected distances: predicted plus or minus dx, whichever is nearer.

    It has to look at the actual distance for the sign, and for whether to move at all. So it is
    no correction that could be used where distances are to be measured, and that it lowers
    the error says nothing.
    """
    actual, predicted = np.asarray(actual, np.float64), np.asarray(predicted, np.float64)
    error = predicted - actual
    return np.where(np.abs(error) > dx / 2, predicted - np.sign(error) * dx, predicted)


def without_bias(actual: ArrayLike, predicted: ArrayLike) -> _Array:
    """
    Return predicted distances less the mean error of all the *other* rows.

    This part can be used: a bias measured once, on people at known distances, holds for the next
    person, whose own distance it does not ask for.
    """
    actual, predicted = np.asarray(actual, np.float64), np.asarray(predicted, np.float64)
    error = predicted - actual
    return predicted - (error.sum() - error) / (len(error) - 1)


def perspective_shift(depth_change: ArrayLike, bearing_rad: ArrayLike) -> _Array:
    """
    Return dx = dz tan(alpha): how far aside a depth's change moves a person on one view ray.

    At run time every estimator has it built in: the position is the point of the neck's view
    ray at the estimated range, so x = z tan(alpha), and range = z / cos(alpha) on the level.
    """
    return np.asarray(depth_change, np.float64) * np.tan(bearing_rad)
