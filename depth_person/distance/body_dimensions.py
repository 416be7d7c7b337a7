"""The second paper's method: real height, then distance, from the box round a person."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cache
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics
from depth_person.distance.body_box import (
    angle_boxes,
    ANGLE_FEATURES,
    AngleBoxes,
    pixel_boxes,
    PIXEL_FEATURES,
    usable,
)
from depth_person.distance.conventions import convention_of
from depth_person.distance.estimator import Body, Cue, Distances, Mounting, Reason, UPSIDE_DOWN
from depth_person.distance.vectors import unit
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.pose.runtime import open_session
from depth_person.pose.skeleton import Keypoint

_Array = NDArray[np.float64]

#: The features of each kind of model, in the order in which it takes them.
FEATURES = {'normalised': ANGLE_FEATURES, 'paper': PIXEL_FEATURES}
#: Ranges outside this are out of reach, metres.
RANGES = (0.3, 100.0)
#: No model knows the logarithm of a distance better than this.
SMALLEST_SIGMA = 0.01
#: A focal length that differs by more (relative) is another camera's.
SAME_FOCAL_LENGTH = 0.02

_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]


def model_file(kind: str) -> Path:
    """Return where the package keeps its own model of this kind."""
    return Path(__file__).parent / 'models' / f'body_dimensions_{kind}.onnx'


@dataclass(frozen=True)
class ModelCamera:
    """The one camera that a `paper` model was trained with."""

    width: int
    height: int
    focal_px: float

    def is_of(self, intrinsics: Intrinsics) -> bool:
        """Return whether the intrinsics are this camera's."""
        ratios = intrinsics.fx / self.focal_px, intrinsics.fy / self.focal_px
        return (intrinsics.width, intrinsics.height) == (self.width, self.height) and all(
            abs(ratio - 1) <= SAME_FOCAL_LENGTH for ratio in ratios)


@dataclass(frozen=True, eq=False)
class Predicted:
    """
    What a model tells of n boxes.

    :ivar height: (n,) stature, metres: as predicted, or as known.
    :ivar log_distance: (n,) median of the logarithm of what the model was trained to tell.
    :ivar log_sigma: (n,) half of what lies between its 16 % and 84 % quantiles.
    """

    height: _Array
    log_distance: _Array
    log_sigma: _Array


class BodyDimensionsModel:
    """
    Gradient-boosted trees for height and for three quantiles of distance, run by ONNX Runtime.

    The file's metadata say what the trees were trained on: `kind`, `features` (names in order),
    `sigma_scale` and, for one camera's model, `camera`.

    :raises DepthPersonError: when the file cannot be read, or takes other features.
    """

    def __init__(self, path: Path) -> None:
        self._session = open_session(
            path, threads=1, remedy='install depth_person again or train the model with: '
            'depth_person train body-dimensions')
        told = self._session.get_modelmeta().custom_metadata_map
        self.kind = told.get('kind', '')
        features = tuple(json.loads(told.get('features', '[]')))
        if features != FEATURES.get(self.kind):
            raise DepthPersonError(
                f'the model {path} is of kind {self.kind!r} and takes the features '
                f'{", ".join(features) or "(none named)"}; this version knows '
                + '; '.join(f'{kind!r} with {", ".join(names)}'
                            for kind, names in FEATURES.items())
                + '. Train it again with: depth_person train body-dimensions')
        self._sigma_scale = float(told.get('sigma_scale', 1.0))
        self.camera = ModelCamera(**json.loads(told['camera'])) if 'camera' in told else None

    def predict(self, features: _Array, *, stature: float | None = None) -> Predicted:
        """
        Return what the trees tell of n boxes.

        :param features: (n, k) in the order of FEATURES.
        :param stature: of everyone, metres, where it is known.
        """
        known = np.full((len(features), 1), np.nan if stature is None else stature, np.float32)
        height, quantiles = self._session.run(
            ['height', 'quantiles'],
            {'features': features.astype(np.float32), 'stature': known})
        # Trees for separate quantiles may cross; in order they are never farther from the truth
        # (Chernozhukov et al., Quantile and probability curves without crossing, 2010).
        low, middle, high = np.sort(quantiles.astype(np.float64), axis=1).T
        sigma = self._sigma_scale * (high - low) / 2
        return Predicted(
            height[:, 0].astype(np.float64), middle, np.maximum(sigma, SMALLEST_SIGMA))


@cache
def default_model() -> BodyDimensionsModel:
    """Return the `normalised` model that the package ships, loaded once."""
    return BodyDimensionsModel(model_file('normalised'))


