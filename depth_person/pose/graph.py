"""A network that takes images, whatever it gives."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
import onnxruntime

from depth_person.errors import DepthPersonError
from depth_person.pose.runtime import open_session


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
            remedy='the file may be damaged, or no ONNX network')
        self.inputs = tuple(map(_value, self._session.get_inputs()))
        self.outputs = tuple(map(_value, self._session.get_outputs()))
        self.inference_s = 0.0

    def __str__(self) -> str:
        inputs, outputs = ('; '.join(map(str, each)) for each in (self.inputs, self.outputs))
        return f'takes {inputs} and gives {outputs}'

    def restart(self) -> None:
        """Count inference_s from zero again."""
        self.inference_s = 0.0

    def run(self, tensor: NDArray[Any], outputs: Sequence[str]) -> list[NDArray[np.float32]]:
        """
        Return the named outputs for a tensor.

        :raises DepthPersonError: when the network cannot be run on it, or gives NaN or infinity.
        """
        start = time.perf_counter()
        try:
            results = self._session.run(list(outputs), {self.inputs[0].name: tensor})
        except Exception as error:  # its exceptions have no common base class but this
            raise DepthPersonError(
                f'{self.path} does not run on a tensor {tensor.shape} of {tensor.dtype}: '
                f'{error}') from error
        self.inference_s += time.perf_counter() - start
        floats = [np.asarray(result, np.float32) for result in results]
        for name, values in zip(outputs, floats, strict=True):
            if not np.isfinite(values).all():
                raise DepthPersonError(
                    f'the output {name} of {self.path} holds NaN or infinity; the network is '
                    'damaged, or fails at its precision')
        return floats


def _value(argument: onnxruntime.NodeArg) -> Value:
    shape = tuple(side if isinstance(side, int) else None for side in argument.shape)
    type_name = argument.type.removeprefix('tensor(').removesuffix(')')
    return Value(argument.name, shape, type_name)
