"""What of a range's error stays with a person, what with the view, and what changes at once."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.conventions import convention_of
from depth_person.distance.estimator import Body, Cue
from depth_person.distance.shoulder import ShoulderEstimator

_Array = NDArray[np.float64]

#: Spread of the logarithm of range that a person's build gives in every frame alike, of the same
#: sign in all views: of adults, and where people may be children.
BODY_SPREAD = 0.038
CHILDREN_SPREAD = 0.13
#: Of the variance left, this part stays while the view does: pose, gaps, the network's habits.
VIEW_SHARE = 0.3
#: How long it does, seconds.
VIEW_TIME_S = 0.5
#: What is left is at least this part of a frame's sigma.
LEAST_REST = 0.5
#: How far aside the neck is marked, metres: of a whole person, and times the logarithmic spread
#: of range, since keypoints that tell little of the size tell little of the neck.
ACROSS = 0.03
ACROSS_OF_SPREAD = 0.5
#: A track's usual sigma is the average over about so long, seconds, unless the view changes: when
#: a frame's is so many times larger or smaller.
USUAL_S = 2.0
CHANGED = 1.3


@dataclass(frozen=True, eq=False)
class ErrorShares:
    """
    How the errors of n measured ranges, as logarithms, are made up.

    :ivar body: (n,) spread of the person's own error.
    :ivar view: (n,) spread of the view's.
    :ivar noise: (n,) spread of what is new in each frame.
    :ivar across: (n,) spread of the neck aside of its view ray, metres.
    """

    body: _Array
    view: _Array
    noise: _Array
    across: _Array

    @classmethod
    def of(
        cls, log_sigma: _Array, usual: _Array, body_spread: float | _Array = BODY_SPREAD,
    ) -> ErrorShares:
        """
        Return the shares in errors of these spreads (n,), range_sigma over range.

        What stays is told by the usual spread of the track, since that of a frame goes with the
        frame's own error: a filter that took it would learn bodies from noise.

        :param usual: (n,) spreads of the frames before.
        :param body_spread: of people's own errors.
        """
        body = np.minimum(usual, body_spread)
        rest = np.maximum(usual ** 2 - body ** 2, (LEAST_REST * usual) ** 2)
        view = VIEW_SHARE * rest
        noise = np.maximum(log_sigma ** 2 - body ** 2 - view,
                           (1 - VIEW_SHARE) * (LEAST_REST * log_sigma) ** 2)
        return cls(body, np.sqrt(view), np.sqrt(noise),
                   np.hypot(ACROSS, ACROSS_OF_SPREAD * log_sigma))

    @staticmethod
    def usual(before: _Array, log_sigma: _Array) -> _Array:
        """Return the usual spreads (n,) for frames of these: those before, unless views change."""
        changed = np.abs(np.log(log_sigma / before)) > np.log(CHANGED)
        return np.where(changed, log_sigma, before)

    @classmethod
    def averaged(
        cls, before: _Array, log_sigma: _Array, elapsed_s: NDArray[np.floating],
    ) -> _Array:
        """Return the usual spreads (n,) after frames of these, so long after the last."""
        usual = cls.usual(before, log_sigma)
        return usual + (1 - np.exp(-elapsed_s / USUAL_S)) * (log_sigma - usual)

    @property
    def variance(self) -> _Array:
        """(n,) of the whole error."""
        return self.body ** 2 + self.view ** 2 + self.noise ** 2


def body_spread(estimator: str, body: Body) -> float:
    """Return the spread of people's own errors, by a name of estimators.ESTIMATORS."""
    if estimator == ShoulderEstimator.name:
        return body.shoulder_width_sigma
    return CHILDREN_SPREAD if body.children else BODY_SPREAD


def lasting(convention: str, cues: NDArray[np.uint8]) -> _Array:
    """
    Return by how much (n,) people's own errors spread more than their builds do.

    A network's habits, which sigma_scale of its convention stands for, last as long as a person
    is seen from one side, and on people who walk that is no shorter than the filter's memory.

    :param convention: as convention_of takes it.
    :param cues: (n,) of Cue; of skeletons only is sigma scaled.
    """
    return np.where(cues & Cue.SKELETON, convention_of(convention).sigma_scale, 1.0)
