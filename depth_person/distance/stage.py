"""The distance stage as one object: people in, their distances over time out."""
from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.estimator import Body, Distances, Mounting, Reason
from depth_person.distance.estimators import ESTIMATORS, make_estimator
from depth_person.distance.following import FilterOptions, PeopleFilter
from depth_person.distance.scale import body_spread
from depth_person.distance.tracked import CameraPose, TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People


@dataclass(frozen=True)
class DistanceOptions:
    """
    What the distance stage may be told.

    :ivar estimator: a name of depth_person.distance.estimators.ESTIMATORS.
    :ivar body: what is known of the people in view.
    :ivar max_range: who is further away than this has no range, metres.
    :ivar filter: how people are followed through time; None for each frame by itself.
    :raises DepthPersonError: when a value is out of its range.
    """

    estimator: str = ESTIMATORS[0]
    body: Body = field(default_factory=Body)
    max_range: float = 100.0
    filter: FilterOptions | None = field(default_factory=FilterOptions)

    def __post_init__(self) -> None:
        if not self.max_range > 0:
            raise DepthPersonError(f'max_range {self.max_range:g} is not positive')


class DistanceStage:
    """
    Measures the people of one camera's frames, taken in the order of their stamps.

    :ivar options: what it was told.
    """

    def __init__(self, options: DistanceOptions) -> None:
        """Open the estimator; raise DepthPersonError when it cannot be had."""
        self.options = options
        self._estimator = make_estimator(options.estimator, body=options.body)
        self._max_range = options.max_range
        self._filter = None if options.filter is None else PeopleFilter(replace(
            options.filter, body_spread=body_spread(options.estimator, options.body)))

    def measure(
        self, people: People, intrinsics: Intrinsics | None, mounting: Mounting = Mounting(), *,
        stamp_ns: int, camera_pose: CameraPose | None = None,
    ) -> TrackedPeople:
        """
        Return how far the people of a frame are.

        :param intrinsics: of the image; None while the camera is uncalibrated, when nobody has a
            range.
        :param stamp_ns: of the image; see PeopleFilter.measure for one out of order.
        :param camera_pose: at that time; None where it is not known.
        """
        if intrinsics is None:
            return TrackedPeople.unfiltered(
                people, Distances.none(len(people), Reason.UNCALIBRATED))
        distances = within(
            self._estimator.estimate(people, intrinsics, mounting), self._max_range)
        if self._filter is None:
            return TrackedPeople.unfiltered(people, distances)
        tracked = self._filter.measure(
            people, distances, stamp_ns=stamp_ns, camera_pose=camera_pose)
        return replace(tracked, distances=within(tracked.distances, self._max_range))


def within(distances: Distances, max_range: float) -> Distances:
    """Return the distances without those beyond max_range metres, which get their reason."""
    far = distances.known & (distances.range > max_range)
    if not far.any():
        return distances
    return Distances.of(
        position=distances.position, range_sigma=distances.range_sigma, cues=distances.cues,
        reason=np.where(far, np.uint8(Reason.OUT_OF_RANGE), distances.reason))
