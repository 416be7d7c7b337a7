"""What of a range's error stays with a person, what with the view, and what changes at once."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

#: Spread of the logarithm of range that a person's build gives in every frame alike: 0.032 to
#: 0.050 over views and gaps, of the same sign in all of them (correlation 0.7 to 1, slope 1).
BODY_SPREAD = 0.04
#: It makes at most so much of a frame's sigma, and what is left makes at least so much.
BODY_SHARE = 0.95
REST_SHARE = 0.5
#: Of the variance left, this part stays while the view does: pose, gaps, the network's habits.
VIEW_SHARE = 0.3
#: How long it does, seconds.
VIEW_TIME_S = 0.5


@dataclass(frozen=True, eq=False)
class ErrorShares:
    """
    How the errors of n measured ranges, as logarithms, are made up.

    :ivar body: (n,) times the person's own error, which is of BODY_SPREAD.
    :ivar view: (n,) times the view's error, which is of spread 1.
    :ivar noise: (n,) spread of what is new in each frame.
    """

    body: _Array
    view: _Array
    noise: _Array

    @classmethod
    def of(cls, log_sigma: _Array) -> ErrorShares:
        """Return the shares in errors of these spreads (n,), range_sigma over range."""
        body = np.minimum(BODY_SHARE * log_sigma, BODY_SPREAD)
        rest = np.maximum(log_sigma ** 2 - body ** 2, (REST_SHARE * log_sigma) ** 2)
        return cls(body / BODY_SPREAD, np.sqrt(VIEW_SHARE * rest),
                   np.sqrt((1 - VIEW_SHARE) * rest))

    @property
    def variance(self) -> _Array:
        """(n,) of the whole error."""
        return (BODY_SPREAD * self.body) ** 2 + self.view ** 2 + self.noise ** 2
