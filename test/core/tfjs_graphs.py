"""Small TensorFlow.js graph models, written as the real ones are."""
from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from depth_person.pose.store import Model, PACKAGE

CONVOLUTION = {
    'strides': [1, 1, 1, 1], 'dilations': [1, 1, 1, 1], 'padding': 'SAME',
    'data_format': 'NHWC'}
RESIZE = {'half_pixel_centers': True, 'align_corners': False}


def attribute(value: Any) -> dict[str, Any]:
    """Return a value in protobuf's JSON form."""
    if isinstance(value, list):
        items = [attribute(item) for item in value]
        if not items:
            return {'list': {}}
        kind, = items[0]
        return {'list': {kind: [item[kind] for item in items]}}
    if isinstance(value, bool):
        return {'b': value}
    if isinstance(value, int):
        return {'i': str(value)}
    if value.startswith('DT_'):
        return {'type': value}
    return {'s': base64.b64encode(value.encode()).decode()}


def node(name: str, op: str, inputs: Sequence[str] = (), **attributes: Any) -> dict[str, Any]:
    return {
        'name': name, 'op': op, 'input': list(inputs),
        'attr': {key: attribute(value) for key, value in attributes.items()}}


def image_nodes() -> list[dict[str, Any]]:
    """Return the nodes that make a float image named `cast`."""
    return [
        node('input', 'Placeholder'),
        node('cast', 'Cast', ['input'], SrcT='DT_INT32', DstT='DT_FLOAT')]


def write_graph(
    path: Path, nodes: Sequence[Mapping[str, Any]], weights: Mapping[str, Any],
) -> Path:
    """Write a graph model with float16 and int32 weights; return its JSON file."""
    entries, data = [], b''
    for name, values in weights.items():
        values = np.asarray(values)
        entry: dict[str, Any] = {'name': name, 'shape': list(values.shape)}
        if values.dtype.kind == 'f':
            entry |= {
                'dtype': 'float32',
                'quantization': {'dtype': 'float16', 'original_dtype': 'float32'}}
            data += values.astype('<f2').tobytes()
        else:
            entry |= {'dtype': 'int32'}
            data += values.astype('<i4').tobytes()
        entries.append(entry)
    constants = [node(name, 'Const') for name in weights]
    binary = path.with_suffix('.bin')
    binary.write_bytes(data)
    path.write_text(json.dumps({
        'format': 'graph-model',
        'modelTopology': {'node': [*constants, *nodes]},
        'weightsManifest': [{'paths': [binary.name], 'weights': entries}]}))
    return path


#: The heads of a MoveNet for many people: scope, channels.
_HEADS = {
    'center_0': 1, 'kpt_regress_0': 34, 'kpt_heatmap_0': 17, 'kpt_offset_0': 34,
    'box_scale_0': 2, 'box_offset_0': 2}


def write_tiny_movenet(package: Path, name: str) -> Model:
    """
    Write an npm package with one network that has a MoveNet's heads and two small layers.

    :returns: the model as the registry would hold it.
    """
    folder = package / 'models'
    folder.mkdir(parents=True)
    (package / 'LICENSE').write_text('MIT License of the package')
    nodes = [
        *image_nodes(),
        node('backbone/conv', '_FusedConv2D', ['cast', 'kernel', 'bias'],
             **{**CONVOLUTION, 'strides': [1, 4, 4, 1]}, fused_ops=['BiasAdd', 'Relu6'])]
    weights = {'kernel': np.full((3, 3, 3, 4), 0.01), 'bias': np.zeros(4)}
    for scope, channels in _HEADS.items():
        nodes.append(node(
            f'call/{scope}/conv', '_FusedConv2D',
            ['backbone/conv', f'{scope}/kernel', f'{scope}/bias'], **CONVOLUTION,
            fused_ops=['BiasAdd']))
        weights[f'{scope}/kernel'] = np.full((1, 1, 4, channels), 0.01)
        weights[f'{scope}/bias'] = np.zeros(channels)
        nodes.append(node(f'decoding/{scope}', 'Squeeze', [f'call/{scope}/conv']))
    graph = write_graph(folder / f'{name}.json', nodes, weights)
    files = (graph, graph.with_suffix('.bin'))
    return Model(
        name, {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files},
        side=None, source=f'npm package {PACKAGE}')
