"""Writes the backbone and chosen heads of a TensorFlow.js graph model as ONNX."""
from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from graphlib import TopologicalSorter
from typing import Any

import numpy as np
from numpy.typing import NDArray
import onnx
from onnx import helper, numpy_helper, shape_inference, TensorProto

from depth_person import __version__
from depth_person.errors import DepthPersonError
from depth_person.pose.tfjs import GraphModel, Node

#: What ONNX Runtime 1.17, the oldest that setup.py allows, reads for certain.
OPSET = 18
IR_VERSION = 9

_SLICE_MASKS = (
    'begin_mask', 'end_mask', 'ellipsis_mask', 'new_axis_mask', 'shrink_axis_mask')


def convert(
    graph: GraphModel, heads: Mapping[str, str], *, image: str, image_shape: Sequence[int | str],
    sigmoid: Collection[str] = (),
) -> onnx.ModelProto:
    """
    Return the part of a graph that its heads need, as a checked ONNX model.

    TensorFlow keeps the channels last, ONNX has them second. The model takes an image, uint8 of
    (batch, height, width, channels), and gives float32 of (batch, channels, height, width).

    :param heads: name of the output -> name of the node it comes from.
    :param image: name of the input.
    :param image_shape: its four sizes; a string stands for one that is chosen at each run.
    :param sigmoid: the outputs that pass through a sigmoid, which makes logits scores.
    :raises DepthPersonError: naming the operation or attribute that has no translation.
    """
    writer = _Writer(graph, image)
    outputs = []
    for node in _ordered(graph, heads.values()):
        writer.translate(node)
    for output, name in heads.items():
        writer.emit('Sigmoid' if output in sigmoid else 'Identity', [name], output)
        outputs.append(helper.make_tensor_value_info(output, TensorProto.FLOAT, [None] * 4))
    inputs = [helper.make_tensor_value_info(image, TensorProto.UINT8, list(image_shape))]
    model = helper.make_model(
        helper.make_graph(writer.nodes, 'depth_person', inputs, outputs, writer.initializers),
        opset_imports=[helper.make_opsetid('', OPSET)], ir_version=IR_VERSION,
        producer_name='depth_person', producer_version=__version__)
    onnx.checker.check_model(model, full_check=True)
    return model


def with_scales(model: onnx.ModelProto) -> onnx.ModelProto:
    """
    Return a network whose resizing to a fixed size is told by scales.

    So ONNX Runtime keeps the layout that its convolutions have. And when it lays quantized
    networks out anew, it takes the sizes of two axes for those of all four, and refuses them.
    """
    inferred = shape_inference.infer_shapes(model)
    shapes = {value.name: [side.dim_value for side in value.type.tensor_type.shape.dim]
              for value in inferred.graph.value_info}
    fixed = {value.name: numpy_helper.to_array(value) for value in model.graph.initializer}
    for node in model.graph.node:
        axes = next((list(each.ints) for each in node.attribute if each.name == 'axes'), [])
        shape = np.array(shapes.get(node.input[0], [0] * 4))
        if (node.op_type != 'Resize' or not axes or not fixed.keys() & set(node.input[3:4])
                or not shape[axes].all()):  # a side of any length is 0 here
            continue
        scales = np.ones(4, np.float32)
        scales[axes] = fixed[node.input[3]] / shape[axes]
        name = f'{node.output[0]}_scales'
        model.graph.initializer.append(numpy_helper.from_array(scales, name))
        others = [each for each in node.attribute if each.name != 'axes']
        del node.input[1:], node.attribute[:]
        node.input.extend(['', name])
        node.attribute.extend(others)
    used = {name for node in model.graph.node for name in node.input}
    kept = [value for value in model.graph.initializer if value.name in used]
    del model.graph.initializer[:]
    model.graph.initializer.extend(kept)
    return model


