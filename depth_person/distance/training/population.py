"""People of our own making: keypoints of random bodies in random poses."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any
import warnings

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.training.poses import PoseSampler
from depth_person.errors import DepthPersonError
from depth_person.pose.skeleton import COCO17_ROWS, Keypoint, N_KEYPOINTS

#: Stature of men and women, mean and spread in metres (ANSUR II, 4082 men, 1986 women).
STATURE = ((1.756, 0.069), (1.628, 0.064))
#: Biacromial breadth over metres of stature: offset, slope, spread left (ANSUR II).
BIACROMIAL = ((0.1547, 0.1486, 0.0162), (0.1028, 0.1612, 0.0151))
#: The body model's shoulder keypoints lie this much of the biacromial breadth apart.
KEYPOINTS_OF_BIACROMIAL = 0.875
#: Part of the adults whose build is drawn nearer to the average one, and by how much. The body
#: model's own sampler also draws builds that are rare among the people a camera meets.
ORDINARY = 0.5
NEARER = 0.4

_BATCH = 1000
_BUILD = ('age', 'muscle', 'weight', 'proportions')


@dataclass(frozen=True, eq=False)
class Population:
    """
    Bodies in their poses; x to the body's left, y back, z up, in metres.

    :ivar keypoints: (n, 18, 3) float32, COCO-18 with the neck at the shoulders' midpoint.
    :ivar stature: (n,) metres, barefoot and upright.
    :ivar shoulder_width: (n,) metres between the shoulder keypoints.
    :ivar child: (n,) whether younger than 18.
    :ivar kind: (n,) index into poses.KINDS.
    """

    keypoints: NDArray[np.float32]
    stature: NDArray[np.float32]
    shoulder_width: NDArray[np.float32]
    child: NDArray[np.bool_]
    kind: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.keypoints)

    def take(self, rows: NDArray[np.integer]) -> Population:
        """Return the bodies of these rows."""
        return Population(*(getattr(self, field.name)[rows] for field in fields(self)))


class BodyModel:
    """
    The parametric body model anny with its population sampler (Apache-2.0).

    Shapes are drawn by its sampler, whose statures follow WHO data. Adults are rescaled to the
    statures of ANSUR II, and their shoulders set to its biacromial breadths.

    :raises DepthPersonError: when torch or anny is not installed.
    """

    def __init__(self, seed: int) -> None:
        try:
            import anny
            from anny.shape_distribution import SimpleShapeDistribution
            import torch
        except ImportError as error:
            raise DepthPersonError(
                f'training needs torch and anny, and {error.name} is missing; '
                "install them with: pip install 'depth_person[train]'") from error
        self._torch = torch
        torch.manual_seed(seed)
        self._rng = np.random.default_rng(seed)
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            self._model = anny.Anny()
        self._keypoints = anny.KeypointsRegressor.coco(self._model)
        self._samplers = {
            child: SimpleShapeDistribution(
                self._model, torch.distributions.Uniform(*self._ages(child)),
                torch.distributions.Beta(*(0.1 + 0 * self._ages(child))))
            for child in (False, True)}

    def sample(self, n: int, *, children: float) -> Iterator[Population]:
        """Yield batches of together n people, this part of them children."""
        while n > 0:
            size = min(n, _BATCH)
            for child, count in ((False, size - round(size * children)),
                                 (True, round(size * children))):
                if count:
                    yield self._posed(self._shapes(count, child), child, self._rng)
            n -= size

    def repeated(self, n: int, *, poses: int) -> Iterator[Population]:
        """Yield the same n adults so many times, each time in other poses."""
        shapes, seed = self._shapes(n, child=False), self._rng.integers(2 ** 32)
        for _ in range(poses):
            yield self._posed(shapes, child=False, shoulders=np.random.default_rng(seed))

    def _ages(self, child: bool) -> Any:
        return self._torch.tensor([4.0, 17.0] if child else [18.0, 75.0],
                                  dtype=self._model.dtype)

    def _shapes(self, n: int, child: bool) -> dict[str, Any]:
        """Return what tells the model of n bodies."""
        torch = self._torch
        _, phenotype = self._samplers[child].sample(n)
        ordinary = torch.as_tensor((self._rng.random(n) < ORDINARY) & (not child))
        for name in _BUILD:
            build = phenotype[name]
            nearer = build.mean() + NEARER * (build - build.mean())
            phenotype[name] = torch.where(ordinary, nearer, build)
        return phenotype

    def _posed(
        self, phenotype: dict[str, Any], child: bool, shoulders: np.random.Generator,
    ) -> Population:
        """
        Return bodies in random poses.

        :param shoulders: draws how broad they are.
        """
        torch, n = self._torch, len(phenotype['gender'])
        sampler = PoseSampler(self._rng, n)
        pose = {}
        for bone, rotation in sampler.sample().items():
            pose[bone] = torch.eye(4, dtype=self._model.dtype).repeat(n, 1, 1)
            pose[bone][:, :3, :3] = torch.as_tensor(rotation, dtype=self._model.dtype)
        with torch.no_grad():
            output = self._model(pose_parameters=pose, phenotype_kwargs=phenotype)
            coco17 = self._keypoints(output).numpy()[:, :17]
            rest = output['rest_vertices']
            at_rest = self._keypoints({'vertices': rest}).numpy()
            height = (rest[..., 2].amax(1) - rest[..., 2].amin(1)).numpy()
        keypoints = coco17[:, COCO17_ROWS]
        width = np.linalg.norm(at_rest[:, 5] - at_rest[:, 6], axis=-1)
        if not child:
            keypoints, height, width = self._as_ansur(
                keypoints, height, width, (phenotype['gender'].numpy() > 0.5).astype(int),
                shoulders)
        keypoints[:, Keypoint.NECK] = keypoints[:, _SHOULDERS].mean(axis=1)
        return Population(
            keypoints.astype(np.float32), height.astype(np.float32), width.astype(np.float32),
            np.full(n, child), sampler.kind)

    def _as_ansur(
        self, keypoints: NDArray[np.float64], height: NDArray[np.float64],
        width: NDArray[np.float64], sex: NDArray[np.int64], shoulders: np.random.Generator,
    ) -> tuple[NDArray[np.float64], ...]:
        """Return keypoints, statures and shoulder widths as ANSUR II has them."""
        stature, wanted = np.empty_like(height), np.empty_like(width)
        for value, (mean, spread) in enumerate(STATURE):
            rows = sex == value
            drawn = height[rows]
            stature[rows] = mean + (drawn - drawn.mean()) * spread / drawn.std()
            offset, slope, rest = BIACROMIAL[value]
            breadth = offset + slope * stature[rows] + shoulders.normal(0, rest, rows.sum())
            wanted[rows] = KEYPOINTS_OF_BIACROMIAL * breadth
        scale = stature / height
        keypoints = keypoints * scale[:, None, None]
        return widen_shoulders(keypoints, wanted / (width * scale)), stature, wanted


def sample_population(
    seed: int, n: int, *, children: float, progress: Callable[..., Any],
) -> Population:
    """
    Return n people of our own making, this part of them children.

    :param progress: like tqdm: takes an iterable and desc.
    :raises DepthPersonError: when torch or anny is not installed.
    """
    batches = list(progress(BodyModel(seed).sample(n, children=children), desc='bodies'))
    return Population(*(
        np.concatenate([getattr(batch, field.name) for batch in batches])
        for field in fields(Population)))


def widen_shoulders(
    keypoints: NDArray[np.float64], ratio: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (n, 18, 3) keypoints with the shoulders this many times as far apart, arms kept."""
    if keypoints.shape[1:] != (N_KEYPOINTS, 3):
        raise ValueError(f'keypoints of shape {keypoints.shape}, not (n, 18, 3)')
    result = keypoints.copy()
    middle = keypoints[:, _SHOULDERS].mean(axis=1)
    for shoulder in _SHOULDERS:
        moved = (keypoints[:, shoulder] - middle) * (ratio - 1)[:, None]
        result[:, shoulder:shoulder + 3] += moved[:, None]
    return result


_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
