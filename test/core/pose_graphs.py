"""
Small ONNX networks whose answers are known.

Some always give the same; the others see where three spots, one of each colour, lie in what they
are given, and answer by that.
"""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
import onnx
from onnx import helper, numpy_helper, TensorProto

Array = NDArray[np.float32]

#: Where the spots lie in the raw image (u, v), in the order of B, G, R.
SPOTS = np.array([[700.0, 260.0], [812.0, 300.0], [760.0, 410.0]])


def spotted(width: int = 1280, height: int = 720, spots: Array = SPOTS) -> NDArray[np.uint8]:
    """Return a black image with a round spot in each of its colours."""
    rows, columns = np.indices((height, width))
    planes = [255 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / 200) for u, v in spots]
    return np.stack(planes, 2).astype(np.uint8)


def constant(
    path: Path, outputs: Mapping[str, Array], *, shape: tuple[object, ...] = (1, 3, 256, 256),
    kind: int = TensorProto.FLOAT, inputs: int = 1,
) -> Path:
    """Write a network that always gives the same outputs."""
    nodes = [helper.make_node('Identity', [f'{name}_is'], [name]) for name in outputs]
    values = {f'{name}_is': value for name, value in outputs.items()}
    return _write(
        path, nodes, values, {name: value.shape for name, value in outputs.items()},
        shape=shape, kind=kind, inputs=inputs)


def rtmo_of_spots(path: Path, *, side: int = 640, threshold: float = 130.0) -> Path:
    """Write an RTMO that sees one person: keypoint k lies at the spot of channel k % 3."""
    nodes, values = _spots(side, side, channels_last=False, threshold=threshold)
    nodes += [
        helper.make_node('Gather', ['at', 'channel'], ['xy'], axis=1),
        helper.make_node('Concat', ['xy', 'sure'], ['flat'], axis=2),
        helper.make_node('Unsqueeze', ['flat', 'one'], ['keypoints']),
        helper.make_node('Identity', ['box'], ['dets'])]
    values |= {
        'channel': np.arange(17) % 3, 'sure': np.full((1, 17, 1), 0.9, np.float32),
        'one': np.array([1]), 'box': np.array([[[0, 0, side, side, 0.8]]], np.float32)}
    return _write(
        path, nodes, values, {'dets': (1, 1, 5), 'keypoints': (1, 1, 17, 3)},
        shape=(1, 3, side, side))


def simcc_of_spots(
    path: Path, *, batch: object = 'batch', keypoints: int = 17, threshold: float = 0.5,
) -> Path:
    """Write an RTMPose of 192x256 that marks keypoint k at the spot of channel k % 3."""
    nodes, values = _spots(256, 192, channels_last=False, threshold=threshold)
    nodes.append(helper.make_node('Gather', ['at', 'channel'], ['xy'], axis=1))
    values |= {
        'channel': np.arange(keypoints) % 3, 'two': np.float32([2]),
        'width': np.float32([-1 / 72]), 'end': np.int64([2])}
    for axis, (name, bins) in enumerate((('simcc_x', 384), ('simcc_y', 512))):
        values |= {f'{name}_bins': np.arange(bins, dtype=np.float32),
                   f'{name}_from': np.int64([axis]), f'{name}_to': np.int64([axis + 1])}
        nodes += [
            helper.make_node('Slice', ['xy', f'{name}_from', f'{name}_to', 'end'], [f'{name}_p']),
            helper.make_node('Mul', [f'{name}_p', 'two'], [f'{name}_b']),
            helper.make_node('Sub', [f'{name}_bins', f'{name}_b'], [f'{name}_d']),
            helper.make_node('Mul', [f'{name}_d', f'{name}_d'], [f'{name}_q']),
            helper.make_node('Mul', [f'{name}_q', 'width'], [f'{name}_w']),
            helper.make_node('Exp', [f'{name}_w'], [name])]
    return _write(
        path, nodes, values,
        {'simcc_x': (batch, keypoints, 384), 'simcc_y': (batch, keypoints, 512)},
        shape=(batch, 3, 256, 192))


