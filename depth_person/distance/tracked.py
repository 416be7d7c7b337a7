"""People with their distances over time: what the distance stage gives for a frame."""
from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.estimator import Distances, Reason
from depth_person.pose.people import People
from depth_person.pose.skeleton import N_KEYPOINTS


@dataclass(frozen=True, eq=False)
class CameraPose:
    """
    Where the camera is at the time of an image, in a frame that does not move.

    :ivar rotation: (3, 3) from the camera optical frame to the fixed frame.
    :ivar position: (3,) of the camera in the fixed frame, metres.
    """

    rotation: NDArray[np.float64]
    position: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TrackedPeople:
    """
    The n people of one frame: those seen, then those who are hidden and only predicted.

    :ivar people: as the pose stage found them; the keypoints of the hidden are all NaN.
    :ivar distances: how far they are, filtered over time where a filter runs.
    :ivar measured: how far this frame alone says they are; NaN for the hidden.
    :ivar velocity: (n, 3) along the axes of the camera optical frame, metres a second; relative
        to the fixed frame where the camera's pose is known, else to the camera. NaN where not
        known.
    :ivar velocity_sigma: (n,) one standard deviation of the velocity along the view ray.
    :ivar time_to_contact: (n,) seconds until the range is zero at the present rate; infinite for
        who does not come nearer, NaN where not known.
    :ivar time_to_contact_sigma: (n,) its standard deviation; NaN where the time is not finite.
    :ivar predicted: (n,) whether `distances` is a prediction: the person is hidden, or this frame
        gives no range or an outlier.
    """

    people: People
    distances: Distances
    measured: Distances
    velocity: NDArray[np.float64]
    velocity_sigma: NDArray[np.float64]
    time_to_contact: NDArray[np.float64]
    time_to_contact_sigma: NDArray[np.float64]
    predicted: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.people)

    @classmethod
    def unfiltered(cls, people: People, distances: Distances) -> TrackedPeople:
        """Return the people of a single frame, of whose motion nothing is known."""
        unknown = np.full(len(people), np.nan)
        return cls(
            people=people, distances=distances, measured=distances,
            velocity=np.full((len(people), 3), np.nan), velocity_sigma=unknown,
            time_to_contact=unknown, time_to_contact_sigma=unknown,
            predicted=np.zeros(len(people), np.bool_))

    def with_hidden(self, track_ids: NDArray[np.int32]) -> TrackedPeople:
        """Return these people and then more, of whom nothing is known but their track ids."""
        n = len(track_ids)
        if not n:
            return self
        people = People(
            np.concatenate([
                self.people.keypoints, np.full((n, N_KEYPOINTS, 3), np.nan, np.float32)]),
            np.concatenate([self.people.track_ids, track_ids]), self.people.neck_measured,
            self.people.convention)
        nowhere = Distances.none(n, Reason.TOO_FEW_KEYPOINTS)
        return TrackedPeople.unfiltered(people, Distances(*(
            np.concatenate([getattr(self.measured, field.name), getattr(nowhere, field.name)])
            for field in fields(Distances))))
