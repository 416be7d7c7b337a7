"""Writes networks in another precision; needs the onnx package, which running them does not."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import logging
from pathlib import Path
import tempfile

import cv2
import numpy as np
from numpy.typing import NDArray

from depth_person.camera.folder import IMAGE_SUFFIXES
from depth_person.errors import DepthPersonError
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import ImageTensor, Pixels

try:
    import onnx
    from onnxruntime.quantization import CalibrationDataReader, quantize_static, QuantType
    from onnxruntime.transformers.float16 import convert_float_to_float16

    from depth_person.pose.movenet_keypoints import PREFIX
    from depth_person.pose.onnx_writer import with_scales
except ImportError as error:
    raise DepthPersonError(
        'converting a model needs the onnx package: pip install onnx') from error

PRECISIONS = ('fp16', 'int8')
#: Images that a calibration looks at; more change little.
_MOST_IMAGES = 40
#: Longer side of the images for a network that takes any size.
_LONG_SIDE = 512


def convert_precision(
    source: Path, target: Path, *, precision: str, pixels: Pixels, images: Path | None = None,
) -> None:
    """
    Write a network with weights, and mostly arithmetic, of another precision.

    Inputs and outputs stay as they are, so the result is used as the network was. int8 is static
    quantization by channel: what ranges the activations have is seen on images.

    :param source: an ONNX file.
    :param target: the ONNX file to write.
    :param precision: of PRECISIONS.
    :param pixels: how the network takes images.
    :param images: a folder, as int8 needs it: frames like those that the network will see.
    :raises DepthPersonError: when the network cannot be converted, or there are no images.
    """
    Graph(source)  # raises when it is none
    if target.suffix != '.onnx':
        raise DepthPersonError(f'{target} should end in .onnx')
    if precision == 'int8' and images is None:
        raise DepthPersonError('int8 needs images to calibrate on: --calibrate FOLDER')
    try:
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            made = Path(folder) / 'made.onnx'
            with _faults_told(source, precision):
                if images is not None and precision == 'int8':
                    _quantize(source, made, Calibration(source, images, pixels))
                else:
                    _halve(source, made)
                _rehearse(made)
            made.replace(target)
    except OSError as error:
        raise DepthPersonError(f'cannot write {target}: {error}') from error


@contextmanager
def _faults_told(source: Path, precision: str) -> Iterator[None]:
    """Turn what the converters raise into one message; it has no common base class."""
    try:
        yield
    except (OSError, DepthPersonError):
        raise
    except Exception as error:
        raise DepthPersonError(
            f'{source} cannot be converted to {precision}; it may be of a lower precision '
            f'already, or of an old opset ({error})') from error


def _rehearse(made: Path) -> None:
    try:
        Graph(made).rehearse(side=_LONG_SIDE)
    except DepthPersonError as error:
        raise RuntimeError(str(error)) from error


def _halve(source: Path, target: Path) -> None:
    model = onnx.load(source)
    empty = {value.name for value in model.graph.initializer if 0 in value.dims}
    for node in model.graph.node:
        if node.op_type == 'Resize':
            # An empty tensor stands for what is not given; once it is cast, nobody sees that.
            node.input[:] = ['' if name in empty else name for name in node.input]
    onnx.save(convert_float_to_float16(model, keep_io_types=True), target)


def _quantize(source: Path, target: Path, calibration: Calibration) -> None:
    resized = target.with_suffix('.resized.onnx')
    model = with_scales(onnx.load(source))
    # These count cells, for which half precision is just enough, and bytes are not.
    exact = [node.name for node in model.graph.node if node.name.startswith(PREFIX)]
    onnx.save(model, resized)
    logger = logging.getLogger()  # where the quantizer writes hints for developers
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        quantize_static(
            resized, target, calibration, per_channel=True, activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8, nodes_to_exclude=exact)
    finally:
        logger.setLevel(level)


class Calibration(CalibrationDataReader):
    """Gives a network the images of a folder, evenly chosen, one by one."""

    def __init__(self, network: Path, folder: Path, pixels: Pixels) -> None:
        """Read what the network takes; raise DepthPersonError when there are no images."""
        paths = sorted(path for path in folder.rglob('*') if path.suffix.lower() in IMAGE_SUFFIXES)
        if not paths:
            raise DepthPersonError(f'{folder} holds no images ({", ".join(IMAGE_SUFFIXES)})')
        graph = Graph(network)
        self._name = graph.inputs[0].name
        self._tensor = ImageTensor(graph, pixels)
        every = -(-len(paths) // _MOST_IMAGES)
        self._tensors = self._filled(paths[::every])

    def get_next(self) -> dict[str, NDArray[np.generic]] | None:
        """Return the next input; None after the last."""
        return next(self._tensors, None)

    def _filled(self, paths: Sequence[Path]) -> Iterator[dict[str, NDArray[np.generic]]]:
        for path in paths:
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
            if image is None:
                raise DepthPersonError(f'{path} is not an image that OpenCV can read')
            tensor, _, _ = self._tensor.fit(image, _LONG_SIDE)
            yield {self._name: tensor}
