"""Pictures of what moved between two sets of results."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.compare import Comparison
from depth_person.replay.drawing import Axes, Figure, rgb, save_figures
from depth_person.replay.results import PersonRows


def draw_comparison(comparison: Comparison, folder: Path) -> list[Path]:
    """
    Write ranges.png (both) and changes.png (the differences) into a folder; return their paths.

    :raises DepthPersonError: when the folder cannot be written to.
    """
    pictures = {'ranges.png': _ranges(comparison), 'changes.png': _changes(comparison)}
    return save_figures(pictures, folder)


def _ranges(comparison: Comparison) -> Figure:
    """Draw the ranges of both over time, with bands of one sigma; a line for a, dots for b."""
    figure = Figure(figsize=(11, 5.5), layout='constrained')
    axes = figure.subplots()
    start = _start(comparison)
    pairs = comparison.pairs
    for id_a, id_b, rows in comparison.tracks():
        in_a, in_b = pairs.row_a[rows], pairs.row_b[rows]
        colour = rgb(id_a if id_a is not None else id_b or 0)
        for letter, results, own, style in (
                ('A', comparison.a, in_a[in_a >= 0], '-'),
                ('B', comparison.b, in_b[in_b >= 0], '.')):
            if not own.size:
                continue
            own = np.sort(own)
            people = results.people.take(own)
            time = (results.stamps_ns[people.frame] - start).astype(np.float64) * 1e-9
            _band(axes, time, people, colour)
            axes.plot(time, people.range, style, color=colour,
                      label=f'{letter} #{people.track_id[0]}')
    axes.set(xlabel='time (s)', ylabel='range (m), bands of one sigma')
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small', ncols=2, loc='upper left')
    return figure


def _band(
    axes: Axes, time: NDArray[np.float64], people: PersonRows, colour: tuple[float, float, float],
) -> None:
    low, high = people.range - people.range_sigma, people.range + people.range_sigma
    axes.fill_between(time, low, high, color=colour, alpha=0.15, lw=0)


def _changes(comparison: Comparison) -> Figure:
    """Draw the changes of range, position and sigma over time, with their tolerances."""
    figure = Figure(figsize=(11, 8), layout='constrained')
    tolerances = comparison.tolerances
    kinds = {
        'range': (comparison.range_change, tolerances.range, True),
        'position': (comparison.position_change, tolerances.position, False),
        'sigma': (comparison.sigma_change, tolerances.sigma, True)}
    stamps, start = comparison.pairs.stamps_ns, _start(comparison)
    for axes, (name, (change, tolerance, signed)) in zip(
            figure.subplots(3, 1, sharex=True), kinds.items(), strict=True):
        for id_a, id_b, rows in comparison.tracks():
            both = rows[comparison.pairs.both[rows]]
            time = (stamps[comparison.pairs.frame[both]] - start) * 1e-9
            label = f'#{id_a}' + (f' -> #{id_b}' if id_b != id_a else '')
            if both.size:
                axes.plot(time, 100 * change[both], '.-', color=rgb(id_a or 0), label=label)
        for edge in (tolerance, -tolerance)[:1 + signed]:
            axes.axhline(100 * edge, color='k', ls='--', lw=0.8)
        axes.set(ylabel=f'change of {name} (%)')
        axes.grid(alpha=0.3)
        if name == 'range' and axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize='small', ncols=3, loc='upper left')
    axes.set(xlabel='time (s); dashed: the tolerance')
    return figure


def _start(comparison: Comparison) -> np.int64:
    """Return the first stamp of both, nanoseconds."""
    return min(comparison.a.stamps_ns[0], comparison.b.stamps_ns[0])
