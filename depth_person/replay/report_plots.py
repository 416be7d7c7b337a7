"""The drawings of a report."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.drawing import at_rows, Axes, Figure, legend, rgb, strands
from depth_person.replay.results import Results
from depth_person.replay.timing import Timing
from depth_person.replay.truth_errors import TruthErrors

_Array = NDArray[np.float64]


def ranges_figure(results: Results, truth: Results | None) -> Figure:
    """Draw each person's range over time with a band of one sigma, and what was measured."""
    figure = Figure(figsize=(11, 5), layout='constrained')
    axes = figure.subplots()
    people = results.people
    _draw_truth(axes, truth, lambda known: (known.times_s, known.people.range))
    for colour, rows in strands(people.track_id, results.times_s):
        time, distance, sigma = (
            at_rows(values, rows) for values in (
                results.times_s, people.range, people.range_sigma))
        axes.fill_between(
            time, distance - sigma, distance + sigma, color=colour, alpha=0.2, lw=0)
        axes.plot(time, distance, '-', color=colour, lw=1.6)
        axes.plot(
            time, at_rows(people.range_measured, rows), '.', color=colour, ms=4, alpha=0.6)
        hidden = at_rows(people.predicted, rows) == 1
        axes.plot(time[hidden], distance[hidden], 'o', color=colour, ms=5, mfc='none')
    axes.set(xlabel='time (s)', ylabel='range (m)', ylim=(0, None))
    _finish(axes, results)
    return figure


def above_figure(results: Results, truth: Results | None) -> Figure:
    """Draw the people's places as a bird sees them, with one sigma along the view ray."""
    figure = Figure(figsize=(6.5, 6.5), layout='constrained')
    axes = figure.subplots()
    people = results.people
    _draw_truth(axes, truth, lambda known: (
        known.people.position[:, 0], known.people.position[:, 2]))
    for colour, rows in strands(people.track_id, results.times_s):
        x, _, z = at_rows(people.position, rows).T
        share = at_rows(people.range_sigma / people.range, rows)
        ends = 1 + np.outer((-1, 1, np.nan), share)
        axes.plot((ends * x).T.ravel(), (ends * z).T.ravel(), color=colour, alpha=0.25,
                  lw=1)  # one line for all, with gaps
        axes.plot(x, z, '.-', color=colour, ms=4, lw=0.8)
    axes.plot(0, 0, '^', color='k', ms=10)
    axes.annotate('camera', (0, 0), (8, -4), textcoords='offset points', fontsize='small')
    axes.set(xlabel='right (m)', ylabel='forward (m)', aspect='equal', adjustable='datalim')
    _finish(axes, results, ncols=5)
    return figure


def timing_figure(timing: Timing) -> Figure:
    """Draw the distances between stamps, and the latency where there is one."""
    rows = 1 if timing.latency_s is None else 2
    figure = Figure(figsize=(11, 2.3 * rows), layout='constrained')
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    axes[0].plot(timing.time_s[1:], 1e3 * timing.interval_s, '.-', lw=0.6, ms=4)
    axes[0].set(ylabel='between frames (ms)')
    axes[0].update_datalim([(0, 0)])
    if timing.latency_s is not None:
        axes[1].plot(timing.time_s, 1e3 * timing.latency_s, '.-', lw=0.6, ms=4, color='C1')
        axes[1].set(ylabel='latency (ms)')
        axes[1].update_datalim([(0, 0)])
    for each in axes:
        each.grid(alpha=0.3)
        each.margins(y=0.1)
    axes[-1].set(xlabel='time (s)')
    return figure


def errors_figure(errors: TruthErrors) -> Figure:
    """Draw how much too far each person is over time, with bands of two of its own sigmas."""
    figure = Figure(figsize=(11, 3.6), layout='constrained')
    axes = figure.subplots()
    error = np.full(len(errors.results.people), np.nan)
    rows, found = errors.error()
    error[rows] = found
    people = errors.results.people
    for colour, own in strands(people.track_id, errors.results.times_s):
        time, sigma = (
            at_rows(values, own) for values in (errors.results.times_s, people.range_sigma))
        axes.fill_between(time, -2 * sigma, 2 * sigma, color=colour, alpha=0.12, lw=0)
        axes.plot(time, at_rows(error, own), '.-', color=colour, lw=0.8, ms=4)
    axes.axhline(0, color='k', lw=0.8)
    axes.set(xlabel='time (s)', ylabel='too far by (m)')
    _finish(axes, errors.results)
    return figure


def _draw_truth(
    axes: Axes, truth: Results | None, place: Callable[[Results], tuple[_Array, _Array]],
) -> None:
    """
    Draw a line for each true person.

    :param place: gives what goes right and up, of every row.
    """
    if truth is None:
        return
    right, up = place(truth)
    rows = [own for _, own in strands(truth.people.track_id, truth.times_s)]
    if rows:
        joined = np.concatenate(rows)
        axes.plot(
            at_rows(right, joined), at_rows(up, joined), 'k-', lw=1, zorder=3, label='truth')


def _finish(axes: Axes, results: Results, *, ncols: int = 9) -> None:
    axes.grid(alpha=0.3)
    legend(axes, [(f'#{track}', '.-', rgb(track)) for track in results.tracks], ncols=ncols)
