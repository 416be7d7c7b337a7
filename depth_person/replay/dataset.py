"""What a data set of people at known distances holds."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Mounting

#: How far the shoulders' midpoint lies behind the front of the torso, metres (half of a chest's
#: depth, less what shoulders lie before its middle).
SURFACE_TO_NECK = 0.075


class Reference(Enum):
    """Which point of a person a measured distance belongs to."""

    NECK = 'neck'
    #: A point above or below the neck, such as a box's centre or the feet.
    VERTICAL = 'vertical'
    #: The front of the torso, as a depth camera sees it.
    SURFACE = 'surface'


@dataclass(frozen=True, eq=False)
class TruePerson:
    """
    One person of a frame; None where the data set does not say.

    :ivar depth: of the reference point along the optical axis, metres.
    :ivar range: of the reference point in a straight line, metres.
    :ivar boxes: (k, 4) x0, y0, x1, y1 in pixels: the whole person, and what is visible of them.
    :ivar keypoints: (17, 3) in COCO's order: u, v, and 2 visible, 1 hidden, 0 outside.
    :ivar flags: for each keypoint what hides it: visible, self_occluded, occluded, ...
    :ivar neck: (2,) u, v.
    :ivar recorded: (17, 3) in COCO's order: u, v, score, as some network marked them.
    """

    id: int | str
    depth: float
    range: float
    reference: Reference = Reference.NECK
    boxes: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4)))
    kind: str | None = None
    yaw_deg: float | None = None
    visible_fraction: float | None = None
    keypoints: NDArray[np.float64] | None = None
    flags: tuple[str, ...] | None = None
    neck: NDArray[np.float64] | None = None
    recorded: NDArray[np.float64] | None = None

    def range_along(self, direction: NDArray[np.float64]) -> float:
        """
        Return the range of the neck, if it is seen in this direction.

        Where the reference is not the neck, its depth still is the neck's (the camera being
        level), or is a little less for a torso's surface; its range is not.

        :param direction: (3,) in the camera optical frame, z positive, of any length.
        """
        if self.reference is Reference.NECK:
            return self.range
        depth = self.depth + SURFACE_TO_NECK * (self.reference is Reference.SURFACE)
        return depth * float(np.linalg.norm(direction) / direction[2])


@dataclass(frozen=True, eq=False)
class TrueFrame:
    """
    One frame with the people in it.

    :ivar name: the image relative to the data set, or the frame's name in a recording.
    :ivar image: the file; None for a recording.
    :ivar mounting: the camera's true attitude, and its height where the ground is level.
    """

    name: str
    image: Path | None
    intrinsics: Intrinsics
    people: tuple[TruePerson, ...]
    scenario: str = ''
    tag: str = ''
    time_s: float | None = None
    mounting: Mounting = field(default_factory=Mounting)


@dataclass(frozen=True)
class Fault:
    """A file of a data set that could not be used, and why."""

    file: str
    message: str


@dataclass(frozen=True, eq=False)
class Dataset:
    """
    Frames with known distances.

    :ivar clips: each a still (one frame) or a sequence in order of time.
    :ivar faults: what could not be read; the rest goes on without it.
    """

    clips: tuple[tuple[TrueFrame, ...], ...]
    faults: tuple[Fault, ...] = ()

    @property
    def frames(self) -> Iterator[TrueFrame]:
        """Every frame of every clip."""
        return (frame for clip in self.clips for frame in clip)
