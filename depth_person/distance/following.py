"""Follows the people of one camera through time: stamps, gaps and the camera's motion."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.contact import time_to_contact
from depth_person.distance.estimator import Cue, Distances, Reason
from depth_person.distance.filtering import predicted
from depth_person.distance.motion import Motion
from depth_person.distance.scale import BODY_SPREAD, lasting
from depth_person.distance.states import POSITION, States, VELOCITY
from depth_person.distance.tracked import CameraPose, TrackedPeople
from depth_person.distance.tracks import missing, Sightings, Tracks
from depth_person.distance.vectors import length, unit_or_zero
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People

_Array = NDArray[np.float64]

#: How fast people move before anything is known of it, metres a second.
SPEED = 1.0
#: The same of a camera of which nothing is known; how it turns, rad/s; and how that changes,
#: rad/s^2 by the root of a second.
CAMERA_SPEED, TURN_RATE, TURN_ACCELERATION = 1.0, 0.5, 1.0
#: A camera that seems to move faster, metres a second, has a pose in another fixed frame.
LARGEST_SPEED = 60.0
#: Over how long the camera's velocity is averaged, seconds.
CAMERA_MEMORY_S = 0.2
#: Who has been unseen for so long is forgotten, seconds; until then who is found again goes on.
FORGOTTEN_S = 3.0
#: Stamps further back than this, seconds, or so many in a row, are those of another time.
BACK_S, BACK_FRAMES = 1.0, 3
_IN_CAMERA = CameraPose(np.eye(3), np.zeros(3))
_NS = 1e-9


@dataclass(frozen=True)
class FilterOptions:
    """
    What the filter may be told.

    :ivar prediction_time: how long people are predicted who are not seen, seconds.
    :ivar person_acceleration: by how much people's velocities change: the square root of the
        intensity of a white acceleration, m/s^2 by the root of a second.
    :ivar camera_acceleration: likewise the camera's, where its pose is not known.
    :ivar body_spread: spread of the logarithm of range that people's builds give; see scale.
    :raises DepthPersonError: when a value is out of its range.
    """

    prediction_time: float = 1.0
    person_acceleration: float = 0.6
    camera_acceleration: float = 0.3
    body_spread: float = BODY_SPREAD

    def __post_init__(self) -> None:
        if not 0 <= self.prediction_time < np.inf:
            raise DepthPersonError(
                f'prediction_time {self.prediction_time:g} s is not 0 or more; 0 predicts nobody')
        if not 0 < self.person_acceleration < np.inf:
            raise DepthPersonError(
                f'person_acceleration {self.person_acceleration:g} is not positive; nobody keeps '
                'the same pace for ever')
        if not 0 <= self.camera_acceleration < np.inf:
            raise DepthPersonError(
                f'camera_acceleration {self.camera_acceleration:g} is not 0 or more; 0 is for a '
                'camera that stands still')


class PeopleFilter:
    """
    A filter for each track: distances of frame after frame in, distances over time out.

    With the camera's pose people are followed in the fixed frame; without, in the camera's, whose
    motion is then noise. When poses come or stay away, everybody is carried over.
    """

    def __init__(self, options: FilterOptions = FilterOptions()) -> None:
        self._options = options
        self._tracks = Tracks.none()
        self._stamp_ns: int | None = None
        self._frames_back = 0
        self._pose: CameraPose | None = None
        self._camera_velocity = np.zeros(3)

    def measure(
        self, people: People, measured: Distances, *, stamp_ns: int,
        camera_pose: CameraPose | None = None,
    ) -> TrackedPeople:
        """
        Return the distances over time of the people of a frame, and of those who are hidden.

        A frame no newer than one before is not used: its people are as measured. When the clock
        was set back or a recording starts again, nobody is known any more.
        """
        if self._is_old(stamp_ns):
            return TrackedPeople.unfiltered(people, measured)
        self._advance(stamp_ns, camera_pose)
        pose = self._camera
        known = (measured.known & (measured.range_sigma > 0) & np.isfinite(measured.range_sigma)
                 & _single(people.track_ids))
        seen = Sightings(
            people.track_ids[known], measured.position[known] @ pose.rotation.T + pose.position,
            measured.range_sigma[known] / measured.range[known], pose.position, stamp_ns,
            self._options.body_spread * lasting(people.convention, measured.cues[known]))
        self._tracks = self._tracks.seen(
            seen, people.track_ids, self._motion(self._pose is not None)).apart(people.track_ids)
        return self._result(people, measured, stamp_ns)

    @property
    def _camera(self) -> CameraPose:
        """The camera's pose in the frame that people are followed in."""
        return self._pose or _IN_CAMERA

    def _is_old(self, stamp_ns: int) -> bool:
        """Return whether a frame is no news; forget everybody where time starts again."""
        if self._stamp_ns is None or stamp_ns > self._stamp_ns:
            self._frames_back = 0
            return False
        if stamp_ns == self._stamp_ns:
            return True
        self._frames_back += 1
        if self._frames_back < BACK_FRAMES and (self._stamp_ns - stamp_ns) * _NS <= BACK_S:
            return True
        self._tracks, self._stamp_ns, self._frames_back = Tracks.none(), None, 0
        self._pose, self._camera_velocity = None, np.zeros(3)
        return False

    def _advance(self, stamp_ns: int, pose: CameraPose | None) -> None:
        """Bring everybody to the time of the stamp, and into the frame of the pose."""
        elapsed_s = 0.0 if self._stamp_ns is None else (stamp_ns - self._stamp_ns) * _NS
        tracks = self._tracks
        tracks = tracks.where((stamp_ns - tracks.measured_ns) * _NS <= FORGOTTEN_S)
        states, before = tracks.states, self._pose
        velocity = np.zeros(3)
        if before is not None and pose is not None and elapsed_s > 0:
            velocity = (pose.position - before.position) / elapsed_s
        fixed = (before is not None and pose is not None
                 and float(length(velocity)) <= LARGEST_SPEED)
        if before is not None and not fixed:
            states = _doubted(_seen_from(states, before, self._camera_velocity))
        states = predicted(
            states, elapsed_s, self._motion(fixed),
            self._camera.position if fixed else np.zeros(3))
        if pose is not None and not fixed:
            states = _doubted(states).moved(pose.rotation, pose.position)
        gain = 1 - np.exp(-elapsed_s / CAMERA_MEMORY_S) if fixed else 0.0
        self._camera_velocity = fixed * self._camera_velocity + gain * (
            velocity - self._camera_velocity)
        self._tracks = replace(tracks, states=states)
        self._stamp_ns, self._pose = stamp_ns, pose

    def _motion(self, fixed: bool) -> Motion:
        """Return what is not known of motion in a fixed frame, or in the camera's."""
        options = self._options
        if fixed:
            return Motion(SPEED, options.person_acceleration)
        return Motion(
            float(np.hypot(SPEED, CAMERA_SPEED)),
            float(np.hypot(options.person_acceleration, options.camera_acceleration)),
            TURN_RATE, TURN_ACCELERATION)

    def _result(self, people: People, measured: Distances, stamp_ns: int) -> TrackedPeople:
        """Return the people of the frame, then the hidden, as they are thought to be."""
        tracks = self._tracks
        tracks = tracks.where(
            (stamp_ns - tracks.measured_ns) * _NS <= self._options.prediction_time)
        hidden = tracks.ids[missing(tracks.ids, people.track_ids)]
        result = TrackedPeople.unfiltered(people, measured).with_hidden(hidden)
        rows = tracks.rows(result.people.track_ids)
        which = rows >= 0
        tracks = tracks.take(rows[which])
        contact, contact_sigma = time_to_contact(
            tracks.states, self._camera.position, self._camera_velocity)
        states = tracks.states
        if self._pose is not None:
            states = _seen_from(states, self._pose, np.zeros(3))
        sigma, speed_sigma = _along_rays(states)
        predicted = tracks.measured_ns != stamp_ns
        raw = result.measured
        return replace(
            result,
            distances=Distances.of(
                position=_filled(raw.position, which, states.mean[:, POSITION]),
                range_sigma=_filled(raw.range_sigma, which, sigma),
                reason=_filled(raw.reason, which, Reason.NONE),
                cues=_filled(raw.cues, which, np.where(predicted, Cue.NONE, raw.cues[which]))),
            velocity=_filled(result.velocity, which, states.mean[:, VELOCITY]),
            velocity_sigma=_filled(result.velocity_sigma, which, speed_sigma),
            time_to_contact=_filled(result.time_to_contact, which, contact),
            time_to_contact_sigma=_filled(result.time_to_contact_sigma, which, contact_sigma),
            predicted=_filled(result.predicted, which, predicted))