def _ordered(graph: GraphModel, ends: Iterable[str]) -> list[Node]:
    """Return the nodes that the ends need, each after those it reads."""
    needed: dict[str, list[str]] = {}
    waiting = list(ends)
    while waiting:
        name = waiting.pop()
        if name in needed or name in graph.weights:
            continue
        node = graph.nodes.get(name)
        if node is None:
            raise DepthPersonError(f'the graph reads {name}, which it does not have')
        # The second input of a resize is its size, which _Writer.resize works out by itself.
        inputs = node.inputs[:1] if node.op == 'ResizeBilinear' else node.inputs
        needed[name] = [name for name in inputs if name not in graph.weights]
        waiting.extend(needed[name])
    return [graph.nodes[name] for name in TopologicalSorter(needed).static_order()]


class _Writer:
    """Collects ONNX nodes; values keep the names they have in the graph."""

    def __init__(self, graph: GraphModel, image: str) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: list[onnx.TensorProto] = []
        self._graph = graph
        self._image = image

    def translate(self, node: Node) -> None:
        rule = _RULES.get(node.op)
        if rule is None:
            raise DepthPersonError(
                f'the graph holds the operation {node.op} ({node.name}), which depth_person '
                'cannot translate; install a model that `depth_person models list` names')
        rule(self, node)

    def emit(self, op: str, inputs: Sequence[str], output: str, **attributes: Any) -> str:
        self.nodes.append(helper.make_node(op, inputs, [output], name=output, **attributes))
        return output

    def constant(self, name: str, values: NDArray[Any]) -> str:
        self.initializers.append(
            numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def weights(self, node: Node, index: int) -> NDArray[Any]:
        values = self._graph.weights.get(node.inputs[index])
        if values is None:
            raise _unexpected(node, f'input {index}', 'not a constant')
        return values

    def operand(self, node: Node, index: int) -> str:
        """Return the name of an operand of element-wise arithmetic, channels second."""
        name = node.inputs[index]
        values = self._graph.weights.get(name)
        if values is None:
            return name
        if values.size > 1 and values.shape[:-1] != (1, 1, 1):
            raise _unexpected(node, f'shape of input {index}', values.shape)
        return self.constant(f'{node.name}/{index}', values.reshape(-1, 1, 1))

    def placeholder(self, node: Node) -> None:
        self.emit('Transpose', [self._image], node.name, perm=[0, 3, 1, 2])

    def cast(self, node: Node) -> None:
        _require(node, DstT='DT_FLOAT')
        self.emit('Cast', node.inputs, node.name, to=TensorProto.FLOAT)

    def batch_axis(self, node: Node) -> None:
        # These take the batch axis off the one image and put it on again. Where it may stay they
        # have nothing to do, and a batch passes too.
        if node.op == 'ExpandDims':
            axis = self.weights(node, 1).item()
        else:
            axis = node.attributes.get('axis' if node.op == 'Unpack' else 'squeeze_dims')
        if axis not in (0, [0]) or node.attributes.get('num', 1) != 1:
            raise _unexpected(node, 'axis', axis)
        self.emit('Identity', node.inputs[:1], node.name)

    def arithmetic(self, node: Node) -> None:
        op = {'AddV2': 'Add'}.get(node.op, node.op)
        self.emit(op, [self.operand(node, 0), self.operand(node, 1)], node.name)

    def unary(self, node: Node) -> None:
        self.emit(node.op, node.inputs, node.name)

    def convolution(self, node: Node) -> None:
        kernel = self.weights(node, 1)
        height, width, channels, _ = kernel.shape
        if 'Depthwise' in node.op:
            # (height, width, channels, multiplier) -> (channels * multiplier, 1, height, width)
            weights = kernel.reshape(height, width, 1, -1).transpose(3, 2, 0, 1)
            group = channels
        else:
            weights, group = kernel.transpose(3, 2, 0, 1), 1
        inputs = [node.inputs[0], self.constant(f'{node.name}/weights', weights)]
        fused = list(node.attributes.get('fused_ops', ()))
        if fused[:1] == ['BiasAdd']:
            inputs.append(self.constant(f'{node.name}/bias', self.weights(node, 2)))
        activation = fused[1:] if fused else []
        if (fused and fused[0] != 'BiasAdd') or activation not in ([], ['Relu'], ['Relu6']):
            raise _unexpected(node, 'fused_ops', fused)
        attributes = {'group': group, 'kernel_shape': [height, width], **_windows(node)}
        if not activation:
            self.emit('Conv', inputs, node.name, **attributes)
            return
        linear = self.emit('Conv', inputs, f'{node.name}/linear', **attributes)
        if activation == ['Relu']:
            self.emit('Relu', [linear], node.name)
        else:
            limits = [self.constant(f'{node.name}/{value}', np.float32(value)) for value in (0, 6)]
            self.emit('Clip', [linear, *limits], node.name)

    def resize(self, node: Node) -> None:
        _require(node, half_pixel_centers=True, align_corners=False)
        size = self._graph.weights.get(node.inputs[1])
        if size is None:
            factors = self._factors_of_size(node).astype(np.float32)
            inputs = [node.inputs[0], '', self.constant(f'{node.name}/factors', factors)]
        else:
            target = self.constant(f'{node.name}/size', size.astype(np.int64))
            inputs = [node.inputs[0], '', '', target]
        self.emit(
            'Resize', inputs, node.name, mode='linear', axes=[2, 3],
            coordinate_transformation_mode='half_pixel')

    def _factors_of_size(self, node: Node) -> NDArray[Any]:
        """Return the factors of a resize whose size is Shape(input)[1:3] * factors."""
        links, name = [], node.inputs[1]
        for op in ('Mul', 'StridedSlice', 'Shape'):
            link = self._graph.nodes.get(name)
            if link is None or link.op != op:
                raise _unexpected(node, 'size', 'that is not a multiple of its input')
            links.append(link)
            name = link.inputs[0]
        product, part, _ = links
        _require(part, **dict.fromkeys(_SLICE_MASKS, 0))
        begin_end_step = [self.weights(part, index).tolist() for index in (1, 2, 3)]
        if name != node.inputs[0] or begin_end_step != [[1], [3], [1]]:
            raise _unexpected(node, 'size', 'that is not a multiple of its input')
        return self.weights(product, 1)


def _require(node: Node, **expected: Any) -> None:
    for key, value in expected.items():
        if node.attributes.get(key) != value:
            raise _unexpected(node, key, node.attributes.get(key))


def _unexpected(node: Node, what: str, found: Any) -> DepthPersonError:
    return DepthPersonError(
        f'{node.op} ({node.name}) has {what} {found}, which depth_person cannot translate; '
        'install a model that `depth_person models list` names')


def _windows(node: Node) -> dict[str, Any]:
    """Return the attributes of an ONNX Conv that say where its windows lie."""
    _require(node, data_format='NHWC')
    strides, dilations = node.attributes['strides'], node.attributes.get('dilations', [1] * 4)
    if dilations != [1] * 4 or strides[0] != 1 or strides[3] != 1:
        raise _unexpected(node, 'strides and dilations', (strides, dilations))
    padding = node.attributes['padding']
    if padding not in ('SAME', 'VALID'):
        raise _unexpected(node, 'padding', padding)
    # TensorFlow's SAME depends on the size of the input, and puts the odd row and column at the
    # end: at stride 2 an even size gets none at the start. ONNX calls this SAME_UPPER.
    return {'strides': strides[1:3], 'auto_pad': 'SAME_UPPER' if padding == 'SAME' else 'VALID'}


_RULES: dict[str, Callable[[_Writer, Node], None]] = {
    'AddV2': _Writer.arithmetic,
    'Cast': _Writer.cast,
    'DepthwiseConv2dNative': _Writer.convolution,
    'ExpandDims': _Writer.batch_axis,
    'FusedDepthwiseConv2dNative': _Writer.convolution,
    'Mul': _Writer.arithmetic,
    'Placeholder': _Writer.placeholder,
    'ResizeBilinear': _Writer.resize,
    'Sigmoid': _Writer.unary,
    'Squeeze': _Writer.batch_axis,
    'Sub': _Writer.arithmetic,
    'Unpack': _Writer.batch_axis,
    '_FusedConv2D': _Writer.convolution,
}
