"""What every distance estimator takes and gives."""
from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.vectors import length
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People

#: A gravity direction with a larger spread is no better than none, radians.
LARGEST_TILT = 0.1
#: A body whose own down is this far (cosine) against gravity hangs upside down.
UPSIDE_DOWN = -0.6


class Reason(IntEnum):
    """
    Why a person has no range; NONE where there is one.

    UNCALIBRATED is for whoever has no intrinsics to give an estimator. COINCIDENT_SHOULDERS are
    closer together than the noise of their keypoints lets one tell.
    """

    NONE = 0
    UNCALIBRATED = 1
    NO_SHOULDERS = 2
    COINCIDENT_SHOULDERS = 3
    TOO_FEW_KEYPOINTS = 4
    OUT_OF_RANGE = 5
    IMPLAUSIBLE_SKELETON = 6


class Cue(IntFlag):
    """What a range was taken from."""

    NONE = 0
    SHOULDERS = 1
    NECK = 2
    SKELETON = 4
    GROUND = 8
    BOX = 16


# NumPy compares arrays with a member of an enumeration in five times the time.
_HAS_RANGE = int(Reason.NONE)


@dataclass(frozen=True)
class Body:
    """
    What is known of the people in view; None where nothing is.

    Lengths in metres; each sigma is the spread of its length relative to it.

    :raises DepthPersonError: when a length or a spread cannot be anyone's.
    """

    shoulder_width: float | None = None
    shoulder_width_sigma: float = 0.076
    stature: float | None = None
    stature_sigma: float = 0.01
    children: bool = False

    def __post_init__(self) -> None:
        if self.shoulder_width is not None and not 0.1 <= self.shoulder_width <= 1.0:
            raise DepthPersonError(
                f'a shoulder width of {self.shoulder_width:g} m is not between 0.1 and 1')
        if self.stature is not None and not 0.4 <= self.stature <= 2.6:
            raise DepthPersonError(f'a stature of {self.stature:g} m is not between 0.4 and 2.6')
        for sigma in (self.shoulder_width_sigma, self.stature_sigma):
            if not 0 <= sigma < 1:
                raise DepthPersonError(
                    f'a spread of {sigma:g} is not between 0 and 1; '
                    'it is relative to the length, not in metres')


@dataclass(frozen=True, eq=False)
class Mounting:
    """
    What is known of the camera's attitude and height; None where nothing is.

    :ivar gravity: unit vector of the direction down, in the camera optical frame.
    :ivar gravity_sigma: spread of its direction, radians.
    :ivar height: of the camera above the ground that people stand on, metres.
    :ivar height_sigma: its spread, metres.
    """

    gravity: NDArray[np.float64] | None = None
    gravity_sigma: float = 0.01
    height: float | None = None
    height_sigma: float = 0.05

    @property
    def down(self) -> NDArray[np.float64]:
        """(1, 3) unit vector of gravity; NaN where it is not known well enough to help."""
        if self.gravity is None or self.gravity_sigma > LARGEST_TILT:
            return np.full((1, 3), np.nan)
        gravity = np.asarray(self.gravity, np.float64)[None]
        return gravity / np.linalg.norm(gravity)


@dataclass(frozen=True, eq=False)
class Distances:
    """
    How far n people are, row by row as in the People they were measured from.

    :ivar range: (n,) straight-line distance from the camera to the neck, metres; NaN for none.
    :ivar range_sigma: (n,) one standard deviation of range, metres; NaN for none.
    :ivar position: (n, 3) the neck in the camera optical frame, metres; NaN for none.
    :ivar reason: (n,) uint8 of Reason.
    :ivar cues: (n,) uint8 of Cue.
    """

    range: NDArray[np.float64]
    range_sigma: NDArray[np.float64]
    position: NDArray[np.float64]
    reason: NDArray[np.uint8]
    cues: NDArray[np.uint8]

    @property
    def depth(self) -> NDArray[np.float64]:
        """(n,) distance along the optical axis, metres."""
        return self.position[:, 2]

    @property
    def known(self) -> NDArray[np.bool_]:
        """(n,) whether the person has a range."""
        return self.reason == _HAS_RANGE

    def __len__(self) -> int:
        return len(self.range)

    @classmethod
    def of(
        cls, *, position: NDArray[np.float64], range_sigma: NDArray[np.float64],
        reason: NDArray[np.uint8], cues: NDArray[np.uint8],
    ) -> Distances:
        """Return the distances to these positions, all NaN and without cue where one has none."""
        known = reason == _HAS_RANGE
        position = np.where(known[:, None], position, np.nan)
        return cls(
            range=length(position),
            range_sigma=np.where(known, range_sigma, np.nan), position=position,
            reason=reason, cues=np.where(known, cues, np.uint8(Cue.NONE)))

    @classmethod
    def none(cls, n: int, reason: Reason) -> Distances:
        """Return n people without a distance, all for the same reason."""
        return cls.of(
            position=np.full((n, 3), np.nan), range_sigma=np.full(n, np.nan),
            reason=np.full(n, reason, np.uint8), cues=np.zeros(n, np.uint8))


class DistanceEstimator(Protocol):
    """Turns the people of a frame into distances; holds no state between frames."""

    name: str

    def estimate(
        self, people: People, intrinsics: Intrinsics, mounting: Mounting = Mounting(),
    ) -> Distances:
        """Return one distance a person; never raises for what a keypoint holds."""
        ...
