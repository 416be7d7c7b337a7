"""Measures estimated distances against known ones, person by person."""
from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.estimator import Cue, DistanceEstimator, Distances, Mounting, Reason
from depth_person.distance.following import FilterOptions, PeopleFilter
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.pose.skeleton import Keypoint
from depth_person.replay.dataset import Fault, TrueFrame, TruePerson
from depth_person.replay.keypoints import KeypointSource

_SHOULDERS = [Keypoint.L_SHOULDER, Keypoint.R_SHOULDER]
_COCO17_SHOULDERS = slice(5, 7)


@dataclass(frozen=True)
class Sample:
    """
    One true person, found or not, or one found person who is no true one (`person` is None).

    :ivar depth_true: the data set's depth of its reference point, metres.
    :ivar range_true: its range, likewise.
    :ivar range_neck: what `range` is to be compared with: range_true carried to the neck.
    :ivar range: as estimated, metres; None when the person was not found, or for `reason`; over
        time where people are followed, also for who is not found but predicted.
    :ivar range_measured: what this frame alone says, with its spread range_sigma_measured.
    :ivar time_s: of the frame in its sequence.
    :ivar shoulder_error_px: mean distance of the shoulders from their true places, left and right
        exchanged if that is nearer.
    """

    image: str
    person: int | str | None
    scenario: str
    tag: str
    found: bool
    depth_true: float | None = None
    range_true: float | None = None
    range_neck: float | None = None
    depth: float | None = None
    range: float | None = None
    range_sigma: float | None = None
    reason: str | None = None
    cues: tuple[str, ...] = ()
    track_id: int | None = None
    range_measured: float | None = None
    range_sigma_measured: float | None = None
    predicted: bool = False
    time_s: float | None = None
    shoulder_error_px: float | None = None
    kind: str | None = None
    yaw_deg: float | None = None
    visible_fraction: float | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the sample as JSON holds it."""
        return asdict(self)


class Evaluation:
    """
    Runs an estimator over a data set.

    :param source: gives the keypoints.
    :param mounting: what the estimator is told of the camera; None for each frame's own truth.
    :param follow: how people of sequences are followed; None for each frame by itself.
    :ivar faults: the frames that could not be used so far.
    """

    def __init__(
        self, source: KeypointSource, estimator: DistanceEstimator, *,
        mounting: Mounting | None = Mounting(), follow: FilterOptions | None = None,
    ) -> None:
        self._source = source
        self._estimator = estimator
        self._mounting = mounting
        self._follow = follow
        self._filter: PeopleFilter | None = None
        self._tracks: dict[int | str, int] = {}
        self.faults: list[Fault] = []

    def run(self, clips: Iterable[Iterable[TrueFrame]]) -> Iterator[list[Sample]]:
        """Yield the samples of frame after frame; none for one that cannot be used."""
        for clip in clips:
            self._source.start_clip()
            self._filter = None if self._follow is None else PeopleFilter(self._follow)
            self._tracks.clear()
            for frame in clip:
                try:
                    yield self._measure(frame)
                except DepthPersonError as error:
                    self.faults.append(Fault(frame.name, str(error)))
                    yield []

    def _measure(self, frame: TrueFrame) -> list[Sample]:
        people = self._source.people(frame)
        mounting = frame.mounting if self._mounting is None else self._mounting
        tracked = TrackedPeople.unfiltered(
            people, self._estimator.estimate(people, frame.intrinsics, mounting))
        if self._filter is not None and frame.time_s is not None:
            tracked = self._filter.measure(
                people, tracked.measured, stamp_ns=round(frame.time_s * 1e9))
        matches = self._source.match(frame, people)
        rows = [*self._with_hidden(frame, tracked, matches),
                *(row for row in range(len(people)) if row not in matches)]
        owners = [*frame.people, *[None] * (len(rows) - len(frame.people))]
        return [
            Sample(
                image=frame.name, scenario=frame.scenario, tag=frame.tag, time_s=frame.time_s,
                found=0 <= row < len(people), **_truth(person, tracked.distances, row),
                **_estimate(person, tracked, row))
            for person, row in zip(owners, rows, strict=True)]

    def _with_hidden(
        self, frame: TrueFrame, tracked: TrackedPeople, matches: NDArray[np.intp],
    ) -> Iterator[int]:
        """Yield the row of each true person; of who was found before, also where predicted."""
        hidden = {int(track_id): row for row, track_id in enumerate(tracked.people.track_ids)
                  if not np.isfinite(tracked.people.keypoints[row]).any()}
        for person, row in zip(frame.people, matches.tolist(), strict=True):
            if row >= 0:
                self._tracks[person.id] = int(tracked.people.track_ids[row])
                yield row
            else:
                yield hidden.get(self._tracks.get(person.id, -1), -1)


def _truth(person: TruePerson | None, distances: Distances, row: int) -> dict[str, Any]:
    """Return what a sample says of the true person."""
    if person is None:
        return {'person': None}
    known = row >= 0 and distances.known[row]
    return {
        'person': person.id, 'kind': person.kind, 'yaw_deg': person.yaw_deg,
        'visible_fraction': person.visible_fraction,
        'depth_true': person.depth, 'range_true': person.range,
        'range_neck': person.range_along(distances.position[row]) if known else None,
    }


def _estimate(
    person: TruePerson | None, tracked: TrackedPeople, row: int,
) -> dict[str, Any]:
    """Return what a sample says of the found person; nothing when there is none."""
    if row < 0:
        return {}
    people, distances, measured = tracked.people, tracked.distances, tracked.measured
    found: dict[str, Any] = {
        'track_id': int(people.track_ids[row]), 'predicted': bool(tracked.predicted[row]),
        'shoulder_error_px': _shoulder_error(person, people.keypoints[row]),
    }
    if measured.known[row]:
        found['range_measured'] = float(measured.range[row])
        found['range_sigma_measured'] = float(measured.range_sigma[row])
    if not distances.known[row]:
        return {**found, 'reason': Reason(distances.reason[row]).name.lower()}
    return {
        **found, 'depth': float(distances.depth[row]), 'range': float(distances.range[row]),
        'range_sigma': float(distances.range_sigma[row]),
        'cues': tuple(str(cue.name).lower() for cue in Cue if cue & distances.cues[row]),
    }


def _shoulder_error(
    person: TruePerson | None, keypoints: NDArray[np.float32],
) -> float | None:
    if person is None or person.keypoints is None:
        return None
    truth, found = person.keypoints[_COCO17_SHOULDERS, :2], keypoints[_SHOULDERS, :2]
    error = min(
        np.linalg.norm(found - shoulders, axis=1).mean() for shoulders in (truth, truth[::-1]))
    return float(error) if np.isfinite(error) else None
