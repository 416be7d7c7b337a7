"""Images as networks take them: warped to their size, laid out and scaled as they were trained."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError
from depth_person.pose.graph import Graph, IMAGE_TYPES
from depth_person.pose.warps import fitted_size, letterbox_matrix, Matrix

#: Sides of an input that may have any size are multiples of this, the largest stride in use.
_SIDE_STEP = 32

#: Names of what networks make of a byte: (byte - mean) / std, mean and std in the order R, G, B.
PIXEL_VALUES: Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    'bytes': ((0.0,), (1.0,)),
    'unit': ((0.0,), (255.0,)),
    'centred': ((128.0,), (256.0,)),
    'imagenet': ((123.675, 116.28, 103.53), (58.395, 57.12, 57.375)),
}
PIXEL_ORDERS = ('rgb', 'bgr')
AUTO = 'auto'


@dataclass(frozen=True)
class Pixels:
    """
    How a network takes pixels.

    :ivar order: one of PIXEL_ORDERS.
    :ivar values: a name of PIXEL_VALUES.
    """

    order: str
    values: str

    def told(self, *, order: str, values: str) -> Pixels:
        """Return them with what the user says of them; AUTO leaves a part as it is."""
        return Pixels(
            self.order if order == AUTO else order, self.values if values == AUTO else values)


class ImageTensor:
    """
    The input of a network, filled from images.

    :ivar size: width and height of the images, None where the network takes any.
    :ivar batched: whether several images may be given at once.
    """

    def __init__(self, graph: Graph, pixels: Pixels, *, border: int = 0) -> None:
        """
        Read how a network takes images.

        :param border: of 0 to 255, around an image that does not fill the tensor.
        :raises DepthPersonError: when it takes no images.
        """
        value = graph.inputs[0]
        shape = value.shape
        self._channels_first = len(shape) == 4 and shape[1] == 3
        channels_last = len(shape) == 4 and shape[3] == 3
        if (len(graph.inputs) != 1 or value.type_name not in IMAGE_TYPES
                or self._channels_first == channels_last):
            raise DepthPersonError(
                f'{graph.path} {graph}: it should take one image, (n, 3, height, width) or '
                '(n, height, width, 3), of float, float16 or uint8')
        height, width = shape[2:] if self._channels_first else shape[1:3]
        self.size = None if width is None or height is None else (width, height)
        self.batched = shape[0] is None
        self._type = IMAGE_TYPES[value.type_name]
        self._border = (border,) * 3
        self._step = 1 if pixels.order == 'bgr' else -1
        # Integers are taken as they are: such a network scales them itself.
        values = 'bytes' if self._type is np.uint8 else pixels.values
        mean, std = (np.array(each, np.float32) for each in PIXEL_VALUES[values])
        self._scale = (1 / std)[::-self._step]
        self._shift = (-mean / std)[::-self._step]

    def fit(
        self, image: NDArray[np.uint8], long_side: int,
    ) -> tuple[NDArray[np.generic], Matrix, tuple[int, int]]:
        """
        Return the tensor of a whole image, which lies in the upper left.

        :param image: (height, width, 3) BGR.
        :param long_side: of the image in the tensor where the network takes any size.
        :returns: the tensor, the matrix (1, 2, 3) from raw pixels to its own, and its width and
            height.
        """
        raw_size = image.shape[1], image.shape[0]
        size = self.size or fitted_size(raw_size, long_side, step=_SIDE_STEP)
        matrix = letterbox_matrix(raw_size, size)[None]
        return self.fill(image, matrix, size), matrix, size

    def fill(
        self, image: NDArray[np.uint8], matrices: Matrix, size: tuple[int, int],
    ) -> NDArray[np.generic]:
        """
        Return the tensor of an image, warped once for each matrix.

        :param image: (height, width, 3) BGR.
        :param matrices: (n, 2, 3) from raw pixels to those of the tensor, centres at integers.
        :param size: width and height of the tensor's images.
        """
        width, height = size
        crops = np.empty((len(matrices), height, width, 3), np.uint8)
        for crop, matrix in zip(crops, matrices, strict=True):
            cv2.warpAffine(image, matrix, size, dst=crop, borderValue=self._border)
        crops = crops[..., ::self._step]
        if self._type is not np.uint8:
            scaled = np.multiply(crops, self._scale, dtype=np.float32)
            if self._shift.any():
                scaled += self._shift
            crops = scaled.astype(self._type, copy=False)
        if self._channels_first:
            crops = crops.transpose(0, 3, 1, 2)
        return np.ascontiguousarray(crops)


def check_image(image: NDArray[np.uint8]) -> None:
    """Raise DepthPersonError unless an image is (height, width, 3) bytes with pixels in it."""
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
        raise DepthPersonError(
            f'an image of shape {image.shape} and type {image.dtype} is no (height, width, 3) '
            'uint8 with at least one pixel')
