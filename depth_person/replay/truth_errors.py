"""Errors of results where the truth is known."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.evaluate import Sample
from depth_person.replay.metrics import figures, summarise
from depth_person.replay.pairing import pair, Pairs
from depth_person.replay.results import Results

Figures = dict[str, float | int | None]


@dataclass(frozen=True, eq=False)
class TruthErrors:
    """
    Results beside the truth.

    :ivar pairs: of the truth (a) and the results (b).
    """

    truth: Results
    results: Results
    pairs: Pairs

    def tables(self) -> Iterator[tuple[str, Figures]]:
        """Yield what is counted and the figures of depth_person.replay.metrics on it."""
        filtered = self._samples(filtered=True)
        summary = summarise(filtered)
        yield 'all', summary['overall']
        if np.isfinite(self.results.people.range_measured).any():
            yield 'all, each frame by itself', figures(
                [each for each in self._samples(filtered=False) if each.person is not None])
        for name, group in sorted(summary['by_scenario'].items(), key=lambda item: int(item[0])):
            track = self.pairs.renaming.get(int(name))
            yield f'true person {name}' + (f', #{track}' if track is not None else ''), group
        for name, group in summary['by_distance'].items():
            yield name, group

    @property
    def strangers(self) -> int:
        """How many ranges belong to nobody known, in frames whose truth is known."""
        lone = self.pairs.row_b[self.pairs.row_a < 0]
        known = np.isin(self.results.people.frame[lone], self.truth.people.frame)
        return int((known & np.isfinite(self.results.people.range[lone])).sum())

    def error(self) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the rows of the results with a true range, and how much too far they are."""
        rows = self.pairs.row_b[self.pairs.both]
        true = self.truth.people.range[self.pairs.row_a[self.pairs.both]]
        return rows, self.results.people.range[rows] - true

    def _samples(self, *, filtered: bool) -> list[Sample]:
        people = self.results.people
        ranges, sigmas = (
            (people.range, people.range_sigma) if filtered
            else (people.range_measured, people.range_sigma_measured))
        samples = []
        for row, own in zip(self.pairs.row_a, self.pairs.row_b, strict=True):
            if row < 0:
                continue
            true = float(self.truth.people.range[row])
            known = own >= 0 and bool(np.isfinite(ranges[own]))
            person = int(self.truth.people.track_id[row])
            samples.append(Sample(
                image='', person=person, scenario=str(person), tag='', found=bool(own >= 0),
                range_true=true, range_neck=true, range=float(ranges[own]) if known else None,
                range_sigma=float(sigmas[own]) if known else None))
        return samples


def truth_errors(truth: Results, results: Results) -> TruthErrors:
    """Pair results with the truth at the same stamps."""
    return TruthErrors(truth, results, pair(truth, results))
