"""Each operation is translated so that ONNX Runtime gives what TensorFlow would."""
from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from tfjs_graphs import CONVOLUTION, image_nodes, node, RESIZE, write_graph

from depth_person.errors import DepthPersonError
from depth_person.pose.onnx_writer import convert
from depth_person.pose.tfjs import read_graph_model

ONES = np.ones((3, 3, 1, 1))


@pytest.fixture
def run(tmp_path):
    """Return a function that converts a graph whose last node is its head, and runs it."""
    def convert_and_run(image, nodes, weights=None, *, sigmoid=()):
        path = write_graph(tmp_path / 'net.json', [*image_nodes(), *nodes], weights or {})
        model = convert(
            read_graph_model(path), {'head': nodes[-1]['name']}, image='image',
            image_shape=['batch', 'height', 'width', 'channels'], sigmoid=sigmoid)
        session = onnxruntime.InferenceSession(model.SerializeToString())
        image = np.asarray(image, np.uint8)
        return session.run(['head'], {'image': image})[0]
    return convert_and_run


def gray(rows):
    """Return an image of one channel in a batch of one."""
    return np.array(rows)[None, :, :, None]


def convolution(op='_FusedConv2D', inputs=('cast', 'kernel'), **attributes):
    return node('conv', op, inputs, **{**CONVOLUTION, **attributes})


# The sum of each window of 3 x 3, by hand: where the windows begin is TensorFlow's SAME.
@pytest.mark.parametrize(('image', 'stride', 'padding', 'expected'), [
    ([[1, 2, 3, 4]] * 1, 2, 'SAME', [[6, 7]]),  # even: nothing before, one column after
    ([[1, 2, 3, 4, 5]], 2, 'SAME', [[3, 9, 9]]),  # odd: one before, one after
    ([[1], [2], [3], [4]], 2, 'SAME', [[6], [7]]),
    ([[1], [2], [3], [4], [5]], 2, 'SAME', [[3], [9], [9]]),
    ([[1, 2, 3, 4]], 1, 'SAME', [[3, 6, 9, 7]]),
    ([[1, 1, 1]] * 3, 1, 'VALID', [[9]]),
    ([[1, 1, 1, 1, 1]] * 4, 2, 'VALID', [[9, 9]]),
])
def test_windows_lie_where_tensorflow_puts_them(run, image, stride, padding, expected):
    head = run(
        gray(image), [convolution(strides=[1, stride, stride, 1], padding=padding)],
        {'kernel': ONES})
    np.testing.assert_allclose(head[0, 0], expected)


def test_one_model_serves_even_and_odd_sizes_and_batches(tmp_path):
    path = write_graph(
        tmp_path / 'net.json', [*image_nodes(), convolution(strides=[1, 2, 2, 1])],
        {'kernel': ONES})
    model = convert(
        read_graph_model(path), {'head': 'conv'}, image='image',
        image_shape=['batch', 'height', 'width', 1])
    session = onnxruntime.InferenceSession(model.SerializeToString())
    for width, expected in ((4, [6, 7]), (5, [3, 9, 9])):
        images = np.stack([gray([np.arange(1, width + 1)])[0]] * 3).astype(np.uint8)
        head = session.run(None, {'image': images})[0]
        np.testing.assert_allclose(head[:, 0, 0], [expected] * 3)


def test_channels_are_combined_by_the_kernel(run):
    kernel = np.array([[1, 10], [2, 20], [3, 30]]).reshape(1, 1, 3, 2) / 1.0
    head = run([[[[1, 2, 3]]]], [convolution()], {'kernel': kernel})
    np.testing.assert_allclose(head[0, :, 0, 0], [14, 140])


@pytest.mark.parametrize(('fused', 'expected'), [
    ([], [0, 20]), (['BiasAdd'], [-5, 15]), (['BiasAdd', 'Relu'], [0, 15]),
    (['BiasAdd', 'Relu6'], [0, 6])])
def test_bias_and_activation_follow_the_convolution(run, fused, expected):
    inputs = ['cast', 'kernel', 'bias'][:2 + bool(fused)]
    head = run(
        gray([[0, 20]]), [convolution(inputs=inputs, fused_ops=fused)],
        {'kernel': np.ones((1, 1, 1, 1)), 'bias': np.array([-5.0])})
    np.testing.assert_allclose(head[0, 0, 0], expected)


@pytest.mark.parametrize('op', ['DepthwiseConv2dNative', 'FusedDepthwiseConv2dNative'])
def test_depthwise_kernels_keep_channels_apart(run, op):
    kernel = np.zeros((3, 3, 2, 1))
    kernel[1, 1, 0] = 1  # the first channel stays
    kernel[1, 2, 1] = 1  # the second moves one to the left
    image = np.array([[[1, 10], [2, 20], [3, 30]]])[None]
    head = run(image, [convolution(op)], {'kernel': kernel})
    np.testing.assert_allclose(head[0, :, 0], [[1, 2, 3], [20, 30, 0]])


