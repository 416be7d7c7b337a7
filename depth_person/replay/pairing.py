"""Which person of one set of results is which of another."""
from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.results import PersonRows, Results

#: People further apart than this share of their range are not paired by where they are.
GATE = 0.5
#: People of different tracks are paired only if that is so much nearer, as a share of the range:
#: results that all read further must not mix people up who cross.
OTHER_TRACK = 0.1


@dataclass(frozen=True, eq=False)
class Pairs:
    """
    The people of two sets of results, row by row; what only one of them has is beside -1.

    :ivar stamps_ns: (f,) of the frames that both have.
    :ivar frame: (k,) index into stamps_ns; -1 in a frame that only one has.
    :ivar row_a: (k,) row of a.people.
    :ivar row_b: (k,) row of b.people.
    :ivar renaming: track id of b by that of a, one to one: those who meet most often.
    """

    stamps_ns: NDArray[np.int64]
    frame: NDArray[np.intp]
    row_a: NDArray[np.intp]
    row_b: NDArray[np.intp]
    renaming: dict[int, int]

    @property
    def both(self) -> NDArray[np.bool_]:
        """(k,) whether a row is a pair."""
        return (self.row_a >= 0) & (self.row_b >= 0)


def pair(a: Results, b: Results) -> Pairs:
    """
    Pair the people of two sets of results in the frames of equal stamps.

    In each frame the nearest are paired first, each once. From how often two ids meet follows
    which track is which; then they are paired again, with some preference for the same track,
    and at last by track alone those who could not be by where they are.
    """
    stamps, frames_a, frames_b = np.intersect1d(
        a.stamps_ns, b.stamps_ns, assume_unique=True, return_indices=True)
    rows_a, rows_b = _rows_by_frame(a), _rows_by_frame(b)
    common = [(rows_a[fa], rows_b[fb]) for fa, fb in zip(frames_a, frames_b, strict=True)]
    near = [_nearest(a.people, b.people, *rows) for rows in common]
    renaming = _renaming(a.people.track_id, b.people.track_id, near)
    found: list[tuple[int, int, int]] = []
    for index, rows in enumerate(common):
        pairs = _nearest(a.people, b.people, *rows, renaming)
        pairs += _by_name(a.people, b.people, *rows, pairs, renaming)
        found += [(index, *each) for each in pairs]
    in_frames = np.array(found, np.intp).reshape(-1, 3)
    frame, row_a, row_b = np.concatenate([
        in_frames,
        _lone(a, in_frames[:, 1], frames_a, column=1),
        _lone(b, in_frames[:, 2], frames_b, column=2)]).T
    return Pairs(stamps, frame, row_a, row_b, renaming)


def _lone(
    results: Results, paired: NDArray[np.intp], common: NDArray[np.intp], *, column: int,
) -> NDArray[np.intp]:
    """
    Return rows (frame, row_a, row_b) of the people who have no pair.

    :param common: the frames that both have.
    :param column: where the row goes.
    """
    place = np.full(len(results.stamps_ns), -1, np.intp)
    place[common] = np.arange(len(common))
    lone = np.setdiff1d(np.arange(len(results.people)), paired)
    rows = np.full((len(lone), 3), -1, np.intp)
    rows[:, 0], rows[:, column] = place[results.people.frame[lone]], lone
    return rows


def _rows_by_frame(results: Results) -> list[NDArray[np.intp]]:
    edges = np.searchsorted(results.people.frame, np.arange(len(results.stamps_ns) + 1))
    return [np.arange(*ends) for ends in pairwise(edges)]


def _nearest(
    a: PersonRows, b: PersonRows, rows_a: NDArray[np.intp], rows_b: NDArray[np.intp],
    renaming: dict[int, int] | None = None,
) -> list[tuple[int, int]]:
    """Return the pairs of rows of one frame, the nearest first, none beyond the gate."""
    apart = np.linalg.norm(a.position[rows_a][:, None] - b.position[rows_b][None], axis=-1)
    by_range = np.abs(a.range[rows_a][:, None] - b.range[rows_b][None])
    cost = np.where(np.isfinite(apart), apart, by_range) / a.range[rows_a][:, None]
    cost = np.where(cost <= GATE, cost, np.inf)
    if renaming is not None:
        names = [renaming.get(track) for track in a.track_id[rows_a].tolist()]
        cost += OTHER_TRACK * np.array(
            [[name != other for other in b.track_id[rows_b].tolist()] for name in names]
        ).reshape(cost.shape)
    pairs = []
    while cost.size and np.isfinite(cost.min()):
        i, j = np.unravel_index(np.argmin(cost), cost.shape)
        pairs.append((int(rows_a[i]), int(rows_b[j])))
        cost[i, :] = cost[:, j] = np.inf
    return pairs


def _renaming(
    ids_a: NDArray[np.int64], ids_b: NDArray[np.int64], near: list[list[tuple[int, int]]],
) -> dict[int, int]:
    """
    Return the id of b for each of a, the most frequent pairs first, each once.

    Who was never near anyone is taken for who bears the same name.
    """
    meetings = Counter(
        (int(ids_a[row_a]), int(ids_b[row_b])) for pairs in near for row_a, row_b in pairs)
    renaming: dict[int, int] = {}
    for (id_a, id_b), _ in sorted(meetings.items(), key=lambda item: (-item[1], item[0])):
        if id_a not in renaming and id_b not in renaming.values():
            renaming[id_a] = id_b
    same = np.intersect1d(ids_a, ids_b).tolist()
    free = set(same) - renaming.keys() - set(renaming.values())
    return renaming | {name: name for name in sorted(free)}


def _by_name(
    a: PersonRows, b: PersonRows, rows_a: NDArray[np.intp], rows_b: NDArray[np.intp],
    paired: list[tuple[int, int]], renaming: dict[int, int],
) -> list[tuple[int, int]]:
    """Return the pairs among those left over in a frame whose tracks are the same."""
    taken_a, taken_b = {pair[0] for pair in paired}, {pair[1] for pair in paired}
    left = {int(b.track_id[row]): int(row) for row in rows_b if row not in taken_b}
    pairs = []
    for row in rows_a:
        wanted = renaming.get(int(a.track_id[row]))
        if row not in taken_a and wanted in left:
            pairs.append((int(row), left.pop(wanted)))
    return pairs
