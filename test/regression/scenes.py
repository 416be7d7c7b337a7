"""Cuts the scenes of the regression bags out of the walking sequence."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
import json
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.intrinsics import Intrinsics

#: The people of the sequence by what they do.
AWAY, ACROSS, TURNING = range(3)
#: Round a person, pixels; shadows stay.
MARGIN = 14
#: One in so many frames tells what is behind the people.
EVERY = 3


@dataclass(frozen=True, eq=False)
class Shot:
    """
    One frame of a scene.

    :ivar necks: (x, y, z) in the camera optical frame by person, metres.
    """

    image: NDArray[np.uint8]
    intrinsics: Intrinsics
    time_s: float
    necks: dict[int, tuple[float, float, float]]


class Sequence:
    """The walking sequence, of which people can be left out: the camera stands still."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._records = [
            json.loads(path.read_text()) for path in sorted((folder / 'gt').glob('*.json'))]
        self.background = self._background()

    def __len__(self) -> int:
        return len(self._records)

    def shots(self, frames: Iterable[int], *, people: Iterable[int]) -> list[Shot]:
        """Return these frames with nobody in them but these people."""
        return [self._shot(index, frozenset(people)) for index in frames]

    def _shot(self, index: int, kept: frozenset[int]) -> Shot:
        record = self._records[index]
        image = self._image(index)
        for person in record['persons']:
            if person['id'] not in kept:
                self._remove(image, person)
        k = record['K']
        intrinsics = Intrinsics(
            record['width'], record['height'], k['fx'], k['fy'], k['cx'], k['cy'])
        return Shot(image, intrinsics, record['time_s'], {
            person['id']: tuple(person['neck_cam_m']) for person in record['persons']
            if person['id'] in kept})

    def _image(self, index: int) -> NDArray[np.uint8]:
        return cv2.imread(str(self._folder / self._records[index]['image']))

    def _remove(self, image: NDArray[np.uint8], person: dict) -> None:
        place = _surroundings(person['bbox_full'], image.shape)
        image[place] = self.background[place]

    def _background(self) -> NDArray[np.uint8]:
        """Return the place without people; where one always stands, it is painted over."""
        records = self._records[::EVERY]
        seen = np.stack([self._image(index) for index in range(0, len(self), EVERY)])
        seen = seen.astype(np.float32)
        for image, record in zip(seen, records, strict=True):
            for person in record['persons']:
                image[_surroundings(person['bbox_full'], image.shape)] = np.nan
        hidden = np.isnan(seen).all(axis=0)
        seen[:, hidden] = 0
        background = np.nanmedian(seen, axis=0).astype(np.uint8)
        return cv2.inpaint(background, hidden[..., 0].astype(np.uint8), 5, cv2.INPAINT_TELEA)


def _surroundings(box: list[float], shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns of a person."""
    low = np.floor(np.maximum((box[0] - MARGIN, box[1] - MARGIN), 0)).astype(int)
    high = np.ceil((box[2] + MARGIN, box[3] + MARGIN)).astype(int)
    return slice(low[1], min(high[1], shape[0])), slice(low[0], min(high[0], shape[1]))


def behind_wall(shot: Shot, *, top: int) -> Shot:
    """Return the shot with a grey wall in front of everything below a row."""
    image = shot.image.copy()
    height, width = image.shape[:2]
    grain = np.random.default_rng(1).normal(150, 5, (height - top, width, 1))
    image[top:] = cv2.blur(np.clip(grain, 0, 255).astype(np.uint8), (5, 5))[..., None]
    image[top:top + 6] = 110  # its edge
    return replace(shot, image=image)


def cropped(shot: Shot, *, left: int, top: int) -> Shot:
    """Return the quarter of the shot, half as wide and high, that begins at this pixel."""
    height, width = shot.image.shape[0] // 2, shot.image.shape[1] // 2
    return replace(
        shot, image=shot.image[top:top + height, left:left + width],
        intrinsics=replace(
            shot.intrinsics, width=width, height=height, cx=shot.intrinsics.cx - left,
            cy=shot.intrinsics.cy - top))


def resized(shot: Shot, *, width: int) -> Shot:
    """Return the shot as a camera of a lower resolution takes it."""
    height = round(shot.intrinsics.height * width / shot.intrinsics.width)
    return replace(
        shot, image=cv2.resize(shot.image, (width, height), interpolation=cv2.INTER_AREA),
        intrinsics=shot.intrinsics.scaled(width=width, height=height))


def through_lens(shot: Shot, *, distortion: tuple[float, ...]) -> Shot:
    """Return the shot as a lens of this plumb_bob distortion shows it; black beyond its edges."""
    lens = replace(shot.intrinsics, distortion=distortion)
    grid = np.stack(np.meshgrid(np.arange(lens.width), np.arange(lens.height)), axis=-1)
    rays = lens.undistort(grid.astype(np.float64))
    places = rays * (shot.intrinsics.fx, shot.intrinsics.fy) + (
        shot.intrinsics.cx, shot.intrinsics.cy)
    image = cv2.remap(
        shot.image, np.nan_to_num(places, nan=-1.0).astype(np.float32), None, cv2.INTER_LINEAR)
    return replace(shot, image=image, intrinsics=lens)
