"""Fits the body dimensions trees with scikit-learn and writes them as one ONNX graph."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
import onnx
from onnx import helper, TensorProto
from skl2onnx import to_onnx
from sklearn.ensemble import GradientBoostingRegressor
from sklearn.model_selection import GroupKFold

from depth_person.distance.body_dimensions import BodyDimensionsModel, FEATURES, ModelCamera

_Array = NDArray[np.float64]

#: The quantiles that a normal distribution has at one sigma below and above its middle.
QUANTILES = (0.16, 0.5, 0.84)
#: Largest difference that ONNX Runtime may have from scikit-learn, in units of a logarithm or of
#: metres: float32 against float64.
_SAME = 1e-3
_FOLDS = 3
_OPSETS = {'': 17, 'ai.onnx.ml': 1}


@dataclass(frozen=True)
class FitOptions:
    """
    What a training run may be told.

    :ivar trees: in each of the four ensembles.
    :ivar depth: of a tree.
    """

    trees: int = 120
    depth: int = 4
    learning_rate: float = 0.1
    seed: int = 66


@dataclass(frozen=True, eq=False)
class Rows:
    """
    Boxes with their truth.

    :ivar kind: of model, a key of FEATURES.
    :ivar features: (n, k) in the order of FEATURES[kind].
    :ivar stature: (n,) metres.
    :ivar distance: (n,) metres.
    :ivar person: (n,) who it is.
    """

    kind: str
    features: _Array
    stature: _Array
    distance: _Array
    person: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.stature)

    def take(self, rows: NDArray[Any]) -> Rows:
        """Return these rows."""
        return Rows(self.kind, self.features[rows], self.stature[rows], self.distance[rows],
                    self.person[rows])

    def target(self, height: _Array) -> _Array:
        """
        Return what the second stage is to tell: the logarithm of distance in metres.

        With the box in angles it is less the logarithm of height over the box's angle, the
        distance of an upright rod, so that a person twice as far away asks the trees for nothing
        new.
        """
        if self.kind == 'paper':
            return np.log(self.distance)
        return np.log(self.distance * self.features[:, _HEIGHT_RAD] / height)


_HEIGHT_RAD = FEATURES['normalised'].index('height_rad')


class BodyTrees:
    """
    The two stages: trees for the height, and trees for three quantiles of distance.

    The second stage learns from heights as the first predicts them for people whom it has not
    seen, and from true ones, for the user who knows them.
    """

    def __init__(self, rows: Rows, options: FitOptions, progress: Callable[..., Iterable[Any]]):
        self.kind = rows.kind
        self._options = options
        folds = list(GroupKFold(min(_FOLDS, len(np.unique(rows.person)))).split(
            rows.features, groups=rows.person))
        unseen = np.empty(len(rows))
        for learn, judge in progress(folds, desc=f'{self.kind}: height'):
            height = self._trees('squared_error').fit(rows.features[learn], rows.stature[learn])
            unseen[judge] = height.predict(rows.features[judge])
        self._height = self._trees('squared_error').fit(rows.features, rows.stature)
        known = np.empty((len(rows), 3))
        for learn, judge in progress(folds, desc=f'{self.kind}: spread'):
            quantiles = self._second_stage(rows.take(learn), unseen[learn])
            known[judge] = _told(quantiles, rows.features[judge], unseen[judge], known=False)
        low, middle, high = np.sort(known, axis=1).T
        sigmas = np.abs(rows.target(unseen) - middle) / np.maximum((high - low) / 2, 1e-6)
        self.sigma_scale = float(np.quantile(sigmas, 0.683))
        self._quantiles = self._second_stage(rows, unseen)

    def predict(self, features: _Array, stature: float | None = None) -> tuple[_Array, _Array]:
        """Return the heights (n,), predicted or known, and the quantiles (n, 3)."""
        height = self._height.predict(_stored(features)) if stature is None else np.full(
            len(features), stature)
        return height, _told(self._quantiles, features, height, known=stature is not None)

    def save(
        self, path: Path, judging: _Array, *, camera: ModelCamera | None, trained_on: str,
    ) -> None:
        """
        Write the trees, and make sure that ONNX Runtime tells of boxes what scikit-learn does.

        :param judging: (n, k) features.
        :param camera: the only one that the model holds for.
        :param trained_on: a word on the data, kept with the model.
        """
        metadata = {
            'kind': self.kind, 'features': json.dumps(FEATURES[self.kind]),
            'sigma_scale': repr(self.sigma_scale), 'trained_on': trained_on}
        if camera is not None:
            metadata['camera'] = json.dumps(asdict(camera))
        model = _graph(self._height, self._quantiles, len(FEATURES[self.kind]))
        helper.set_model_props(model, metadata)
        onnx.checker.check_model(model, full_check=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        onnx.save(model, path)
        for stature in (None, 1.7):
            ours = BodyDimensionsModel(path).predict(judging, stature=stature)
            height, quantiles = self.predict(judging, stature)
            off = max(np.abs(ours.height - height).max(),
                      np.abs(ours.log_distance - np.median(quantiles, axis=1)).max())
            if np.quantile(np.abs(ours.height - height), 0.99) > _SAME or off > 0.2:
                raise AssertionError(f'ONNX Runtime differs from scikit-learn by {off:g}')

    def _trees(self, loss: str, alpha: float = 0.5) -> GradientBoostingRegressor:
        options = self._options
        return GradientBoostingRegressor(
            loss=loss, alpha=alpha, n_estimators=options.trees, max_depth=options.depth,
            learning_rate=options.learning_rate, subsample=0.5, max_features=0.6,
            min_samples_leaf=5, random_state=options.seed)

    def _second_stage(self, rows: Rows, unseen: _Array) -> list[GradientBoostingRegressor]:
        inputs = np.concatenate([
            _with_height(rows.features, unseen, known=False),
            _with_height(rows.features, rows.stature, known=True)])
        target = np.concatenate([rows.target(unseen), rows.target(rows.stature)])
        return [self._trees('quantile', alpha).fit(inputs, target) for alpha in QUANTILES]


def _stored(features: _Array) -> _Array:
    """Return the features as float32 holds them, which is what ONNX Runtime compares."""
    return features.astype(np.float32).astype(np.float64)


def _with_height(features: _Array, height: _Array, *, known: bool) -> _Array:
    return _stored(np.column_stack([features, height, np.full(len(height), float(known))]))


def _told(
    quantiles: Sequence[GradientBoostingRegressor], features: _Array, height: _Array, *,
    known: bool,
) -> _Array:
    inputs = _with_height(features, height, known=known)
    return np.stack([trees.predict(inputs) for trees in quantiles], axis=-1)


def _graph(
    height: GradientBoostingRegressor, quantiles: Sequence[GradientBoostingRegressor], n: int,
) -> onnx.ModelProto:
    """Return both stages as one graph; a stature of NaN is one that is not known."""
    nodes = [
        _ensemble(height, n, 'features', 'predicted_height'),
        helper.make_node('IsNaN', ['stature'], ['unknown']),
        helper.make_node('Where', ['unknown', 'predicted_height', 'stature'], ['height']),
        helper.make_node('Not', ['unknown'], ['told']),
        helper.make_node('Cast', ['told'], ['known'], to=TensorProto.FLOAT),
        helper.make_node('Concat', ['features', 'height', 'known'], ['inputs'], axis=1)]
    names = [f'quantile_{alpha:g}' for alpha in QUANTILES]
    nodes += [_ensemble(trees, n + 2, 'inputs', name)
              for trees, name in zip(quantiles, names, strict=True)]
    nodes.append(helper.make_node('Concat', names, ['quantiles'], axis=1))

    def value(name: str, columns: int) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, ['n', columns])

    graph = helper.make_graph(
        nodes, 'body_dimensions', [value('features', n), value('stature', 1)],
        [value('height', 1), value('quantiles', len(QUANTILES))])
    return helper.make_model(
        graph, ir_version=8, producer_name='depth_person',
        opset_imports=[helper.make_opsetid(*opset) for opset in _OPSETS.items()])


def _ensemble(
    trees: GradientBoostingRegressor, n: int, source: str, output: str,
) -> onnx.NodeProto:
    """Return the node that skl2onnx makes of one ensemble, between these names."""
    exported = to_onnx(trees, np.zeros((1, n), np.float32), target_opset=_OPSETS)
    node, = exported.graph.node
    node.input[:], node.output[:], node.name = [source], [output], output
    return node
