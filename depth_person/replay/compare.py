"""Compares two sets of results, person by person."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.replay.pairing import pair, Pairs
from depth_person.replay.results import Results

#: How ids may differ: the same numbers; each person one number throughout, whichever; anyhow.
IDS = ('renamed', 'same', 'any')

_Array = NDArray[np.float64]
#: No track has this id.
_NOBODY = -1


@dataclass(frozen=True)
class Tolerances:
    """
    How far results may differ and still count as the same.

    :ivar range: change of the range over it.
    :ivar position: how far the neck moved, over the range.
    :ivar sigma: change of sigma over it.
    :ivar allow: share of the people, and of the frames, that may be beyond or missing.
    :raises DepthPersonError: when one is no share.
    """

    range: float = 0.03
    position: float = 0.05
    sigma: float = 0.3
    allow: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value < float('inf'):
                raise DepthPersonError(
                    f'a tolerance of {value} for {field.name} is no number of at least 0')


@dataclass(frozen=True, eq=False)
class Comparison:
    """
    What moved from results a to results b; columns are as long as the pairs' rows.

    :ivar range_change: relative; NaN where one of both has none.
    :ivar position_change: distance over a's range.
    :ivar sigma_change: relative.
    :ivar lost: whether only one of both has a range, a sigma or a position.
    :ivar id_moved: whether the ids differ in a way that was not allowed.
    """

    a: Results
    b: Results
    pairs: Pairs
    tolerances: Tolerances
    range_change: _Array
    position_change: _Array
    sigma_change: _Array
    lost: NDArray[np.bool_]
    id_moved: NDArray[np.bool_]

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Whether only one of both has the person in this frame."""
        return ~self.pairs.both

    @cached_property
    def beyond(self) -> NDArray[np.bool_]:
        """Whether the person differs by more than tolerated."""
        return self.missing | self.lost | self.id_moved | (self.excess > 1)

    @cached_property
    def excess(self) -> _Array:
        """The largest change over its tolerance; 0 where there are none."""
        changes = np.array([
            _over(self.range_change, self.tolerances.range),
            _over(self.position_change, self.tolerances.position),
            _over(self.sigma_change, self.tolerances.sigma)])
        return np.where(np.isnan(changes), 0.0, changes).max(axis=0)

    @property
    def lone_frames(self) -> tuple[int, int]:
        """How many frames only a, and only b has."""
        common = len(self.pairs.stamps_ns)
        return len(self.a.stamps_ns) - common, len(self.b.stamps_ns) - common

    @property
    def agree(self) -> bool:
        """Whether no more than the allowed shares of people and frames differ."""
        frames = len(self.pairs.stamps_ns) + sum(self.lone_frames)
        allow = self.tolerances.allow
        return bool(
            len(self.pairs.stamps_ns) and sum(self.lone_frames) <= allow * frames
            and self.beyond.sum() <= allow * len(self.beyond))

    def tracks(self) -> Iterator[tuple[int | None, int | None, NDArray[np.intp]]]:
        """Yield the id in a, that in b, and the rows of each person; None: not there."""
        id_a, id_b = self.ids
        for own in self.a.tracks:
            yield own, self.pairs.renaming.get(own), np.flatnonzero(
                (id_a == own) & (self.pairs.row_a >= 0))
        for other in self.b.tracks:
            rows = np.flatnonzero((id_b == other) & (self.pairs.row_a < 0))
            if rows.size:
                yield None, other, rows

    @property
    def persons(self) -> NDArray[np.int64]:
        """Whose row it is: the track id in a, or that in b of who is only there."""
        id_a, id_b = self.ids
        return np.where(self.pairs.row_a >= 0, id_a, id_b)

    @property
    def ids(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The track ids in a and in b; -1 where the person is not there."""
        return (_column(self.a.people.track_id, self.pairs.row_a, _NOBODY),
                _column(self.b.people.track_id, self.pairs.row_b, _NOBODY))


def compare(
    a: Results, b: Results, tolerances: Tolerances = Tolerances(), *, ids: str = IDS[0],
) -> Comparison:
    """
    Return what moved from a to b.

    :param ids: how ids may differ, one of IDS.
    """
    pairs = pair(a, b)
    old, new = a.people, b.people
    range_a, range_b = _column(old.range, pairs.row_a), _column(new.range, pairs.row_b)
    place_a, place_b = _column(old.position, pairs.row_a), _column(new.position, pairs.row_b)
    moved = np.linalg.norm(place_b - place_a, axis=1)
    sigma_a, sigma_b = (
        _column(old.range_sigma, pairs.row_a), _column(new.range_sigma, pairs.row_b))
    return Comparison(
        a, b, pairs, tolerances, range_change=range_b / range_a - 1,
        position_change=moved / range_a, sigma_change=_ratio(sigma_b, sigma_a) - 1,
        lost=pairs.both & np.any([
            _only_one(range_a, range_b), _only_one(sigma_a, sigma_b),
            _only_one(place_a.sum(axis=1), place_b.sum(axis=1))], axis=0),
        id_moved=_moved_ids(a, b, pairs, ids))


def _moved_ids(a: Results, b: Results, pairs: Pairs, ids: str) -> NDArray[np.bool_]:
    if ids == 'any':
        return np.zeros(len(pairs.frame), np.bool_)
    id_a = _column(a.people.track_id, pairs.row_a, _NOBODY)
    id_b = _column(b.people.track_id, pairs.row_b, _NOBODY)
    expected = id_a if ids == 'same' else np.array(
        [pairs.renaming.get(int(own), _NOBODY) for own in id_a], np.int64)
    return pairs.both & (id_b != expected)


def _column(values: NDArray, rows: NDArray[np.intp], missing: float = np.nan) -> NDArray:
    """Return the values of these rows; `missing` for -1."""
    padded = np.concatenate([values, np.full((1, *values.shape[1:]), missing, values.dtype)])
    return padded[rows]


def _ratio(new: _Array, old: _Array) -> _Array:
    """Return new over old, 1 where both are 0."""
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where((new == 0) & (old == 0), 1.0, new / old)


def _only_one(a: _Array, b: _Array) -> NDArray[np.bool_]:
    return np.isfinite(a) != np.isfinite(b)


def _over(change: _Array, tolerance: float) -> _Array:
    """Return the size of a change in units of its tolerance."""
    size = np.abs(change)
    return size / tolerance if tolerance > 0 else np.where(size > 0, np.inf, size)
