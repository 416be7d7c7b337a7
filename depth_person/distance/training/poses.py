"""Random poses of the body model: joint rotations of people who stand, walk, sit and crouch."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: The kinds of pose, and how often each is drawn.
KINDS = {'stand': 0.34, 'walk': 0.22, 'arms': 0.18, 'lean': 0.10, 'sit': 0.08, 'crouch': 0.08}

_Array = NDArray[np.float64]
# Directions of the left upper arm in the rest pose; x to the body's left, y back, z up.
_UPPER_ARM = np.array([0.62, -0.05, -0.78])
_ELBOW_AXIS = np.array([-0.78, 0.0, -0.62])


def rotations(axis: _Array, degrees: _Array) -> _Array:
    """Return the (n, 3, 3) rotations by n angles about one axis (Rodrigues' formula)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)[:, None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def _turn(about: str, degrees: _Array) -> _Array:
    return rotations(np.eye(3)['xyz'.index(about)], degrees)


class PoseSampler:
    """
    Draws poses as rotations of the body model's bones, in its world-aligned rest axes.

    :ivar kind: (n,) index into KINDS of each person drawn.
    """

    def __init__(self, rng: np.random.Generator, n: int) -> None:
        self._rng = rng
        self._n = n
        self.kind = rng.choice(len(KINDS), n, p=list(KINDS.values()))

    def sample(self) -> dict[str, _Array]:
        """Return bone name -> (n, 3, 3) rotations."""
        bones = self._trunk()
        stride = self._is('walk') * self._rng.uniform(5, 32, self._n) * self._sign()
        for side, mirror in (('L', 1.0), ('R', -1.0)):
            bones |= self._leg(side, mirror, stride * mirror)
            bones |= self._arm(side, mirror, stride * mirror)
        return bones

    def _is(self, *kinds: str) -> NDArray[np.bool_]:
        return np.isin(self.kind, [list(KINDS).index(kind) for kind in kinds])

    def _sign(self) -> _Array:
        return self._rng.choice([-1.0, 1.0], self._n)

    def _normal(self, sigma: float) -> _Array:
        return self._rng.normal(0, sigma, self._n)

    def _uniform(self, low: float, high: float) -> _Array:
        return self._rng.uniform(low, high, self._n)

    def _trunk(self) -> dict[str, _Array]:
        lean = self._normal(4)
        lean = np.where(self._is('lean'), self._uniform(-10, 50), lean)
        lean = np.where(self._is('sit'), self._uniform(-15, 35), lean)
        lean = np.where(self._is('crouch'), self._uniform(5, 50), lean)
        side = self._normal(3) + self._is('lean') * self._normal(10)
        looking = np.where(self._rng.random(self._n) < 0.4, self._uniform(-60, 60),
                           self._normal(10))
        return {
            'root': _turn('y', self._normal(2)) @ _turn('x', self._normal(2) + 0.4 * lean),
            'spine03': _turn('z', self._normal(6)) @ _turn('y', side) @ _turn('x', 0.6 * lean),
            'neck01': _turn('z', 0.5 * looking) @ _turn('x', self._normal(10) - 0.3 * lean),
            'head': _turn('y', self._normal(6)) @ _turn('z', 0.5 * looking)
            @ _turn('x', self._normal(8)),
        }

    def _leg(self, side: str, mirror: float, stride: _Array) -> dict[str, _Array]:
        flexion = self._normal(3) + stride
        flexion = np.where(self._is('sit'), self._uniform(65, 105), flexion)
        flexion = np.where(self._is('crouch'), self._uniform(40, 125), flexion)
        knee = np.abs(self._normal(4)) + np.clip(-stride, 0, None) * self._uniform(0.2, 1.6)
        knee = np.where(self._is('sit'), self._uniform(50, 105), knee)
        knee = np.where(self._is('crouch'), flexion * self._uniform(0.9, 1.4), knee)
        inward = self._uniform(-2, 11) - self._is('sit', 'crouch') * self._uniform(0, 25)
        return {
            f'upperleg01.{side}': _turn('x', -flexion) @ _turn('y', mirror * inward)
            @ _turn('z', self._normal(8)),
            f'lowerleg01.{side}': _turn('x', np.clip(knee, 0, 140)),
        }

    def _arm(self, side: str, mirror: float, stride: _Array) -> dict[str, _Array]:
        free = self._rng.random(self._n) < np.where(self._is('arms'), 0.8, 0.25)
        inward = np.where(free, self._uniform(-110, 50), self._uniform(24, 40))
        forward = np.where(free, self._uniform(-40, 100), self._normal(8) - 0.8 * stride)
        twist = np.where(free, self._uniform(-60, 100), self._normal(20))
        bend = np.where(free, self._uniform(-32, 110), np.abs(self._normal(15)) - 32)
        raised = np.clip(-inward - 30, 0, None) * 0.25
        flip = np.array([mirror, 1.0, 1.0])
        # A mirrored axis keeps its rotation's sense only when the angle changes sign.
        return {
            f'clavicle.{side}': _turn('y', -mirror * (raised + self._normal(3)))
            @ _turn('z', self._normal(5)),
            f'upperarm01.{side}': _turn('x', -forward) @ _turn('y', mirror * inward)
            @ rotations(_UPPER_ARM * flip, mirror * twist),
            f'lowerarm01.{side}': rotations(_ELBOW_AXIS * flip, mirror * bend),
        }
