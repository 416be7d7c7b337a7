"""Where an evaluation's keypoints come from: a network, the truth, or a recording."""
from __future__ import annotations

from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.frame import Frame
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People
from depth_person.pose.skeleton import from_coco17, Keypoint
from depth_person.replay.dataset import TrueFrame, TruePerson
from depth_person.replay.matching import match_people

#: What --hidden takes, and the flags of the keypoints that each leaves out beside those outside
#: the image.
HIDDEN = {
    'none': ('self_occluded', 'occluded', 'occluded_by_person'),
    'own-body': ('occluded', 'occluded_by_person'),
    'all': (),
}
_FACE_ROWS = slice(0, 5)


class KeypointSource(Protocol):
    """Gives the people of frame after frame."""

    def start_clip(self) -> None:
        """Forget the frames before: the next belongs to another still or sequence."""
        ...

    def people(self, frame: TrueFrame) -> People:
        """Return the people of a frame; DepthPersonError when it cannot be used."""
        ...

    def match(self, frame: TrueFrame, people: People) -> NDArray[np.intp]:
        """Return for each true person the row of people that it is; -1 for none."""
        ...


class PoseStage(Protocol):
    """What is used of depth_person.pose.pipeline.PoseEstimator."""

    def estimate(self, frame: Frame) -> People:
        """Return the people of a frame."""
        ...


class NetworkKeypoints:
    """
    Keypoints that a pose network marks in the images.

    Each still or sequence is stamped an hour after the one before, so that no track goes on.
    """

    def __init__(self, pose_stage: PoseStage) -> None:
        self._pose_stage = pose_stage
        self._start_s = 0.0

    def start_clip(self) -> None:
        """Let an hour pass."""
        self._start_s += 3600.0

    def people(self, frame: TrueFrame) -> People:
        """Return the people that the network finds in the image."""
        if frame.image is None:
            raise DepthPersonError(
                'has recorded keypoints and no image; use --keypoints recorded')
        image = cv2.imread(str(frame.image), cv2.IMREAD_COLOR)
        if image is None:
            raise DepthPersonError('is not an image that OpenCV can read')
        if not frame.intrinsics.fits(image):
            height, width = image.shape[:2]
            raise DepthPersonError(
                f'is {width}x{height} px, but its intrinsics are for '
                f'{frame.intrinsics.width}x{frame.intrinsics.height}')
        stamp_ns = round((self._start_s + (frame.time_s or 0.0)) * 1e9)
        return self._pose_stage.estimate(Frame(image, stamp_ns, 'camera', frame.intrinsics))

    def match(self, frame: TrueFrame, people: People) -> NDArray[np.intp]:
        """Return the people that overlap the true ones."""
        return match_people(frame.people, people)


class _KnownKeypoints:
    """Keypoints whose owners are known: a track id is the place among the frame's people."""

    def start_clip(self) -> None:
        """Do nothing: the frames are independent."""

    def match(self, frame: TrueFrame, people: People) -> NDArray[np.intp]:
        """Return the people as they were numbered."""
        matches = np.full(len(frame.people), -1, np.intp)
        matches[people.track_ids] = np.arange(len(people))
        return matches


class RecordedKeypoints(_KnownKeypoints):
    """Keypoints that some network marked once, kept with the data set."""

    def people(self, frame: TrueFrame) -> People:
        """Return the recorded people; a keypoint of score 0 is missing."""
        recorded = [person.recorded for person in frame.people]
        if any(keypoints is None for keypoints in recorded):
            raise DepthPersonError('has no keypoints_detected; use another --keypoints')
        keypoints = np.array(recorded, np.float64).reshape(-1, 17, 3)
        keypoints[keypoints[..., 2] <= 0] = np.nan
        return _numbered(from_coco17(keypoints), convention='pifpaf')


class TrueKeypoints(_KnownKeypoints):
    """
    The true keypoints, as a faultless network would mark them, with noise.

    Networks mark joints that the person's own body hides (the far shoulder of someone seen from
    the side), but not what objects or other people hide, and no nose or eyes through a head.
    That is `own-body`, the default; `none` leaves out all that is hidden, `all` leaves out
    nothing that is inside the image. Data without keypoints_flag cannot tell why a keypoint is
    hidden: `own-body` is then the same as `none`. Every score is 1.

    :param noise_px: standard deviation added to u and to v.
    :param hidden: which hidden keypoints are marked, a key of HIDDEN.
    :param measure_neck: mark the neck itself, where neck_px is given.
    :param seed: of the noise.
    """

    def __init__(
        self, *, noise_px: float = 0.0, hidden: str = 'own-body', measure_neck: bool = False,
        seed: int = 0,
    ) -> None:
        self._noise_px = noise_px
        self._hidden = hidden
        self._measure_neck = measure_neck
        self._random = np.random.default_rng(seed)

    def people(self, frame: TrueFrame) -> People:
        """Return every person of the frame who has a keypoint to be seen."""
        if any(person.keypoints is None for person in frame.people):
            raise DepthPersonError('has no keypoints_px; use another --keypoints')
        marked = [self._marked(person) for person in frame.people]
        keypoints = from_coco17(np.array(marked).reshape(-1, 17, 3))
        necks = [person.neck for person in frame.people]
        measured = self._measure_neck and all(neck is not None for neck in necks)
        if measured and necks:
            seen = np.isfinite(keypoints[:, Keypoint.NECK])
            true_neck = np.insert(self._shaken(np.array(necks, np.float64)), 2, 1.0, axis=1)
            keypoints[:, Keypoint.NECK] = np.where(seen, true_neck, np.nan)
        return _numbered(keypoints, convention='mesh', neck_measured=measured)

    def _marked(self, person: TruePerson) -> NDArray[np.float64]:
        """Return one person's COCO-17 keypoints: u, v, 1, or all NaN."""
        assert person.keypoints is not None
        visibility = person.keypoints[:, 2]
        if person.flags is None or self._hidden == 'none':
            seen = visibility >= (1 if self._hidden == 'all' else 2)
        else:
            seen = (visibility > 0) & ~np.isin(person.flags, HIDDEN[self._hidden])
            if self._hidden == 'own-body':
                seen[_FACE_ROWS] &= visibility[_FACE_ROWS] == 2
        pixels = self._shaken(person.keypoints[:, :2])
        return np.where(seen[:, None], np.insert(pixels, 2, 1.0, axis=1), np.nan)

    def _shaken(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        return pixels + self._random.normal(0.0, self._noise_px, pixels.shape)


def _numbered(
    keypoints: NDArray[np.float32], *, convention: str, neck_measured: bool = False,
) -> People:
    """Return those of the people who have any keypoint, with their places as track ids."""
    places = np.flatnonzero(np.isfinite(keypoints).any(axis=(1, 2)))
    return People(keypoints[places], places.astype(np.int32), neck_measured, convention)
