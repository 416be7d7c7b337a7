"""
Lets a MoveNet for one person give keypoints in place of heads, as the original graphs do.

Two of its four heads are searched. The others, regressed positions and offsets within cells, are
read at one cell and at one for each keypoint: their last layers, which only join the channels of
a cell, are worked out there and nowhere else. Needs the onnx package.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from onnx import helper, numpy_helper, shape_inference, TensorProto

from depth_person.pose.decode import N_COCO17
from depth_person.pose.movenet import FITTED, HEADS, MARKED

#: What the names of all nodes that are added begin with.
PREFIX = 'keypoints/'
#: The original graphs divide scores by the distance in cells plus this.
_SOFTENING = 1.7998047
#: Rows and columns of the cells around a peak, whose heat tells where it is: 5x5.
_RIM = 2
_STEPS = np.indices((2 * _RIM + 1,) * 2).reshape(2, -1).T - _RIM
_NO_HEAT = 1e-9


def with_keypoints(model: onnx.ModelProto, *, side: int) -> onnx.ModelProto:
    """
    Return a network that gives one person's keypoints where the given one has HEADS.

    The person is the one whose centre is the highest, over its distance from the middle of the
    image; their keypoints are where the heat is the highest, over the distance from where the
    centre regresses them. FITTED ones are the mean of two estimates whose errors differ: the
    highest cell with its offset, which alone is MARKED, and the centre of the heat around it.

    :param model: gives heads of (n, channels, side, side) cells, with scores from 0 to 1.
    :returns: gives MARKED and FITTED, (n, 17, 3) x, y, score, in cells from the outer corner of
        the first.
    """
    graph = _Graph(model, side)
    center, regression, heatmap, offset = HEADS
    regressed = graph.regressed(regression, graph.middle(center))
    cells = graph.highest(graph.add('Div', [heatmap, graph.distance(regressed)]))
    corner = graph.place(cells)
    marked = graph.add('Add', [corner, graph.offset(offset, cells)])
    heat = graph.heat(heatmap, cells)
    centre = graph.add('Add', [corner, graph.centre(heat)])
    fitted = graph.add('Mean', [marked, centre])
    graph.give(MARKED, marked, heat)
    graph.give(FITTED, fitted, heat)
    return graph.model((MARKED, FITTED))


class _Graph:
    """
    A model and the nodes that are added to it; values are named by strings.

    Cells are counted row after row.
    """

    def __init__(self, model: onnx.ModelProto, side: int) -> None:
        self._model = shape_inference.infer_shapes(model)
        self._graph = self._model.graph
        self._side = side
        self._cells = np.indices((side, side)).reshape(2, -1).T
        self._makers = {node.output[0]: node for node in self._graph.node}
        self._weights = {value.name: value for value in self._graph.initializer}
        self._channels = {
            value.name: value.type.tensor_type.shape.dim[1].dim_value
            for value in (*self._graph.input, *self._graph.value_info)
            if len(value.type.tensor_type.shape.dim) == 4}
        self._count = 0

    def add(
        self, op: str, inputs: Sequence[str], *, output: str = '', **attributes: Any,
    ) -> str:
        """Add a node; return what it gives."""
        self._count += 1
        name = f'{PREFIX}{self._count}_{op}'
        self._graph.node.append(
            helper.make_node(op, inputs, [output or name], name=name, **attributes))
        return output or name

    def constant(self, values: Any, dtype: type = np.int64) -> str:
        self._count += 1
        name = f'{PREFIX}{self._count}'
        self._weights[name] = numpy_helper.from_array(np.asarray(values, dtype), name)
        return name

    def middle(self, center: str) -> str:
        """Return the cell (n, 1) of the centre that is the highest over its distance."""
        flat = self.add('Reshape', [center, self.constant([0, -1])])
        distance = np.hypot(*(self._cells - self._side / 2).T) + _SOFTENING
        weighted = self.add('Div', [flat, self.constant(distance, np.float32)])
        return self.add('ArgMax', [weighted], axis=1, keepdims=1)

    def place(self, cells: str) -> str:
        """Return row, column (n, k, 2) of cells (n, k)."""
        return self.add('Gather', [self.constant(self._cells, np.float32), cells])

    def regressed(self, regression: str, cell: str) -> str:
        """Return y, x (n, 17, 2) that are regressed at a cell (n, 1)."""
        steps = self.add('Reshape', [
            self._at(regression, cell), self.constant([0, N_COCO17, 2])])
        return self.add('Add', [steps, self.place(cell)])

    def distance(self, places: str) -> str:
        """Return the distance of each cell from places (n, 17, 2), softened: (n, 17, h, w)."""
        numbers = self.constant(np.arange(self._side), np.float32)
        squares = []
        for index in (0, 1):
            place = self.add('Gather', [places, self.constant([index])], axis=2)
            away = self.add('Sub', [place, numbers])
            square = self.add('Mul', [away, away])
            squares.append(self.add('Unsqueeze', [square, self.constant([3 - index])]))
        distance = self.add('Sqrt', [self.add('Add', squares)])
        return self.add('Add', [distance, self.constant(_SOFTENING, np.float32)])

    def highest(self, planes: str) -> str:
        """Return the highest cell (n, 17) of each plane."""
        return self.add('ArgMax', [self._flat(planes)], axis=2, keepdims=0)

    def offset(self, offset: str, cells: str) -> str:
        """Return y, x (n, 17, 2) of each keypoint from its cell (n, 17)."""
        every = self.add('Reshape', [
            self._at(offset, cells), self.constant([0, N_COCO17, 2, N_COCO17])])
        own = self.constant(np.eye(N_COCO17)[:, None], np.float32)
        return self.add(
            'ReduceSum', [self.add('Mul', [every, own]), self.constant([3])], keepdims=0)

    def heat(self, heatmap: str, cells: str) -> str:
        """Return the heat (n, 17, 25) around cells (n, 17), nought beyond the rim."""
        pads = self.constant([0, 0, _RIM, _RIM, 0, 0, _RIM, _RIM])
        padded = self._flat(self.add('Pad', [heatmap, pads]))
        row = np.array([self._side + 2 * _RIM, 1])
        middle = self.add('Gather', [self.constant((self._cells + _RIM) @ row), cells])
        around = self.add('Add', [
            self.add('Unsqueeze', [middle, self.constant([2])]), self.constant(_STEPS @ row)])
        return self.add('GatherElements', [padded, around], axis=2)

    def centre(self, heat: str) -> str:
        """Return y, x (n, 17, 2) of the centre of the heat from the corner of its cell."""
        moments = self.add('MatMul', [heat, self.constant(_STEPS + 0.5, np.float32)])
        total = self.add('ReduceSum', [heat, self.constant([2])], keepdims=1)
        some = self.add('Max', [total, self.constant(_NO_HEAT, np.float32)])
        return self.add('Div', [moments, some])

    def give(self, name: str, places: str, heat: str) -> None:
        """Give y, x (n, 17, 2) as x, y and the heat of their own cells as score."""
        x_y = self.add('Gather', [places, self.constant([1, 0])], axis=2)
        score = self.add('Gather', [heat, self.constant([len(_STEPS) // 2])], axis=2)
        self.add('Concat', [x_y, score], axis=2, output=name)

    def _flat(self, planes: str) -> str:
        return self.add('Reshape', [planes, self.constant([0, 0, -1])])

    def _at(self, head: str, cells: str) -> str:
        """Return a head at cells (n, k): (n, channels, k)."""
        layers = []
        while self._joins_channels(self._makers.get(head)):
            layers.append(self._makers[head])
            head = layers[-1].input[0]
        times = self.constant([1, self._channels[head], 1])
        index = self.add('Tile', [self.add('Unsqueeze', [cells, self.constant([1])]), times])
        values = self.add('GatherElements', [self._flat(head), index], axis=2)
        for layer in reversed(layers):
            if layer.op_type != 'Conv':
                values = self.add(layer.op_type, [values])
                continue
            kernel, bias = (numpy_helper.to_array(self._weights[name]) for name in layer.input[1:])
            joined = self.add(
                'MatMul', [self.constant(kernel[:, :, 0, 0], np.float32), values])
            values = self.add('Add', [joined, self.constant(bias[:, None], np.float32)])
        return values

    def _joins_channels(self, layer: onnx.NodeProto | None) -> bool:
        """Return whether a layer gives each cell what depends on that cell alone."""
        if layer is None or layer.op_type != 'Conv':
            return layer is not None and layer.op_type in ('Identity', 'Relu')
        channels = self._channels[layer.input[0]]
        return len(layer.input) == 3 and (
            self._weights[layer.input[1]].dims[1:] == [channels, 1, 1])

    def model(self, outputs: Sequence[str]) -> onnx.ModelProto:
        """Return the model with these outputs (n, 17, 3) alone, and what they need, checked."""
        needed, nodes = set(outputs), []
        for node in reversed(self._graph.node):
            if needed.intersection(node.output):
                needed.update(node.input)
                nodes.append(node)
        given = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [None, N_COCO17, 3])
                 for name in outputs]
        weights = [value for name, value in self._weights.items() if name in needed]
        self._model.graph.CopyFrom(helper.make_graph(
            nodes[::-1], self._graph.name, self._graph.input, given, weights))
        onnx.checker.check_model(self._model, full_check=True)
        return self._model
