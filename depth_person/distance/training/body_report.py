"""How right and how true the body dimensions models are on held-out people and cameras."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.estimator import DistanceEstimator, Mounting
from depth_person.distance.training.body_views import BodyViews
from depth_person.distance.training.views import tilted

_Array = NDArray[np.float64]

# The paper's distances, metres, along the floor; to the neck they are a little more.
_PAPER = (3.8, 6.9)
# Groups of fewer tell nothing.
_FEWEST = 30
_STEEP = np.radians(20)


def compare(
    estimators: Mapping[str, DistanceEstimator], views: Sequence[BodyViews], *,
    rng: np.random.Generator, gravity: bool,
) -> dict[str, dict[str, dict[str, Any]]]:
    """
    Return for each group of views and each estimator the figures, on the very same samples.

    :param gravity: tell the estimators the direction down, with an attitude sensor's error.
    """
    names = ('range', 'stature', 'child', 'upright', 'elevation')
    truth = {name: np.concatenate([getattr(view, name) for view in views]) for name in names}
    told: dict[str, list[_Array]] = {name: [] for name in estimators}
    for view in views:
        down = tilted(rng, view.gravity) if gravity else None
        for name, estimator in estimators.items():
            told[name].append(_measured(estimator, view, down))
    answers = {name: np.concatenate(parts, axis=1) for name, parts in told.items()}
    common = np.all([np.isfinite(answer[0]) for answer in answers.values()], axis=0)
    return {
        group: {name: figures(truth['range'][rows & common], *answer[:, rows & common])
                for name, answer in answers.items()}
        for group, rows in _groups(truth).items() if (rows & common).sum() >= _FEWEST}


def _measured(estimator: DistanceEstimator, view: BodyViews, down: _Array | None) -> _Array:
    """Return (2, n) ranges and sigmas."""
    if down is None:
        answers = [estimator.estimate(view.people, view.camera)]
    else:
        answers = [
            estimator.estimate(view.take(np.arange(len(view)) == i).people, view.camera,
                               Mounting(gravity=down[i]))
            for i in range(len(view))]
    return np.stack([
        np.concatenate([one.range for one in answers]),
        np.concatenate([one.range_sigma for one in answers])])


def _groups(truth: dict[str, NDArray[Any]]) -> dict[str, NDArray[np.bool_]]:
    """Return which samples are in each group, of groups with the same samples the first."""
    near = (truth['range'] >= _PAPER[0]) & (truth['range'] <= _PAPER[1])
    adult, upright = ~truth['child'], truth['upright']
    groups = {
        'all': np.ones(len(adult), bool), 'adults': adult, 'children': truth['child'],
        'adults standing': adult & upright,
        'adults standing, 3.8 to 6.9 m': adult & upright & near,
        'adults standing, camera within 20 degrees of level':
            adult & upright & (np.abs(truth['elevation']) < _STEEP),
        'adults, camera above 20 degrees': adult & (truth['elevation'] >= _STEEP),
        'adults, beyond 10 m': adult & (truth['range'] > 10),
    }
    first = {rows.tobytes(): name for name, rows in reversed(groups.items())}
    return {name: rows for name, rows in groups.items() if first[rows.tobytes()] == name}


def figures(true: _Array, told: _Array, sigma: _Array | None = None) -> dict[str, Any]:
    """Return the number, the errors and how often the truth lies within one and two sigmas."""
    error = told - true
    values = {
        'rmse_m': np.sqrt((error ** 2).mean()), 'pearson_r': np.corrcoef(true, told)[0, 1],
        'median_relative_error': np.median(np.abs(error) / true),
        'rms_relative_error': np.sqrt(((error / true) ** 2).mean()),
        'bias': np.median(error / true),
    }
    if sigma is not None:
        values |= {f'within_{k}_sigma': (np.abs(error) < k * sigma).mean() for k in (1, 2)}
    return {'n': len(true), **{name: round(float(value), 4) for name, value in values.items()}}
