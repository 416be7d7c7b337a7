"""
Joins keypoints to people by part-affinity fields.

After Cao et al., "Realtime Multi-Person 2D Pose Estimation using Part Affinity Fields" (2017): on
every limb the network draws a field of unit vectors along it. Two keypoints belong together as
far as the field between them points from the one to the other (equation 10, here for all pairs of
all limbs at once). Limbs are then taken surest first over all kinds, and join two parts of people
unless both have a keypoint of the same kind, so that no cut through the skeleton is favoured.
"""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.heatmaps import Peaks

Array = NDArray[np.float32]

#: Points on each limb at which the field is read.
_SAMPLES = 10
#: A point agrees where the field along the limb is stronger; so many of the points have to.
_AGREES = 0.05
_AGREEING = 0.8
#: Keypoints nearer than this, cells, have no direction between them that the field could show.
_SHORT = 1.0
#: What such a limb scores when nothing else is known of it.
_SHORT_SCORE = 0.1
#: A limb longer than this part of the map loses by its length.
_LONG = 0.5


@dataclass(frozen=True)
class Limb:
    """
    Two kinds of keypoints that a field joins.

    :ivar start: the map of the one.
    :ivar end: the map of the other, to which the field points.
    :ivar channel: of the field's x; y is the next.
    """

    start: int
    end: int
    channel: int


@dataclass(frozen=True, eq=False)
class _Links:
    """Pairs of peaks that may be limbs: rows of Peaks, and how sure each is."""

    starts: NDArray[np.intp]
    ends: NDArray[np.intp]
    scores: Array


def group(peaks: Peaks, field: Array, limbs: Iterable[Limb], *, n_maps: int) -> NDArray[np.intp]:
    """
    Return the people that peaks are, surest first; a peak without any limb is nobody.

    :param field: (h, w, channels) part-affinity fields.
    :param n_maps: how many kinds of keypoints there are.
    :returns: (n, n_maps) rows of peaks; -1 for a keypoint that is missing.
    """
    links = _links(peaks, field, limbs)
    people = _assembled(peaks, links, n_maps)
    if not people:
        return np.empty((0, n_maps), np.intp)
    table = np.array(people)
    sureness = np.where(table >= 0, peaks.scores[table], 0).sum(1)
    return table[np.argsort(-sureness, kind='stable')]


def _links(peaks: Peaks, field: Array, limbs: Iterable[Limb]) -> _Links:
    """Return all pairs of peaks that the field joins, surest first."""
    starts, ends, channels = _pairs(peaks, limbs)
    start, end = peaks.points[starts], peaks.points[ends]
    way = end - start
    length = np.hypot(way[:, 0], way[:, 1])
    unit = way / np.maximum(length, 1e-6)[:, None]
    along = np.linspace(0, 1, _SAMPLES, dtype=np.float32)
    points = start[:, None] + along[:, None] * way[:, None]  # (pairs, samples, 2)
    sampled = _sampled(field, points, channels)
    aligned = np.einsum('psc,pc->ps', sampled, unit)
    score = aligned.mean(1)
    score += np.minimum(_LONG * max(field.shape[:2]) / np.maximum(length, 1e-6) - 1, 0)
    joined = ((aligned > _AGREES).mean(1) >= _AGREEING) & (score > 0)
    short = length < _SHORT
    score = np.where(short, np.maximum(score, _SHORT_SCORE), score)
    kept = np.flatnonzero(joined | short)
    kept = kept[np.argsort(-score[kept], kind='stable')]
    return _Links(starts[kept], ends[kept], score[kept])


def _pairs(
    peaks: Peaks, limbs: Iterable[Limb],
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return starts, ends and channels of all pairs that could be limbs."""
    parts: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]] = []
    for limb in limbs:
        first = np.flatnonzero(peaks.maps == limb.start)
        second = np.flatnonzero(peaks.maps == limb.end)
        starts = np.repeat(first, len(second))
        parts.append((
            starts, np.tile(second, len(first)), np.full(len(starts), limb.channel, np.intp)))
    starts, ends, channels = (np.concatenate(each) for each in zip(*parts, strict=True))
    return starts, ends, channels


def _sampled(field: Array, points: Array, channels: NDArray[np.intp]) -> Array:
    """Return the field (pairs, samples, 2) at points, bilinear between the cells."""
    sides = np.array(field.shape[1::-1])
    points = np.clip(points, 0, sides - 1)
    low = np.minimum(points.astype(np.intp), np.maximum(sides - 2, 0))
    high = np.minimum(low + 1, sides - 1)
    right, down = np.moveaxis(points - low, 2, 0)[..., None]
    channel = channels[:, None, None] + np.arange(2)

    def at(rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
        return field[rows[..., None], columns[..., None], channel]

    top = at(low[..., 1], low[..., 0]) * (1 - right) + at(low[..., 1], high[..., 0]) * right
    bottom = at(high[..., 1], low[..., 0]) * (1 - right) + at(high[..., 1], high[..., 0]) * right
    return top * (1 - down) + bottom * down


def _assembled(peaks: Peaks, links: _Links, n_maps: int) -> list[NDArray[np.intp]]:
    """Return people, each (n_maps,) rows of peaks or -1, from links taken surest first."""
    owner: dict[int, int] = {}
    people: dict[int, NDArray[np.intp]] = {}

    def person_of(peak: int) -> int:
        if peak not in owner:
            owner[peak] = peak
            people[peak] = np.full(n_maps, -1, np.intp)
            people[peak][peaks.maps[peak]] = peak
        return owner[peak]

    for start, end in zip(links.starts.tolist(), links.ends.tolist(), strict=True):
        one, other = person_of(start), person_of(end)
        if one == other or ((people[one] >= 0) & (people[other] >= 0)).any():
            continue
        moved = people.pop(other)
        people[one] = np.maximum(people[one], moved)
        owner.update((peak, one) for peak in moved[moved >= 0].tolist())
    return [person for person in people.values() if (person >= 0).sum() > 1]
