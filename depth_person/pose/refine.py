"""A network for one person, run on crops around all people at once."""
from __future__ import annotations

from pathlib import Path
import time

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.pose.cutting import CropCutter
from depth_person.pose.decode import N_COCO17
from depth_person.pose.movenet import FITTED, INPUT, read_interface, STRIDE
from depth_person.pose.runtime import check_finite, open_session
from depth_person.pose.skeleton import from_coco17

#: Where MoveNet marks keypoints on crops: bodies are larger there than in whole frames.
CONVENTION = 'movenet_crops'
#: By how much MoveNet marks too far up and left, in pixels of the crop: half of what is between
#: a crop's keypoints and those of its mirror image. By the side of the input.
_LEAN = {192: 0.2, 256: 0.0}


class Refiner:
    """
    Marks the keypoints of people whose whereabouts are known.

    :ivar inference_s: seconds that the network took for the last crops.
    :ivar side: of the network's square input, pixels.
    """

    def __init__(
        self, path: Path, *, threads: int = 0, provider: str = 'cpu', threads_beside: int = 0,
    ) -> None:
        """
        Open the network.

        :param path: an ONNX file of a MoveNet for one person.
        :param threads_beside: while another network runs; 0 for as many as ever.
        :raises DepthPersonError: when it is none.
        """
        self._session = open_session(path, threads=threads, provider=provider)
        side, self._outputs = read_interface(self._session, path, keypoints=FITTED)
        if side is None:
            raise DepthPersonError(
                f'{path} is the network for many people, refiner takes one for one person: '
                'movenet-lightning or movenet-thunder')
        self._beside = open_session(
            path, threads=threads_beside, provider=provider) if threads_beside else self._session
        self.side = side
        self.inference_s = 0.0
        self._lean = np.float32(_LEAN.get(side, 0.0))
        self._cutter = CropCutter(side)

    def __call__(
        self, image: NDArray[np.uint8], centres: NDArray[np.float32],
        sides: NDArray[np.float32], *, beside: bool = False,
    ) -> NDArray[np.float32]:
        """
        Return one person for each crop.

        :param image: (height, width, 3) BGR.
        :param centres: (n, 2) of the square crops, raw pixels.
        :param sides: (n,) of the crops, raw pixels; they may reach beyond the image.
        :param beside: whether another network runs meanwhile.
        :returns: (n, 18, 3) u, v in raw pixels, score; none is missing.
        """
        self.inference_s = 0.0
        if not len(centres):
            return from_coco17(np.empty((0, N_COCO17, 3), np.float32))
        crops = self._cutter.cut(image, centres, sides)
        start = time.perf_counter()
        session = self._beside if beside else self._session
        keypoints, = session.run(self._outputs, {INPUT: crops.images})
        self.inference_s = time.perf_counter() - start
        check_finite(keypoints, output=FITTED, network=self._session.name)
        in_crop = keypoints[..., :2] * STRIDE + (self._lean - np.float32(self.side / 2))
        scale = (crops.sides / np.float32(self.side))[:, None, None]
        keypoints[..., :2] = in_crop * scale + crops.centres[:, None]
        return from_coco17(keypoints)
