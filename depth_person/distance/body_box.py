"""The box round a standing person, taken from keypoints: in pixels, and in angles."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.conventions import LOWEST_SCORE, Placement
from depth_person.distance.vectors import cross, unit, unit_or_zero
from depth_person.pose.skeleton import Keypoint, N_KEYPOINTS

_Array = NDArray[np.float64]

#: The paper's features: stature D1, width D2 and centroid D3, D4 of the box, pixels.
PIXEL_FEATURES = ('d1_height_px', 'd2_width_px', 'd3_center_x_px', 'd4_center_y_px')
#: Ours. Levels count down from the face, and levels and widths are in heights of the box, so that
#: all but the height and the elevation stay as they are when the person walks away.
ANGLE_FEATURES = (
    'log_aspect', 'height_rad', 'elevation_rad', 'shoulder_level', 'hip_level', 'knee_level',
    'nose_level', 'shoulder_width', 'hip_width', 'ear_width', 'children')
#: Stands for a feature that is not known; far from every value that one may have.
MISSING = -10.0

#: The crown lies this far above the face's keypoints, and the soles this far below the ankles,
#: in distances from face to ankles; means of upright bodies of the training population.
CROWN, SOLES = 0.083, 0.070
#: Flesh round the keypoints widens a box by this part of its height.
FLESH = 0.05
#: From face to neck, and from neck to hips, in distances from face to ankles.
_NECK_LEVEL, _TORSO = 0.137, 0.34
# From knees to ankles, likewise.
_SHANK = 0.28

_FACE = [Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR]
_SHOULDERS = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
_HIPS = [Keypoint.R_HIP, Keypoint.L_HIP]
_KNEES = [Keypoint.R_KNEE, Keypoint.L_KNEE]
_ANKLES = [Keypoint.R_ANKLE, Keypoint.L_ANKLE]
_EARS = [Keypoint.R_EAR, Keypoint.L_EAR]
# Column by column the keypoints over which a level of the body is a mean.
_GROUPS = np.stack([
    np.isin(np.arange(N_KEYPOINTS), rows).astype(np.float64)
    for rows in (_FACE, _ANKLES, _SHOULDERS, _HIPS, _KNEES, _EARS, [Keypoint.NOSE])], axis=-1)
_ENDS = _GROUPS[:, :2].T
# Pairs whose distance apart is a feature.
_FIRST, _SECOND = np.transpose([_SHOULDERS, _HIPS, _EARS])


def usable(keypoints: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return (n, 18) which keypoints (n, 18, 3) are there and sure enough."""
    with np.errstate(invalid='ignore'):
        return np.isfinite(keypoints).all(axis=-1) & (keypoints[..., 2] >= LOWEST_SCORE)


def pixel_boxes(keypoints: NDArray[np.floating]) -> _Array:
    """
    Return the upright boxes from crown to soles as the paper's D1 to D4.

    :param keypoints: (n, 18, 3): u, v, score, of a camera that is held upright.
    :returns: (n, 4) in the order of PIXEL_FEATURES; NaN without a face or an ankle keypoint, and
        for who does not stand upright in the image.
    """
    known = usable(keypoints)
    u, v = np.moveaxis(keypoints[..., :2].astype(np.float64), -1, 0)
    face, ankles = _mean(v, known, _FACE), _mean(v, known, _ANKLES)
    span = np.where(ankles > face, ankles - face, np.nan)
    height = (1 + CROWN + SOLES) * span
    seen = np.where(known, u, np.nan)
    left, right = np.fmin.reduce(seen, axis=1), np.fmax.reduce(seen, axis=1)
    boxes = np.stack([
        height, right - left + FLESH * height, (left + right) / 2,
        (face + ankles + (SOLES - CROWN) * span) / 2], axis=-1)
    return np.where(np.isfinite(height)[:, None], boxes, np.nan)


@dataclass(frozen=True, eq=False)
class AngleBoxes:
    """
    Boxes as cameras turned to n people's middles see them, in radians; NaN where there is none.

    :ivar features: (n, 11) in the order of ANGLE_FEATURES; MISSING where unknown.
    :ivar height: (n,) from crown to soles on the plane at distance 1 round the middle.
    :ivar down: (n, 3) direction from face to ankles, unit vectors in the camera optical frame.
    :ivar neck: (n, 3) unit view rays of where a neck is in the box.
    """

    features: _Array
    height: _Array
    down: _Array
    neck: _Array


