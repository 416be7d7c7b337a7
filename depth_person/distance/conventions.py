"""Where networks mark the keypoints of a body, and how surely: one convention a network."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.pose.skeleton import Keypoint

_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
_HIPS = [Keypoint.R_HIP, Keypoint.L_HIP]
_FACE = [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR]


@dataclass(frozen=True)
class Placement:
    """
    Where keypoints lie, against those of the training bodies' mesh; all zero for the mesh itself.

    Each is affine along a line of the body, so it is nearly the same in the image as in space.

    :ivar shoulder_width: natural logarithm of the shoulders' distance over the mesh's.
    :ivar shoulder_drop: how far the shoulders lie towards the hips, in torso lengths.
    :ivar hip_width: natural logarithm of the hips' distance over the mesh's.
    :ivar hip_drop: how far the hips lie away from the shoulders, in torso lengths.
    :ivar face_size: natural logarithm of the face keypoints' spread over the mesh's.
    :ivar face_drop: how far the face lies towards the hips, in torso lengths.
    :ivar ankle_drop: how far the ankles lie away from the knees, in lengths of the shank.
    """

    shoulder_width: float = 0.0
    shoulder_drop: float = 0.0
    hip_width: float = 0.0
    hip_drop: float = 0.0
    face_size: float = 0.0
    face_drop: float = 0.0
    ankle_drop: float = 0.0

    def as_array(self) -> NDArray[np.float64]:
        """Return the figures as one row."""
        return np.array(astuple(self))


#: How many figures a placement has.
N_FIGURES = len(astuple(Placement()))


def place(
    keypoints: NDArray[np.floating], figures: NDArray[np.floating],
) -> NDArray[np.floating]:
    """
    Return the keypoints of the mesh as networks of these conventions would mark them.

    :param keypoints: (n, 18, 2 or 3) of the mesh, in space or in an image.
    :param figures: (n, N_FIGURES), rows of Placement.as_array().
    """
    shoulder_width, shoulder_drop, hip_width, hip_drop, face_size, face_drop, ankle_drop = (
        np.moveaxis(figures[:, :, None, None], 1, 0))
    result = np.array(keypoints)
    shoulders, hips = keypoints[:, _SHOULDERS], keypoints[:, _HIPS]
    shoulder_middle = shoulders.mean(axis=1, keepdims=True)
    hip_middle = hips.mean(axis=1, keepdims=True)
    torso = hip_middle - shoulder_middle
    result[:, _SHOULDERS] = (
        shoulder_middle + (shoulders - shoulder_middle) * np.exp(shoulder_width)
        + shoulder_drop * torso)
    result[:, _HIPS] = hip_middle + (hips - hip_middle) * np.exp(hip_width) + hip_drop * torso
    face = keypoints[:, _FACE]
    face_middle = face.mean(axis=1, keepdims=True)
    result[:, _FACE] = face_middle + (face - face_middle) * np.exp(face_size) + face_drop * torso
    for knee, ankle in ((Keypoint.R_KNEE, Keypoint.R_ANKLE), (Keypoint.L_KNEE, Keypoint.L_ANKLE)):
        shank = keypoints[:, ankle] - keypoints[:, knee]
        result[:, ankle] = keypoints[:, ankle] + ankle_drop[:, 0] * shank
    result[:, Keypoint.NECK] = result[:, _SHOULDERS].mean(axis=1)
    return result


@dataclass(frozen=True)
class Convention:
    """
    How one kind of network marks keypoints.

    A keypoint's spread is the root of pixels^2 + (metres on the body)^2, times
    (usual_score / score) ^ score_power: it grows as the score falls.

    :ivar placement: where it marks them.
    :ivar pixel_sigma: spread fixed in image pixels, u and v each.
    :ivar body_sigma: spread fixed on the body, metres.
    :ivar usual_score: at which these two hold.
    :ivar score_power: how much the score tells; 0 for nothing.
    :ivar sigma_scale: how much wider than for the training bodies' own keypoints sigma has to be:
        a network also errs in ways that are the same for neighbouring keypoints.
    """

    placement: Placement
    pixel_sigma: float
    body_sigma: float
    usual_score: float
    score_power: float
    sigma_scale: float = 1.0

    def noise_px(
        self, scores: NDArray[np.floating], *, px_per_m: NDArray[np.floating],
    ) -> NDArray[np.float64]:
        """
        Return the spreads (n, 18) of keypoints, pixels.

        :param scores: (n, 18).
        :param px_per_m: (n,) how large a metre appears where the person stands.
        """
        sure = np.hypot(self.pixel_sigma, self.body_sigma * px_per_m)
        return sure[:, None] * self._doubt(scores)

    def noise_rad(
        self, scores: NDArray[np.floating], *, rad_per_px: NDArray[np.floating],
        guess: NDArray[np.floating],
    ) -> NDArray[np.float64]:
        """
        Return the spreads (n, 18) of keypoints, radians.

        :param scores: (n, 18).
        :param rad_per_px: (n,) angle of a pixel where the person stands.
        :param guess: (n,) roughly the range, metres.
        """
        sure = np.hypot(self.pixel_sigma * rad_per_px, self.body_sigma / guess)
        return sure[:, None] * self._doubt(scores)

    def _doubt(self, scores: NDArray[np.floating]) -> NDArray[np.float64]:
        return (self.usual_score / np.clip(scores, LOWEST_SCORE, 1.0)) ** self.score_power


#: Keypoints that score less are not worth keeping.
LOWEST_SCORE = 0.1

#: The convention of each name that People.convention may hold. `mesh` is the training bodies' own,
#: for exact keypoints; `coco` is for networks that nobody has measured. msg_docs/accuracy.md
#: says what each figure was measured on.
CONVENTIONS: Mapping[str, Convention] = {
    'coco': Convention(
        Placement(shoulder_width=-0.05, face_drop=0.015, ankle_drop=-0.025),
        pixel_sigma=1.5, body_sigma=0.02, usual_score=0.65, score_power=1.0, sigma_scale=1.4),
    'mesh': Convention(
        Placement(), pixel_sigma=1.0, body_sigma=0.002, usual_score=1.0, score_power=0.5),
    'movenet': Convention(
        Placement(shoulder_width=-0.05, hip_width=-0.03, hip_drop=-0.012, face_size=-0.08),
        pixel_sigma=1.5, body_sigma=0.015, usual_score=0.65, score_power=1.0, sigma_scale=1.35),
    'movenet_crops': Convention(
        Placement(
            shoulder_width=-0.007, shoulder_drop=-0.012, hip_width=0.047, hip_drop=-0.057,
            ankle_drop=-0.068),
        pixel_sigma=1.5, body_sigma=0.02, usual_score=0.65, score_power=1.0, sigma_scale=1.35),
    'openpose': Convention(
        Placement(shoulder_width=-0.18, hip_drop=-0.018, ankle_drop=-0.06),
        pixel_sigma=1.5, body_sigma=0.03, usual_score=0.65, score_power=1.0, sigma_scale=1.35),
    'pifpaf': Convention(
        Placement(
            shoulder_width=-0.05, hip_width=0.04, face_size=0.08, face_drop=0.02,
            ankle_drop=-0.05),
        pixel_sigma=1.0, body_sigma=0.015, usual_score=0.7, score_power=1.0, sigma_scale=1.35),
}


def convention_of(name: str) -> Convention:
    """Return the convention of this name; `coco` for a name that nobody has measured."""
    return CONVENTIONS.get(name, CONVENTIONS['coco'])
