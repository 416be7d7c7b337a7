"""Pictures of an evaluation's errors."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from depth_person.errors import DepthPersonError
from depth_person.replay.drawing import colormaps, Figure, save_figures
from depth_person.replay.evaluate import Sample

#: Larger relative errors are drawn at the edge.
_LARGEST_PERCENT = 60.0


def draw_plots(samples: Sequence[Sample], folder: Path) -> list[Path]:
    """
    Write ranges.png, errors.png and coverage.png into a folder; return their paths.

    :raises DepthPersonError: when the folder cannot be written to, or no sample has a range.
    """
    measured = [
        s for s in samples
        if s.range is not None and s.range_neck is not None and s.range_sigma is not None]
    if not measured:
        raise DepthPersonError('no person has both a true and an estimated range: nothing to plot')
    pictures = {
        'ranges.png': _ranges(measured), 'errors.png': _errors(measured),
        'coverage.png': _coverage(measured)}
    return save_figures(pictures, folder)


def _columns(samples: Sequence[Sample]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the true range, the estimated one and its sigma."""
    true, estimated, sigma = np.array(
        [(s.range_neck, s.range, s.range_sigma) for s in samples], np.float64).T
    return true, estimated, sigma


def _ranges(samples: Sequence[Sample]) -> Figure:
    """Draw estimated against true range, by scenario, with bars of one sigma."""
    figure = Figure(figsize=(8, 7), layout='constrained')
    axes = figure.subplots()
    axes.set_prop_cycle(color=colormaps['tab20'](range(20)))
    for scenario in sorted({s.scenario for s in samples}):
        true, estimated, sigma = _columns([s for s in samples if s.scenario == scenario])
        axes.errorbar(
            true, estimated, sigma, fmt='o', ms=4, lw=0.8, alpha=0.7, label=scenario or 'all')
    limit = 1.05 * _columns(samples)[0].max()
    axes.plot([0, limit], [0, limit], 'k-', lw=0.8)
    axes.set(
        xlim=(0, limit), ylim=(0, 1.3 * limit), xlabel='true range (m)',
        ylabel='estimated range (m), bars of one sigma')
    axes.legend(fontsize='small')
    return figure


def _errors(samples: Sequence[Sample]) -> Figure:
    """Draw the relative error against true range and against yaw."""
    figure = Figure(figsize=(12, 5), layout='constrained')
    by_range, by_yaw = figure.subplots(1, 2, sharey=True)
    true, estimated, _ = _columns(samples)
    percent = 100 * (estimated / true - 1)
    yaw = np.array([np.nan if s.yaw_deg is None else s.yaw_deg for s in samples])
    for axes, place in ((by_range, true), (by_yaw, (yaw + 180) % 360 - 180)):
        beyond = percent > _LARGEST_PERCENT
        axes.plot(place[~beyond], percent[~beyond], 'C0o', ms=4, alpha=0.6)
        axes.plot(place[beyond], np.full(beyond.sum(), _LARGEST_PERCENT), 'C3^', ms=6)
        axes.axhline(0, color='k', lw=0.8)
        axes.grid(alpha=0.3)
    by_range.set(
        xlabel='true range (m)', ylabel='relative error (%); triangles lie beyond',
        ylim=(-60, _LARGEST_PERCENT + 5))
    by_yaw.set(
        xlabel='yaw (degrees; 0 faces the camera)', xlim=(-180, 180),
        xticks=range(-180, 181, 45))
    return figure


def _coverage(samples: Sequence[Sample]) -> Figure:
    """Draw how many errors lie within so many sigmas, beside a normal error's share."""
    figure = Figure(figsize=(6, 5), layout='constrained')
    axes = figure.subplots()
    true, estimated, sigma = _columns(samples)
    sigmas = np.sort(np.abs(estimated - true) / sigma)
    axes.step(
        np.concatenate([[0.0], sigmas]), np.linspace(0, 1, len(sigmas) + 1), where='post',
        label='estimates')
    normal = np.abs(np.random.default_rng(0).normal(size=100_000))
    marks = np.linspace(0, 4, 81)
    axes.plot(marks, [(normal <= mark).mean() for mark in marks], 'k--', lw=1, label='normal')
    axes.set(
        xlim=(0, 4), ylim=(0, 1), xlabel='within so many of its own sigmas',
        ylabel='share of people')
    axes.grid(alpha=0.3)
    axes.legend(loc='lower right')
    return figure