def test_a_depthwise_multiplier_keeps_tensorflows_order_of_channels(run):
    kernel = np.array([[1.0, 2.0], [3.0, 4.0]]).reshape(1, 1, 2, 2)
    head = run([[[[1, 10]]]], [convolution('DepthwiseConv2dNative')], {'kernel': kernel})
    np.testing.assert_allclose(head[0, :, 0, 0], [1, 2, 30, 40])


def doubled_size(source):
    """Return the nodes with which a graph works out twice the size of a node."""
    masks = dict.fromkeys(
        ('begin_mask', 'end_mask', 'ellipsis_mask', 'new_axis_mask', 'shrink_axis_mask'), 0)
    return [
        node('shape', 'Shape', [source]),
        node('part', 'StridedSlice', ['shape', 'one', 'three', 'one'], **masks),
        node('size', 'Mul', ['part', 'two'])]


SIZES = {'one': np.array([1]), 'three': np.array([3]), 'two': np.array([2, 2])}


# Twice the size with centres at halves: a quarter of the way between neighbours, held at the rim.
@pytest.mark.parametrize('constant', [True, False])
def test_a_resize_takes_pixel_centres_at_halves(run, constant):
    resize = node('resize', 'ResizeBilinear', ['cast', 'size'], **RESIZE)
    nodes = [resize] if constant else [*doubled_size('cast'), resize]
    weights = {'size': np.array([2, 6])} if constant else SIZES
    head = run(gray([[0, 4, 8]]), nodes, weights)
    np.testing.assert_allclose(head[0, 0], [[0, 1, 3, 5, 7, 8]] * 2)


def test_arithmetic_broadcasts_constants_over_channels(run):
    nodes = [
        node('sub', 'Sub', ['cast', 'mean']), node('mul', 'Mul', ['sub', 'scale']),
        node('add', 'AddV2', ['mul', 'cast'])]
    weights = {'mean': np.array([1.0, 2.0]).reshape(1, 1, 1, 2), 'scale': np.array(0.5)}
    head = run([[[[5, 10], [7, 20]]]], nodes, weights)
    np.testing.assert_allclose(head[0, :, 0], [[7, 10], [14, 29]])


def test_taking_the_batch_axis_off_and_on_lets_a_batch_pass(run):
    nodes = [
        node('off', 'Unpack', ['cast'], axis=0, num=1),
        node('on', 'ExpandDims', ['off', 'zero']),
        node('off_again', 'Squeeze', ['on'], squeeze_dims=[0]),
        node('on_again', 'ExpandDims', ['off_again', 'zero'])]
    images = np.arange(12).reshape(3, 2, 2, 1)
    head = run(images, nodes, {'zero': np.array(0)})
    np.testing.assert_array_equal(head, images.transpose(0, 3, 1, 2))


def test_a_head_may_pass_through_a_sigmoid(run):
    head = run(gray([[0, 3]]), [node('same', 'Squeeze', ['cast'], squeeze_dims=[0])],
               sigmoid=['head'])
    np.testing.assert_allclose(head[0, 0, 0], [0.5, 1 / (1 + np.exp(-3))], rtol=1e-6)


def test_what_no_head_needs_is_left_out(run):
    nodes = [node('decoding', 'TopKV2', ['cast']), node('sigmoid', 'Sigmoid', ['cast'])]
    np.testing.assert_allclose(run(gray([[0]]), nodes), [[[[0.5]]]])


@pytest.mark.parametrize(('nodes', 'message'), [
    ([node('x', 'TopKV2', ['cast'])], r'operation TopKV2 \(x\)'),
    ([node('x', 'Sigmoid', ['gone'])], 'reads gone'),
    ([convolution(padding='EXPLICIT')], 'padding EXPLICIT'),
    ([convolution(data_format='NCHW')], 'data_format NCHW'),
    ([convolution(dilations=[1, 2, 2, 1])], 'strides and dilations'),
    ([convolution(inputs=['cast', 'cast'])], 'input 1 not a constant'),
    ([convolution(inputs=['cast', 'kernel', 'kernel'], fused_ops=['BiasAdd', 'Elu'])], 'Elu'),
    ([node('x', 'AddV2', ['cast', 'kernel'])], 'shape of input 1'),
    ([node('x', 'Cast', ['cast'], DstT='DT_INT32')], 'DstT DT_INT32'),
    ([node('x', 'Squeeze', ['cast'], squeeze_dims=[1])], r'axis \[1\]'),
    ([node('x', 'Unpack', ['cast'], axis=0, num=2)], 'axis'),
    ([node('x', 'ResizeBilinear', ['cast', 'two'], half_pixel_centers=False)],
     'half_pixel_centers False'),
    ([node('x', 'ResizeBilinear', ['cast', 'cast'], **RESIZE)], 'size'),
    ([node('other', 'Sigmoid', ['cast']), *doubled_size('other'),
      node('x', 'ResizeBilinear', ['cast', 'size'], **RESIZE)], 'size'),
])
def test_what_cannot_be_translated_is_named(run, nodes, message):
    with pytest.raises(DepthPersonError, match=message):
        run(gray([[0]]), nodes, {'kernel': np.ones((3, 3, 1, 2)), **SIZES})
