"""The drawings of a report."""
from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from depth_person.replay.drawing import Axes, Figure, rgb
from depth_person.replay.results import PersonRows, Results
from depth_person.replay.timing import Timing
from depth_person.replay.truth_errors import TruthErrors

_Array = NDArray[np.float64]


def ranges_figure(results: Results, truth: Results | None) -> Figure:
    """Draw each person's range over time with a band of one sigma, and what was measured."""
    figure = Figure(figsize=(11, 5), layout='constrained')
    axes = figure.subplots()
    for track_id, time, people in _tracks(results):
        colour = rgb(track_id)
        low, high = people.range - people.range_sigma, people.range + people.range_sigma
        axes.fill_between(time, low, high, color=colour, alpha=0.2, lw=0)
        axes.plot(time, people.range, '-', color=colour, lw=1.6, label=f'#{track_id}')
        axes.plot(time, people.range_measured, '.', color=colour, ms=4, alpha=0.6)
        axes.plot(time[people.predicted], people.range[people.predicted], 'o', color=colour,
                  ms=5, mfc='none')
    _draw_truth(axes, truth, lambda people, time: (time, people.range))
    axes.set(xlabel='time (s)', ylabel='range (m)', ylim=(0, None))
    _finish(axes)
    return figure


def above_figure(results: Results, truth: Results | None) -> Figure:
    """Draw the people's places as a bird sees them, with one sigma along the view ray."""
    figure = Figure(figsize=(6.5, 6.5), layout='constrained')
    axes = figure.subplots()
    for track_id, _, people in _tracks(results):
        x, z = people.position[:, 0], people.position[:, 2]
        ends = 1 + np.outer((-1, 1, np.nan), people.range_sigma / people.range)
        axes.plot((ends * x).T.ravel(), (ends * z).T.ravel(), color=rgb(track_id), alpha=0.25,
                  lw=1)  # one line for all, with gaps
        axes.plot(x, z, '.-', color=rgb(track_id), ms=4, lw=0.8, label=f'#{track_id}')
    _draw_truth(axes, truth, lambda people, _: (people.position[:, 0], people.position[:, 2]))
    axes.plot(0, 0, '^', color='k', ms=10)
    axes.annotate('camera', (0, 0), (8, -4), textcoords='offset points', fontsize='small')
    axes.set(xlabel='right (m)', ylabel='forward (m)', aspect='equal', adjustable='datalim')
    _finish(axes)
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
    for track_id, time, people in _tracks(errors.results):
        own = error[errors.results.people.track_id == track_id]
        axes.fill_between(
            time, -2 * people.range_sigma, 2 * people.range_sigma, color=rgb(track_id),
            alpha=0.12, lw=0)
        axes.plot(time, own, '.-', color=rgb(track_id), lw=0.8, ms=4, label=f'#{track_id}')
    axes.axhline(0, color='k', lw=0.8)
    axes.set(xlabel='time (s)', ylabel='too far by (m)')
    _finish(axes)
    return figure


def _tracks(results: Results) -> Iterator[tuple[int, _Array, PersonRows]]:
    """Yield the id, the times and the rows of each track."""
    for track_id in results.tracks:
        own = results.people.track_id == track_id
        yield track_id, results.times_s[own], results.people.take(own)


def _draw_truth(
    axes: Axes, truth: Results | None,
    place: Callable[[PersonRows, _Array], tuple[_Array, _Array]],
) -> None:
    """
    Draw a line for each true person.

    :param place: gives what goes right and up, of a person's rows and times.
    """
    for index, (_, time, people) in enumerate(_tracks(truth) if truth else ()):
        axes.plot(*place(people, time), 'k-', lw=1, label='_' if index else 'truth')


def _finish(axes: Axes) -> None:
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize='small', loc='upper left')
