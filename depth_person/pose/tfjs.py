"""Reads TensorFlow.js graph models: a JSON file with the graph, .bin files with the weights."""
from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depth_person.errors import DepthPersonError

_DTYPES = {'float32': np.float32, 'int32': np.int32, 'float16': np.float16}


@dataclass(frozen=True, eq=False)
class Node:
    """
    One operation of a graph.

    :ivar inputs: names of the nodes it reads, each its first output, without control edges.
    :ivar attributes: plain values: str, int, float, bool and lists of them.
    """

    name: str
    op: str
    inputs: tuple[str, ...]
    attributes: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class GraphModel:
    """
    A graph and its weights.

    :ivar nodes: by name, all that compute.
    :ivar weights: by name, the constants; float16 ones are widened to float32.
    """

    nodes: Mapping[str, Node]
    weights: Mapping[str, NDArray[Any]]

    def scope_end(self, scope: str) -> str:
        """
        Return the name of the node through which the rest of the graph reads a scope.

        :raises DepthPersonError: when it is not exactly one.
        """
        prefix, middle = f'{scope}/', f'/{scope}/'
        inside = {name for name in self.nodes if name.startswith(prefix) or middle in name}
        read_inside = {name for inner in inside for name in self.nodes[inner].inputs}
        ends = inside - read_inside
        if len(ends) != 1:
            raise DepthPersonError(
                f'the graph has {len(ends)} outputs named {scope}, not one; '
                'this is not a MoveNet that depth_person knows')
        return ends.pop()


def read_graph_model(path: Path) -> GraphModel:
    """
    Return the graph model of a JSON file and the weight files that it names beside it.

    :raises DepthPersonError: when a file is missing, is no graph model or is cut short.
    """
    try:
        document = json.loads(path.read_text(encoding='utf-8'))
        nodes = document['modelTopology']['node']
        weights = _read_weights(document['weightsManifest'], path.parent)
        graph = {raw['name']: _node(raw) for raw in nodes if raw['op'] != 'Const'}
    except OSError as error:
        raise DepthPersonError(f'cannot read the graph model: {error}') from error
    except (ValueError, KeyError, TypeError) as error:
        raise DepthPersonError(
            f'{path} is not a TensorFlow.js graph model ({error!r}); get it again') from error
    return GraphModel(graph, weights)


def _read_weights(manifest: list[dict[str, Any]], folder: Path) -> dict[str, NDArray[Any]]:
    weights: dict[str, NDArray[Any]] = {}
    for group in manifest:
        files = ', '.join(group['paths'])
        data = b''.join((folder / name).read_bytes() for name in group['paths'])
        offset = 0
        for entry in group['weights']:
            stored = np.dtype(_DTYPES[entry.get('quantization', entry)['dtype']])
            count = int(np.prod(entry['shape'], dtype=np.int64))
            end = offset + count * stored.itemsize
            if end > len(data):
                raise DepthPersonError(
                    f'{files} is cut short: {len(data)} bytes, and the graph needs more; '
                    'get the model again')
            values = np.frombuffer(data, stored, count, offset).reshape(entry['shape'])
            weights[entry['name']] = values.astype(_DTYPES[entry['dtype']])
            offset = end
        if offset != len(data):
            raise DepthPersonError(
                f'{files} has {len(data)} bytes where the graph needs {offset}; '
                'get the model again')
    return weights


def _node(raw: Mapping[str, Any]) -> Node:
    inputs = tuple(
        name.removesuffix(':0') for name in raw.get('input', ()) if not name.startswith('^'))
    attributes = {name: _plain(value) for name, value in raw.get('attr', {}).items()}
    return Node(raw['name'], raw['op'], inputs, attributes)


def _plain(value: Mapping[str, Any]) -> Any:
    """Return the Python value of an attribute in protobuf's JSON form."""
    (kind, content), = value.items()
    if kind == 'list':
        if not content:
            return []
        (kind, items), = content.items()
        return [_plain({kind: item}) for item in items]
    if kind == 's':
        return base64.b64decode(content).decode()
    if kind == 'i':
        return int(content)  # 64-bit integers are strings in protobuf's JSON
    return content
