"""Pictures of what moved between two sets of results."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from depth_person.replay.compare import Comparison
from depth_person.replay.drawing import at_rows, Figure, legend, rgb, save_figures, strands


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
    entries = []
    for letter, results, rows, style in (
            ('A', comparison.a, pairs.row_a, '-'), ('B', comparison.b, pairs.row_b, '.')):
        there = np.flatnonzero(rows >= 0)
        own, people = rows[there], results.people
        time = (results.stamps_ns[people.frame] - start).astype(np.float64) * 1e-9
        for colour, order in strands(comparison.persons[there], time[own]):
            at = np.where(order >= 0, own[order], -1)
            shown, distance, sigma = (
                at_rows(values, at) for values in (time, people.range, people.range_sigma))
            axes.fill_between(
                shown, distance - sigma, distance + sigma, color=colour, alpha=0.15, lw=0)
            axes.plot(shown, distance, style, color=colour)
        _, firsts = np.unique(comparison.persons[there], return_index=True)
        entries += [(f'{letter} #{people.track_id[own[first]]}', style,
                     rgb(int(comparison.persons[there][first]))) for first in np.sort(firsts)]
    axes.set(xlabel='time (s)', ylabel='range (m), bands of one sigma')
    axes.grid(alpha=0.3)
    legend(axes, entries)
    return figure


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
        both = np.flatnonzero(comparison.pairs.both)
        time = (stamps[comparison.pairs.frame[both]] - start) * 1e-9
        for colour, order in strands(comparison.persons[both], time):
            axes.plot(at_rows(time, order), 100 * at_rows(change[both], order), '.-',
                      color=colour)
        for edge in (tolerance, -tolerance)[:1 + signed]:
            axes.axhline(100 * edge, color='k', ls='--', lw=0.8)
        axes.set(ylabel=f'change of {name} (%)')
        axes.grid(alpha=0.3)
        if name == 'range':
            legend(axes, [
                (f'#{own}' + (f' -> #{other}' if other != own else ''), '.-', rgb(own))
                for own, other in comparison.pairs.renaming.items()])
    axes.set(xlabel='time (s); dashed: the tolerance')
    return figure


def _start(comparison: Comparison) -> np.int64:
    """Return the first stamp of both, nanoseconds."""
    return min(comparison.a.stamps_ns[0], comparison.b.stamps_ns[0])