def angle_boxes(
    plane: _Array, known: NDArray[np.bool_], *, gravity: _Array, placement: Placement,
    children: NDArray[np.bool_],
) -> AngleBoxes:
    """
    Return the boxes along the line from face to ankles, which may lie in the image as it likes.

    Turning the camera on the spot or rolling it changes nothing here; only `elevation_rad` asks
    where down is. Where the network marks keypoints otherwise than the training bodies, that is
    undone first.

    :param plane: (n, 18, 2) undistorted keypoints on the plane z = 1.
    :param known: (n, 18) which of them are there.
    :param gravity: (n, 3) or (1, 3) unit vectors down in the camera optical frame; NaN for none.
    :param placement: the network's.
    :param children: (n,) or (1,) whether there may be children.
    """
    known = known & np.isfinite(plane).all(axis=-1)
    rays = np.zeros((*known.shape, 3))
    rays[known, :2], rays[known, 2] = plane[known], 1.0
    with np.errstate(invalid='ignore', divide='ignore'):
        rays = unit_or_zero(rays)
        top, bottom = np.moveaxis(unit(_ENDS @ rays), 1, 0)
        middle = unit(top + bottom)
        step = bottom - top
        down = unit(step - (step * middle).sum(axis=-1, keepdims=True) * middle)
        turned = rays @ np.stack([cross(down, middle), down, middle], axis=-1)
        ahead = np.where(known & (turned[..., 2] > 0), turned[..., 2], np.nan)
        shape, height, face = _shape(turned[..., 0] / ahead, turned[..., 1] / ahead, placement)
        elevation = np.arcsin(np.clip((middle * gravity).sum(axis=-1), -1, 1))
        neck_level = face + _NECK_LEVEL / (1 + CROWN + SOLES) * height
        features = np.stack([
            shape[0], height, elevation, *shape[1:],
            np.broadcast_to(np.where(children, 1.0, 0.0), face.shape)], axis=-1)
        features[~np.isfinite(features)] = MISSING
        return AngleBoxes(
            features=features, height=height, down=down,
            neck=unit(middle + neck_level[:, None] * down))


def _shape(x: _Array, y: _Array, placement: Placement) -> tuple[list[_Array], _Array, _Array]:
    """Return the features that are free of scale, the height, and where the face is marked."""
    known = np.isfinite(x)
    levels = (np.where(known, y, 0.0) @ _GROUPS) / (known @ _GROUPS)
    face, ankles, shoulders, hips, knees, ears, nose = levels.T
    marked_face = face
    torso = (hips - shoulders) / (1 + placement.hip_drop - placement.shoulder_drop)
    torso = np.where(np.isfinite(torso), torso, _TORSO * (ankles - face))
    shank = np.where(np.isfinite(knees), ankles - knees, _SHANK * (ankles - face))
    face = face - placement.face_drop * torso
    ankles = ankles - placement.ankle_drop / (1 + placement.ankle_drop) * shank
    height = (1 + CROWN + SOLES) * (ankles - face)
    apart = np.hypot(x[:, _FIRST] - x[:, _SECOND], y[:, _FIRST] - y[:, _SECOND]).T
    face_scale = np.exp(-placement.face_size)
    return [
        np.log((np.fmax.reduce(x, axis=1) - np.fmin.reduce(x, axis=1)) / height + FLESH),
        (shoulders - placement.shoulder_drop * torso - face) / height,
        (hips - placement.hip_drop * torso - face) / height,
        (knees - face) / height,
        (nose - ears) * face_scale / height,
        apart[0] * np.exp(-placement.shoulder_width) / height,
        apart[1] * np.exp(-placement.hip_width) / height,
        apart[2] * face_scale / height,
    ], height, marked_face


def _mean(values: _Array, known: NDArray[np.bool_], rows: Sequence[int]) -> _Array:
    """Return the mean (n,) over those of the rows that are known; NaN where none is."""
    there = known[:, rows]
    with np.errstate(invalid='ignore', divide='ignore'):
        return np.where(there, values[:, rows], 0.0).sum(axis=1) / there.sum(axis=1)