def _seen_from(states: States, pose: CameraPose, velocity: _Array) -> States:
    """Return the states in the frame of a camera there that moves at this velocity."""
    mean = states.mean.copy()
    mean[:, VELOCITY] -= velocity
    back = pose.rotation.T
    return States(mean, states.covariance).moved(back, -back @ pose.position)


def _doubted(states: States) -> States:
    """Return states in a camera's frame, whose own motion then is unknown."""
    unknown = Motion(CAMERA_SPEED, 0.0, TURN_RATE)
    return states.doubted(unknown.velocities(states.mean[:, POSITION]))


def _along_rays(states: States) -> tuple[_Array, _Array]:
    """Return (n,) the spreads of range and of its rate, for states in the camera's frame."""
    ray = unit_or_zero(states.mean[:, POSITION])
    sigmas = [
        np.sqrt((ray[:, None] @ states.covariance[:, part, part] @ ray[..., None])[:, 0, 0])
        for part in (POSITION, VELOCITY)]
    return sigmas[0], sigmas[1]


def _single(ids: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return (n,) whether an id is nobody else's; who shares one cannot be followed."""
    return (ids[:, None] == ids).sum(axis=1) == 1


def _filled(values: NDArray, rows: NDArray[np.bool_], new: object) -> NDArray:
    """Return the values with those of some rows replaced."""
    result = values.copy()
    result[rows] = new
    return result
