"""Trains and judges the body dimensions models, on our own people or on a user's table."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
import json
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.model_selection import GroupShuffleSplit

from depth_person.distance.body_dimensions import (
    BodyDimensionsEstimator,
    BodyDimensionsModel,
    model_file,
    Predicted,
)
from depth_person.distance.estimator import Body, DistanceEstimator
from depth_person.distance.shoulder import ShoulderEstimator
from depth_person.distance.skeleton import SkeletonEstimator
from depth_person.distance.training.body_fit import BodyTrees, FitOptions, Rows
from depth_person.distance.training.body_report import compare, figures
from depth_person.distance.training.body_rows import normalised_rows, paper_rows
from depth_person.distance.training.body_tables import table_rows
from depth_person.distance.training.body_views import (
    BodyViews,
    PAPER_CAMERA,
    paper_views,
    random_camera,
    random_views,
)
from depth_person.distance.training.population import Population, sample_population

#: The paper's protocol: this part of the rows is held out, drawn with this seed.
TEST_PART, SPLIT_SEED = 0.3, 66
#: Part of our own people that are children.
CHILDREN = 0.25


@dataclass(frozen=True)
class PopulationOptions:
    """
    How many views of how many people a training run takes.

    :ivar cameras: random ones for `normalised`.
    :ivar views: of each.
    :ivar paper_people: each seen at every one of the paper's distances.
    """

    seed: int = 71
    cameras: int = 80
    views: int = 330
    paper_people: int = 1200
    judging_cameras: int = 20
    judging_people: int = 400


Progress = Callable[..., Any]


def sample_people(seed: int, n: int, *, progress: Progress) -> Population:
    """
    Return n people of our own making, a part of them children.

    :param progress: like tqdm: takes an iterable and desc.
    :raises DepthPersonError: when torch or anny is not installed.
    """
    return sample_population(seed, n, children=CHILDREN, progress=progress)


def fit_population(
    kind: str, people: Population, others: Population, folder: Path, *,
    options: PopulationOptions = PopulationOptions(), trees: FitOptions = FitOptions(),
    progress: Progress,
) -> dict[str, Any]:
    """
    Train one kind of model on our own people and write it with its metrics into a folder.

    :param others: people who judge; none of them trains.
    :param progress: like tqdm: takes an iterable and desc.
    :returns: what the .json holds.
    """
    rng = np.random.default_rng([options.seed, 1])
    if kind == 'paper':
        rows = paper_rows(paper_views(rng, people, options.paper_people))
    else:
        rows = _joined([
            normalised_rows(rng, random_views(rng, people, random_camera(rng), options.views))
            for _ in range(options.cameras)])
    summary, path = _fit(rows, folder, trees=trees, progress=progress, camera=(
        PAPER_CAMERA if kind == 'paper' else None), trained_on='population')
    summary['options'] |= {f'population_{name}': value for name, value in asdict(options).items()}
    judges = np.random.default_rng([options.seed, 2])
    if kind == 'paper':
        views = [paper_views(judges, others, options.judging_people)]
    else:
        views = [random_views(judges, others, random_camera(judges), options.views)
                 for _ in range(options.judging_cameras)]
    summary['held_out_people'] = _judged(BodyDimensionsModel(path), views, judges)
    return _written(summary, path)


def fit_table(
    kind: str, table: Path, folder: Path, *, trees: FitOptions = FitOptions(),
    progress: Progress,
) -> dict[str, Any]:
    """
    Train one kind of model on a user's table and write it with its metrics into a folder.

    :raises DepthPersonError: when the table is wrong.
    """
    summary, path = _fit(table_rows(table, kind), folder, trees=trees, progress=progress,
                         camera=None, trained_on=table.name)
    return _written(summary, path)


def _joined(parts: Sequence[Rows]) -> Rows:
    return Rows(parts[0].kind, *(
        np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(Rows)[1:]))


def _fit(
    rows: Rows, folder: Path, *, trees: FitOptions, progress: Progress, camera: Any,
    trained_on: str,
) -> tuple[dict[str, Any], Path]:
    """Train by the paper's protocol, save, and judge on the rows that were held out."""
    split = GroupShuffleSplit(n_splits=1, test_size=TEST_PART, random_state=SPLIT_SEED)
    learn, judge = next(split.split(rows.features, groups=rows.person))
    boosted = BodyTrees(rows.take(learn), trees, progress)
    path = folder / model_file(rows.kind).name
    held_out = rows.take(judge)
    boosted.save(path, held_out.features, camera=camera, trained_on=trained_on)
    told = BodyDimensionsModel(path).predict(held_out.features)
    return {
        'kind': rows.kind, 'trained_on': trained_on, 'rows': len(rows),
        'options': {'test_part': TEST_PART, 'split_seed': SPLIT_SEED, **asdict(trees)},
        'versions': {name: version(name) for name in ('numpy', 'scikit-learn', 'skl2onnx')},
        'sigma_scale': round(boosted.sigma_scale, 4),
        'split': {
            'height': figures(held_out.stature, told.height),
            'distance': _distance_figures(held_out, told)},
    }, path


def _distance_figures(rows: Rows, told: Predicted) -> dict[str, Any]:
    distance = rows.distance * np.exp(told.log_distance - rows.target(told.height))
    return figures(rows.distance, distance, distance * told.log_sigma)


def _judged(
    model: BodyDimensionsModel, views: Sequence[BodyViews], rng: np.random.Generator,
) -> dict[str, Any]:
    """Return the figures beside those of the other estimators, on the same samples."""
    result = {}
    for children in (False, True):
        body = Body(children=children)
        estimators: dict[str, DistanceEstimator] = {
            'body_dimensions': BodyDimensionsEstimator(body, model=model),
            'skeleton': SkeletonEstimator(body), 'shoulder': ShoulderEstimator(body)}
        chosen = views if children else [view.take(~view.child) for view in views]
        for gravity in (False, True) if model.kind == 'normalised' else (False,):
            name = (f'{"children among them" if children else "adults"}, '
                    f'gravity {"known" if gravity else "unknown"}')
            result[name] = compare(estimators, chosen, rng=rng, gravity=gravity)
    return result


def _written(summary: dict[str, Any], path: Path) -> dict[str, Any]:
    path.with_suffix('.json').write_text(
        json.dumps(summary, indent=2, allow_nan=False) + '\n', encoding='utf-8')
    return summary
