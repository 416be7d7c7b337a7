"""Figures that sum up the samples of an evaluation."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from depth_person.replay.evaluate import Sample

#: Where one distance bin ends and the next begins, metres of true range.
DISTANCE_BINS = (5.0, 10.0, 15.0, 20.0)
#: Less of a person than this is a person partly hidden.
WHOLE_FRACTION = 0.95


def summarise(samples: Sequence[Sample]) -> dict[str, Any]:
    """
    Return the figures over all true people, and over each kind of them.

    Groups are by scenario, distance, facing and visibility; those whose data do not say are in
    none. `false_people` counts the found who are nobody.
    """
    true = [sample for sample in samples if sample.person is not None]
    return {
        'overall': figures(true),
        'by_scenario': _grouped(true, lambda sample: sample.scenario),
        'by_distance': _grouped(sorted(true, key=_true_range), _distance_bin),
        'by_facing': _grouped(true, _facing),
        'by_visibility': _grouped(true, _visibility),
        'false_people': len(samples) - len(true),
    }


def figures(samples: Sequence[Sample]) -> dict[str, float | int | None]:
    """
    Return what the estimates of true people are worth; None where there is nothing to tell.

    - `n`, and the fractions of them that were `found` and that have a range (`with_range`);
    - of the errors range - range_neck, metres: `median_abs`, `mean_abs`, `rmse`, `bias` (mean);
      `median_rel` relative to range_neck;
    - `coverage_1`, `coverage_2`: the fractions within one and two of their own sigmas (0.683 and
      0.954 for a true normal sigma);
    - `pearson_r` between the two ranges; `median_shoulder_error_px` of the found.
    """
    n = len(samples)
    measured = [sample for sample in samples if sample.range is not None]
    estimated, true, sigma = np.array(
        [(s.range, s.range_neck, s.range_sigma) for s in measured], np.float64).reshape(-1, 3).T
    error = estimated - true
    shoulders = [s.shoulder_error_px for s in samples if s.shoulder_error_px is not None]
    return {
        'n': n,
        'found': _over(sum(sample.found for sample in samples), n),
        'with_range': _over(len(measured), n),
        'median_abs': _or_none(np.median, np.abs(error)),
        'mean_abs': _or_none(np.mean, np.abs(error)),
        'median_rel': _or_none(np.median, np.abs(error) / true),
        'rmse': _or_none(lambda e: np.sqrt(np.mean(e ** 2)), error),
        'bias': _or_none(np.mean, error),
        'coverage_1': _or_none(np.mean, np.abs(error) <= sigma),
        'coverage_2': _or_none(np.mean, np.abs(error) <= 2 * sigma),
        'pearson_r': _pearson(estimated, true),
        'median_shoulder_error_px': _or_none(np.median, np.array(shoulders)),
    }


def _over(count: int, n: int) -> float | None:
    return count / n if n else None


def _or_none(statistic: Callable[[Any], Any], values: np.ndarray) -> float | None:
    return float(statistic(values)) if len(values) else None


def _pearson(a: np.ndarray, b: np.ndarray) -> float | None:
    if len(a) < 3 or a.std() == 0 or b.std() == 0:
        return None
    return float(np.corrcoef(a, b)[0, 1])


def _grouped(
    samples: Sequence[Sample], name_of: Callable[[Sample], str | None],
) -> dict[str, dict[str, float | int | None]]:
    """Return the figures of each group, in order of first appearance."""
    groups: dict[str, list[Sample]] = {}
    for sample in samples:
        if name := name_of(sample):
            groups.setdefault(name, []).append(sample)
    return {name: figures(group) for name, group in groups.items()}


def _true_range(sample: Sample) -> float:
    assert sample.range_true is not None
    return sample.range_true


def _distance_bin(sample: Sample) -> str:
    edges = (0.0, *DISTANCE_BINS)
    i = int(np.searchsorted(DISTANCE_BINS, _true_range(sample), side='right'))
    if i == len(DISTANCE_BINS):
        return f'>{edges[i]:g} m'
    return f'{edges[i]:g}-{edges[i + 1]:g} m'


def _facing(sample: Sample) -> str | None:
    if sample.yaw_deg is None:
        return None
    turned = abs((sample.yaw_deg + 180) % 360 - 180)
    return 'front' if turned <= 45 else 'side' if turned < 135 else 'back'


def _visibility(sample: Sample) -> str | None:
    if sample.visible_fraction is None:
        return None
    return 'whole' if sample.visible_fraction >= WHOLE_FRACTION else 'partly hidden'