class BodyDimensionsEstimator:
    """
    Distance from the box round a standing person, seen from head to ankles.

    Trees predict the real height from the box, then the distance from height and box, with its
    16 % and 84 % quantiles, which give sigma. The `normalised` model takes the box in angles,
    with where the joints lie in it, so any camera will do; gravity tells it how steeply it looks
    down. The `paper` model takes pixels, and is of use in front of its own camera only.

    A height that is known (body.stature) takes the place of the predicted one. The shoulder width
    is not used, nor the camera's height.

    :param body: what is known of the people in view.
    """

    name = 'body_dimensions'

    def __init__(self, body: Body = Body(), *, model: BodyDimensionsModel | None = None) -> None:
        self._body = body
        self._model = default_model() if model is None else model

    def estimate(
        self, people: People, intrinsics: Intrinsics, mounting: Mounting = Mounting(),
    ) -> Distances:
        """
        Return one distance a person; never raises for what a keypoint holds.

        :raises DepthPersonError: when the model is made for another camera.
        """
        return self.measure(people, intrinsics, mounting)[0]

    def measure(
        self, people: People, intrinsics: Intrinsics, mounting: Mounting = Mounting(),
    ) -> tuple[Distances, _Array]:
        """Return the distances, and the heights (n,) in metres; NaN where there is no box."""
        self._check_camera(intrinsics)
        if len(people) == 0:
            return Distances.none(0, Reason.NONE), np.empty(0)
        placement = convention_of(people.convention).placement
        gravity = mounting.down
        plane = intrinsics.undistort(people.keypoints[..., :2])
        known = usable(people.keypoints)
        boxes = angle_boxes(
            plane, known, gravity=gravity, placement=placement,
            children=np.array([self._body.children]))
        neck = _neck(people, plane, known, boxes)
        features, seen = boxes.features, np.isfinite(boxes.height) & (boxes.height > 0)
        if self._model.kind == 'paper':
            features = pixel_boxes(people.keypoints)
            seen = seen & np.isfinite(features).all(axis=1)
        told = self._model.predict(
            np.where(seen[:, None], features, 1.0), stature=self._body.stature)
        sigma = told.log_sigma
        if self._body.stature is not None:
            sigma = np.hypot(sigma, self._body.stature_sigma)
        with np.errstate(divide='ignore', invalid='ignore'):
            range_ = np.exp(told.log_distance) * (
                told.height / boxes.height if self._model.kind == 'normalised'
                else 1 / np.hypot(neck[:, 0], neck[:, 2]))  # the paper's are along the floor
            upside_down = (boxes.down * gravity).sum(axis=1) < UPSIDE_DOWN
        distances = Distances.of(
            position=range_[:, None] * neck, range_sigma=range_ * sigma,
            reason=_reasons(seen, upside_down, range_),
            cues=np.full(len(people), Cue.BOX, np.uint8))
        return distances, np.where(distances.known, told.height, np.nan)

    def _check_camera(self, intrinsics: Intrinsics) -> None:
        camera = self._model.camera
        if camera is not None and not camera.is_of(intrinsics):
            raise DepthPersonError(
                f'this body dimensions model holds for a camera of {camera.width}x{camera.height} '
                f'px with a focal length of {camera.focal_px:.0f} px, not for one of '
                f'{intrinsics.width}x{intrinsics.height} px and {intrinsics.fx:.0f} px; use the '
                'normalised model, which holds for any camera')


def _reasons(
    seen: NDArray[np.bool_], upside_down: NDArray[np.bool_], range_: _Array,
) -> NDArray[np.uint8]:
    """Return (n,) why a person has no range."""
    with np.errstate(invalid='ignore'):
        outside = ~((range_ > RANGES[0]) & (range_ < RANGES[1]))
    return np.select(
        [~seen, upside_down, outside],
        [Reason.TOO_FEW_KEYPOINTS, Reason.IMPLAUSIBLE_SKELETON, Reason.OUT_OF_RANGE],
        Reason.NONE).astype(np.uint8)


def _neck(
    people: People, plane: _Array, known: NDArray[np.bool_], boxes: AngleBoxes,
) -> _Array:
    """Return unit view rays (n, 3) of the necks: marked, midway of the shoulders, or usual."""
    rays = np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1)
    both = known[:, _SHOULDERS].all(axis=1, keepdims=True)
    neck = np.where(both, rays[:, _SHOULDERS].mean(axis=1), boxes.neck)
    if people.neck_measured:
        neck = np.where(known[:, [Keypoint.NECK]], rays[:, Keypoint.NECK], neck)
    return unit(neck)
