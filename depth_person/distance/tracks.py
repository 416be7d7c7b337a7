"""Everyone who is followed, and what a frame's measurements make of them."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.filtering import started, updated
from depth_person.distance.motion import Motion
from depth_person.distance.scale import ErrorShares
from depth_person.distance.states import POSITION, States

_Array = NDArray[np.float64]
_Rows = NDArray[np.intp]

#: Outliers in a row that begin anew, when for so long nothing else has come, seconds.
OUTLIERS, OUTLIERS_S = 3, 0.3
#: Two people are not nearer to each other, metres.
ROOM = 0.35
_NS = 1e-9


@dataclass(frozen=True, eq=False)
class Sightings:
    """
    What a frame says of n people.

    :ivar ids: (n,) of their tracks.
    :ivar places: (n, 3) where they are, in the frame that they are followed in.
    :ivar spreads: (n,) range_sigma over range.
    :ivar origin: (3,) where the camera is.
    :ivar stamp_ns: when.
    :ivar body_spreads: (n,) of people's own errors.
    """

    ids: NDArray[np.int32]
    places: _Array
    spreads: _Array
    origin: _Array
    stamp_ns: int
    body_spreads: _Array

    def take(self, rows: _Rows | NDArray[np.bool_]) -> Sightings:
        """Return the sightings of these rows."""
        return replace(
            self, ids=self.ids[rows], places=self.places[rows], spreads=self.spreads[rows],
            body_spreads=self.body_spreads[rows])

    def begun(self, motion: Motion) -> Tracks:
        """Return tracks that begin here."""
        return Tracks(
            self.ids, np.full(len(self.ids), self.stamp_ns, np.int64),
            np.zeros(len(self.ids), np.int64), self.spreads,
            started(self.places, self.shares(self.spreads), self.origin, motion))

    def shares(self, usual: _Array) -> ErrorShares:
        """Return what the errors are made up of, for tracks of these usual spreads (n,)."""
        return ErrorShares.of(
            self.spreads, ErrorShares.usual(usual, self.spreads), self.body_spreads)


@dataclass(frozen=True, eq=False)
class Tracks:
    """
    Who is followed.

    :ivar ids: (n,) of the pose stage.
    :ivar measured_ns: (n,) when a measurement was used last.
    :ivar outliers: (n,) how many came since and were not.
    :ivar usual: (n,) range_sigma over range, averaged over scale.USUAL_S.
    :ivar states: of the same n.
    """

    ids: NDArray[np.int32]
    measured_ns: NDArray[np.int64]
    outliers: NDArray[np.int64]
    usual: _Array
    states: States

    @classmethod
    def none(cls) -> Tracks:
        """Return nobody."""
        return Sightings(
            np.empty(0, np.int32), np.empty((0, 3)), np.empty(0), np.zeros(3), 0, np.empty(0),
        ).begun(Motion(speed=0.0, acceleration=0.0))

    def where(self, kept: NDArray[np.bool_]) -> Tracks:
        """Return the tracks that are kept (n,); in most frames all are."""
        return self if kept.all() else self.take(kept)

    def take(self, rows: _Rows | NDArray[np.bool_]) -> Tracks:
        """Return the tracks of these rows."""
        return Tracks(self.ids[rows], self.measured_ns[rows], self.outliers[rows],
                      self.usual[rows], self.states.take(rows))

    def joined(self, other: Tracks) -> Tracks:
        """Return these tracks and then the others."""
        return Tracks(
            np.concatenate([self.ids, other.ids]),
            np.concatenate([self.measured_ns, other.measured_ns]),
            np.concatenate([self.outliers, other.outliers]),
            np.concatenate([self.usual, other.usual]), self.states.joined(other.states))

    def rows(self, ids: NDArray[np.int32]) -> _Rows:
        """Return (n,) where each of the ids is; -1 for one that is not followed."""
        same = ids[:, None] == self.ids
        return np.where(same.any(axis=1), same.argmax(axis=1) if same.size else -1, -1)

    def apart(self, present: NDArray[np.int32]) -> Tracks:
        """
        Return the tracks without the lost who are where somebody present is.

        The pose stage may follow one person under two ids for a while, and then under one.

        :param present: (m,) ids of everyone in the frame.
        """
        lost = missing(self.ids, present)
        if lost.all() or not lost.any():
            return self
        places = self.states.mean[:, POSITION]
        gap = ((places[:, None] - places[~lost]) ** 2).sum(axis=2).min(axis=1)
        return self.take(~lost | (gap > ROOM ** 2))

    def seen(self, seen: Sightings, present: NDArray[np.int32], motion: Motion) -> Tracks:
        """
        Return the tracks after a frame's sightings.

        Outliers change nothing, until so many have come in a row that the track begins anew.
        Somebody new goes on for somebody lost who is expected there, or else begins.

        :param present: (m,) ids of everyone in the frame, measured or not.
        :param motion: what is not known of people who begin.
        """
        rows = self.rows(seen.ids)
        if (rows >= 0).all():
            return self._updated(rows, seen, motion)
        tracks = self._renamed(seen, present)
        rows = tracks.rows(seen.ids)
        known, fresh = seen.take(rows >= 0), seen.take(rows < 0)
        return tracks._updated(rows[rows >= 0], known, motion).joined(fresh.begun(motion))

    def _updated(self, rows: _Rows, seen: Sightings, motion: Motion) -> Tracks:
        """Return the tracks after sightings of these rows."""
        update = updated(
            self.states.take(rows), seen.places, seen.shares(self.usual[rows]), seen.origin)
        waited_s = (seen.stamp_ns - self.measured_ns[rows]) * _NS
        used = update.likely
        states = self.states.put(rows[used], update.states.take(used))
        again = ~used & (self.outliers[rows] + 1 >= OUTLIERS) & (waited_s >= OUTLIERS_S)
        if again.any():
            states = states.put(rows[again], seen.take(again).begun(motion).states)
            used = used | again
        usual, measured_ns, outliers = (
            self.usual.copy(), self.measured_ns.copy(), self.outliers.copy())
        usual[rows[used]] = ErrorShares.averaged(usual[rows], seen.spreads, waited_s)[used]
        measured_ns[rows[used]] = seen.stamp_ns
        outliers[rows] = np.where(used, 0, outliers[rows] + 1)
        return Tracks(self.ids, measured_ns, outliers, usual, states)

    def _renamed(self, seen: Sightings, present: NDArray[np.int32]) -> Tracks:
        """Return the tracks, those of lost people under the ids of new people found there."""
        lost = np.flatnonzero(missing(self.ids, present))
        new = np.flatnonzero(missing(seen.ids, self.ids))
        if not (lost.size and new.size):
            return self
        row, found = (each.ravel() for each in np.meshgrid(lost, new))
        pairs = seen.take(found)
        update = updated(
            self.states.take(row), pairs.places, pairs.shares(self.usual[row]), pairs.origin)
        ids = self.ids.copy()
        for pair in np.argsort(update.off)[:update.likely.sum()]:
            if ids[row[pair]] == self.ids[row[pair]] and seen.ids[found[pair]] not in ids:
                ids[row[pair]] = seen.ids[found[pair]]
        return replace(self, ids=ids)


def missing(ids: NDArray[np.int32], others: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return (n,) whether an id is none of the others."""
    return (ids[:, None] != others).all(axis=1)
