"""The learned lifter: from a canonical skeleton to the logarithm of range and its spread."""
from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.canonical import Canonical
from depth_person.pose.runtime import open_session

_Array = NDArray[np.float64]

MODEL_PATH = Path(__file__).parent / 'models' / 'skeleton.onnx'
#: Fewer keypoints, in different places, fix no range.
FEWEST_KEYPOINTS = 2
#: The average adult, metres: what known statures and widths are told relative to.
STATURE, SHOULDER_WIDTH = 1.69, 0.337


@dataclass(frozen=True, eq=False)
class Knowledge:
    """
    What is known of n people beside their keypoints; NaN where nothing is.

    :ivar figures: (n, conventions.N_FIGURES) where the network marks keypoints.
    :ivar stature: (n,) metres, with its spread relative to it.
    :ivar shoulder_width: (n,) metres between shoulder keypoints as the network marks them, with
        its relative spread.
    :ivar children: (n,) whether they may be children.
    """

    figures: _Array
    stature: _Array
    stature_sigma: _Array
    shoulder_width: _Array
    shoulder_width_sigma: _Array
    children: NDArray[np.bool_]

    def as_features(self) -> _Array:
        """Return (n, k) what the network is told."""
        return np.column_stack([
            self.figures, _told(self.stature, self.stature_sigma, STATURE),
            _told(self.shoulder_width, self.shoulder_width_sigma, SHOULDER_WIDTH),
            self.children])


def _told(value: _Array, sigma: _Array, average: float) -> _Array:
    """Return (n, 3): log of value over average, whether known, and sigma; zeros where unknown."""
    known = np.isfinite(value) & np.isfinite(sigma)
    told = np.column_stack([
        4 * np.log(np.where(known, value, average) / average), np.ones(len(value)), 10 * sigma])
    return np.where(known[:, None], told, 0.0)


@dataclass(frozen=True, eq=False)
class LifterInputs:
    """
    The network's inputs, float32.

    :ivar points: (n, 18, 2) canonical points.
    :ivar known: (n, 18) 1 where the keypoint is there, else 0.
    :ivar noise: (n, 18) keypoint spreads in the points' metres; 0 where unknown.
    :ivar gravity: (n, 4) direction down in the virtual camera, and 1 where it is known.
    :ivar context: (n, N_CONTEXT) how near the person is, and Knowledge.
    """

    points: NDArray[np.float32]
    known: NDArray[np.float32]
    noise: NDArray[np.float32]
    gravity: NDArray[np.float32]
    context: NDArray[np.float32]

    def take(self, rows: NDArray[np.bool_]) -> LifterInputs:
        """Return the inputs of these rows."""
        return LifterInputs(*(getattr(self, field.name)[rows] for field in fields(self)))

    def as_feed(self) -> dict[str, NDArray[np.float32]]:
        """Return the arrays by the names of the network's inputs."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def lifter_inputs(
    view: Canonical, *, noise_rad: _Array, gravity: _Array, told: _Array,
) -> LifterInputs:
    """
    Return the network's inputs.

    :param noise_rad: (n, 18) keypoint spreads, radians.
    :param gravity: (n, 3) or (1, 3) unit vectors down in the camera optical frame; NaN where
        unknown.
    :param told: (n, k) or (1, k) of Knowledge.as_features().
    """
    n = len(view.guess)
    guess = np.where(np.isfinite(view.guess), view.guess, 1.0)
    down = np.zeros((n, 4), np.float32)
    level = np.isfinite(gravity[:, 0])
    if level.any():
        turned = (view.rotation @ gravity[..., None])[..., 0]
        down[:, :3], down[:, 3] = np.where(level[:, None], turned, 0.0), level
    context = np.empty((n, 1 + told.shape[1]), np.float32)
    context[:, 0], context[:, 1:] = 1.0 / np.maximum(guess, 0.5), told
    noise = np.where(view.known, noise_rad * guess[:, None], 0.0)
    return LifterInputs(
        points=view.points.astype(np.float32), known=view.known.astype(np.float32),
        noise=noise.astype(np.float32), gravity=down, context=context)


@dataclass(frozen=True, eq=False)
class Lifted:
    """
    What the network tells.

    :ivar log_correction: (n,) logarithm of range over the canonical guess.
    :ivar log_sigma: (n,) its standard deviation.
    :ivar neck: (n, 2) the neck in canonical coordinates.
    :ivar yaw: (n, 2) cosine and sine of the body's yaw, shorter the less it is known.
    """

    log_correction: _Array
    log_sigma: _Array
    neck: _Array
    yaw: _Array


_OUTPUTS = [field.name for field in fields(Lifted)]


class Lifter:
    """
    The trained network, run by ONNX Runtime on one thread.

    :raises DepthPersonError: when the model file cannot be read.
    """

    def __init__(self, path: Path = MODEL_PATH) -> None:
        self._session = open_session(
            path, threads=1, remedy='install depth_person again or train the model with: '
            'depth_person train skeleton')

    def lift(self, inputs: LifterInputs) -> Lifted:
        """Return what the network tells of each person."""
        outputs = self._session.run(_OUTPUTS, inputs.as_feed())
        return Lifted(*(np.asarray(output, np.float64) for output in outputs))


@cache
def default_lifter() -> Lifter:
    """Return the network that the package ships, loaded once."""
    return Lifter()