def blazepose_of_spots(
    path: Path, *, present: float = 0.9, logit: float = 2.0, threshold: float = 0.5,
) -> Path:
    """
    Write a BlazePose that marks landmark k at the spot of channel k % 3.

    It counts from the outer corner of the first pixel, as the real one.
    """
    nodes, values = _spots(256, 256, channels_last=True, threshold=threshold)
    nodes += [
        helper.make_node('Add', ['at', 'half'], ['from_corner']),
        helper.make_node('Gather', ['from_corner', 'channel'], ['xy'], axis=1),
        helper.make_node('Concat', ['xy', 'rest'], ['figures'], axis=2),
        helper.make_node('Reshape', ['figures', 'row'], ['Identity']),
        helper.make_node('Identity', ['flag'], ['Identity_1'])]
    rest = np.tile(np.float32([0, logit, logit + 1]), (1, 39, 1))
    values |= {
        'channel': np.arange(39) % 3, 'rest': rest, 'row': np.int64([1, 195]),
        'flag': np.float32([[present]]), 'half': np.float32([0.5])}
    return _write(
        path, nodes, values, {'Identity': (1, 195), 'Identity_1': (1, 1)},
        shape=(1, 256, 256, 3))


def veiled(path: Path) -> Path:
    """Let a network tell the shapes of its outputs, but their rank, only when it runs."""
    model = onnx.load(path)
    graph = model.graph
    for node in graph.node:
        node.output[:] = [
            f'{name}_before' if name in {value.name for value in graph.output} else name
            for name in node.output]
    graph.initializer.append(numpy_helper.from_array(np.float32([0]), 'nought'))
    graph.node.extend([
        helper.make_node('ReduceMin', ['image'], ['darkest'], keepdims=0),
        helper.make_node('Mul', ['darkest', 'nought'], ['nothing_']),
        helper.make_node('Cast', ['nothing_'], ['nothing'], to=TensorProto.INT64)])
    for value in graph.output:
        sides = [side.dim_value for side in value.type.tensor_type.shape.dim]
        graph.initializer.append(
            numpy_helper.from_array(np.int64([0, *sides[1:]]), f'{value.name}_sides'))
        graph.node.extend([
            helper.make_node('Add', [f'{value.name}_sides', 'nothing'], [f'{value.name}_shape']),
            helper.make_node(
                'Reshape', [f'{value.name}_before', f'{value.name}_shape'], [value.name])])
        for axis, side in enumerate(value.type.tensor_type.shape.dim):
            side.dim_param = f'{value.name}_dim_{axis}'
    onnx.save(model, path)
    return path


def _spots(
    height: int, width: int, *, channels_last: bool, threshold: float,
) -> tuple[list[onnx.NodeProto], dict[str, NDArray[np.generic]]]:
    """Return nodes that give `at` (n, 3, 2): the centre of mass of what exceeds a threshold."""
    rows, columns = np.indices((height, width), np.float32).reshape(2, -1)
    values: dict[str, NDArray[np.generic]] = {
        'threshold': np.float32([threshold]), 'planes': np.int64([0, 3, -1]),
        'moments': np.stack([columns, rows, np.ones_like(rows)], 1),
        'zero_': np.int64([0]), 'two_': np.int64([2]), 'three_': np.int64([3])}
    image = 'image'
    nodes = []
    if channels_last:
        nodes.append(helper.make_node('Transpose', [image], ['first'], perm=[0, 3, 1, 2]))
        image = 'first'
    nodes += [
        helper.make_node('Sub', [image, 'threshold'], ['above']),
        helper.make_node('Relu', ['above'], ['light']),
        helper.make_node('Reshape', ['light', 'planes'], ['flat_light']),
        helper.make_node('MatMul', ['flat_light', 'moments'], ['sums']),
        helper.make_node('Slice', ['sums', 'zero_', 'two_', 'two_'], ['first_moments']),
        helper.make_node('Slice', ['sums', 'two_', 'three_', 'two_'], ['masses']),
        helper.make_node('Div', ['first_moments', 'masses'], ['at'])]
    return nodes, values


def _write(
    path: Path, nodes: list[onnx.NodeProto], values: Mapping[str, NDArray[np.generic]],
    outputs: Mapping[str, tuple[object, ...]], *, shape: tuple[object, ...],
    kind: int = TensorProto.FLOAT, inputs: int = 1,
) -> Path:
    names = ['image', *(f'other{index}' for index in range(1, inputs))]
    graph = helper.make_graph(
        nodes, 'known', [helper.make_tensor_value_info(name, kind, shape) for name in names],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, each)
         for name, each in outputs.items()],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in values.items()])
    onnx.save(helper.make_model(
        graph, opset_imports=[helper.make_opsetid('', 17)], ir_version=8), path)
    return path
