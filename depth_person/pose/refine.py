"""A network for one person, run on crops around all people at once."""
from __future__ import annotations

from pathlib import Path
import time

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.pose import decode
from depth_person.pose.movenet import INPUT, read_interface, STRIDE
from depth_person.pose.runtime import open_session
from depth_person.pose.skeleton import from_coco17

#: Where MoveNet marks keypoints on crops: bodies are larger there than in whole frames.
CONVENTION = 'movenet_crops'
#: By how much MoveNet marks too far up and left, in pixels of the crop: half of what is between
#: a crop's keypoints and those of its mirror image. By the side of the input.
_LEAN = {192: 0.2, 256: 0.0}
#: The frame is halved, by averaging, until no crop shrinks by more than this.
_MOST_SHRINKING = 2.0


class Refiner:
    """
    Marks the keypoints of people whose whereabouts are known.

    :ivar inference_s: seconds that the network took for the last crops.
    :ivar side: of the network's square input, pixels.
    """

    def __init__(self, path: Path, *, threads: int = 0, provider: str = 'cpu') -> None:
        """
        Open the network.

        :param path: an ONNX file of a MoveNet for one person.
        :raises DepthPersonError: when it is none.
        """
        self._session = open_session(path, threads=threads, provider=provider)
        side, self._heads = read_interface(self._session, path)
        if side is None:
            raise DepthPersonError(
                f'{path} is the network for many people, refiner takes one for one person: '
                'movenet-lightning or movenet-thunder')
        self.side = side
        self.inference_s = 0.0
        self._lean = np.float32(_LEAN.get(side, 0.0))
        self._crops = np.empty((0, side, side, 3), np.uint8)
        self._halves: list[NDArray[np.uint8]] = []

    def __call__(
        self, image: NDArray[np.uint8], centres: NDArray[np.float32],
        sides: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """
        Return one person for each crop.

        :param image: (height, width, 3) BGR.
        :param centres: (n, 2) of the square crops, raw pixels.
        :param sides: (n,) of the crops, raw pixels; they may reach beyond the image.
        :returns: (n, 18, 3) u, v in raw pixels, score; none is missing.
        """
        self.inference_s = 0.0
        if not len(centres):
            return from_coco17(np.empty((0, decode.N_COCO17, 3), np.float32))
        crops = self._cut(image, centres, sides)
        start = time.perf_counter()
        heads = self._session.run(self._heads, {INPUT: crops})
        self.inference_s = time.perf_counter() - start
        keypoints = decode.decode_crops(*heads)
        in_crop = keypoints[..., :2] * STRIDE + (self._lean - np.float32(self.side / 2))
        scale = (sides / np.float32(self.side))[:, None, None]
        keypoints[..., :2] = in_crop * scale + centres[:, None]
        return from_coco17(keypoints)

    def _cut(
        self, image: NDArray[np.uint8], centres: NDArray[np.float32],
        sides: NDArray[np.float32],
    ) -> NDArray[np.uint8]:
        """Return (n, side, side, 3) RGB crops, valid until the next call."""
        if len(self._crops) < len(centres):
            self._crops = np.empty((len(centres), self.side, self.side, 3), np.uint8)
        crops = self._crops[:len(centres)]
        halvings = np.ceil(np.log2(np.maximum(sides / (self.side * _MOST_SHRINKING), 1)))
        sources = self._halved(image, int(halvings.max()))
        for crop, centre, side, times in zip(crops, centres, sides, halvings, strict=True):
            source = sources[int(times)]
            cv2.warpAffine(
                source, self._from_crop(centre, side, source, image), (self.side, self.side),
                dst=crop, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
            cv2.cvtColor(crop, cv2.COLOR_BGR2RGB, dst=crop)
        return crops

    def _halved(self, image: NDArray[np.uint8], times: int) -> list[NDArray[np.uint8]]:
        """Return an image, and it halved once, twice and so on, in buffers that are kept."""
        sources = [image]
        for index in range(times):
            height, width = (max(length // 2, 1) for length in sources[-1].shape[:2])
            if index == len(self._halves) or self._halves[index].shape[:2] != (height, width):
                self._halves[index:] = [np.empty((height, width, 3), np.uint8)]
            sources.append(self._halves[index])
            cv2.resize(
                sources[-2], (width, height), dst=sources[-1], interpolation=cv2.INTER_AREA)
        return sources

    def _from_crop(
        self, centre: NDArray[np.float32], side: np.float32, source: NDArray[np.uint8],
        image: NDArray[np.uint8],
    ) -> NDArray[np.float64]:
        """Return the matrix (2, 3) from pixels of the crop to those of the source."""
        smaller = np.array(source.shape[1::-1]) / image.shape[1::-1]
        scale = smaller * (side / self.side)
        middle = (centre.astype(np.float64) + 0.5) * smaller - 0.5
        corner = middle - scale * (self.side - 1) / 2
        return np.array([[scale[0], 0.0, corner[0]], [0.0, scale[1], corner[1]]])
