"""A network that takes images, whatever it gives."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
import onnxruntime

from depth_person.errors import DepthPersonError
from depth_person.pose.runtime import check_finite, open_session

#: What the elements of an image may be: ONNX Runtime's names of types.
IMAGE_TYPES = {'float': np.float32, 'float16': np.float16, 'uint8': np.uint8}


@dataclass(frozen=True)
class Value:
    """
    An input or an output of a network.

    :ivar shape: None where a dimension may be anything.
    :ivar type_name: of its elements, such as float, float16 or uint8.
    """

    name: str
    shape: tuple[int | None, ...]
    type_name: str

    def __str__(self) -> str:
        sides = ', '.join('?' if side is None else str(side) for side in self.shape)
        return f'{self.name} ({sides}) {self.type_name}'


class Graph:
    """
    An open network that takes one image tensor.

    :ivar inputs: what it takes.
    :ivar outputs: what it gives.
    :ivar inference_s: seconds that it has run since `restart`.
    """

    def __init__(self, path: Path, *, threads: int = 0, provider: str = 'cpu') -> None:
        self.path = path
        self._session = open_session(
            path, threads=threads, provider=provider,
            remedy='the file may be damaged, no ONNX network (a Git LFS pointer?), or made for a '
            'newer ONNX Runtime')
        self.inputs = tuple(map(_value, self._session.get_inputs()))
        self.outputs = tuple(map(_value, self._session.get_outputs()))
        self.inference_s = 0.0

    def __str__(self) -> str:
        inputs, outputs = ('; '.join(map(str, each)) for each in (self.inputs, self.outputs))
        return f'takes {inputs} and gives {outputs}'

    def rehearse(self, *, side: int) -> None:
        """
        Run once on a black image, and learn what shapes the outputs really have.

        Exports leave sides open, or tell others than they give. And a network that does not run
        is refused before the first frame comes.

        :param side: of the image where the network takes any.
        :raises DepthPersonError: when it does not run, or takes no single image.
        """
        image = self.inputs[0]
        if image.shape[:1] not in ((None,), (1,)) and 3 in image.shape[1:]:
            raise DepthPersonError(
                f'{self.path} {self}: it takes {image.shape[0]} images at once; export it for '
                'one, or for any number')
        seen = self._rehearsed(1, side)
        self.outputs = tuple(
            replace(value, shape=(*value.shape[:1], *shape[1:]))
            for value, shape in zip(self.outputs, seen, strict=True)) if seen else self.outputs

    def rehearse_batch(self) -> None:
        """Learn whether several images may be given at once: some exports only say so."""
        image = self.inputs[0]
        if image.shape[:1] != (None,):
            return
        try:
            batched = all(shape[:1] == (2,) for shape in self._rehearsed(2, 1))
        except DepthPersonError:
            batched = False
        if not batched:
            self.inputs = (replace(image, shape=(1, *image.shape[1:])), *self.inputs[1:])

    def _rehearsed(self, batch: int, side: int) -> list[tuple[int, ...]]:
        """Return the shapes of the outputs for black images; none for what takes no images."""
        image = self.inputs[0]
        if (len(self.inputs) != 1 or len(image.shape) != 4 or image.type_name not in IMAGE_TYPES
                or 3 not in (image.shape[1], image.shape[3])):
            return []
        shape = batch, *(side if each is None else each for each in image.shape[1:])
        black = np.zeros(shape, IMAGE_TYPES[image.type_name])
        results = self._session.run(None, {image.name: black})
        return [np.shape(result) for result in results]

    def restart(self) -> None:
        """Count inference_s from zero again."""
        self.inference_s = 0.0

    def run(self, tensor: NDArray[Any], outputs: Sequence[str]) -> list[NDArray[np.float32]]:
        """
        Return the named outputs for a tensor.

        :raises DepthPersonError: when the network cannot be run on it, or gives NaN or infinity.
        """
        start = time.perf_counter()
        results = self._session.run(list(outputs), {self.inputs[0].name: tensor})
        self.inference_s += time.perf_counter() - start
        floats = [np.asarray(result, np.float32) for result in results]
        for name, values in zip(outputs, floats, strict=True):
            check_finite(values, output=name, network=self.path)
        return floats


def _value(argument: onnxruntime.NodeArg) -> Value:
    shape = tuple(side if isinstance(side, int) else None for side in argument.shape)
    type_name = argument.type.removeprefix('tensor(').removesuffix(')')
    return Value(argument.name, shape, type_name)
