"""Networks get the values, order and layout that they were trained on."""
from __future__ import annotations

import numpy as np
from onnx import TensorProto
from pose_graphs import constant
import pytest

from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import ImageTensor, Pixels

BGR = (255, 128, 0)
IDENTITY = np.array([[[1.0, 0, 0], [0, 1, 0]]])


def tensor_of(path, pixels, *, shape=(1, 3, 4, 6), kind=TensorProto.FLOAT, **options):
    graph = Graph(constant(path, {'out': np.zeros((1, 1), np.float32)}, shape=shape, kind=kind))
    return ImageTensor(graph, pixels, **options)


@pytest.mark.parametrize(('order', 'values', 'expected'), [
    ('bgr', 'bytes', (255, 128, 0)),
    ('rgb', 'bytes', (0, 128, 255)),
    ('rgb', 'unit', (0, 128 / 255, 1)),
    ('bgr', 'centred', (127 / 256, 0, -0.5)),
    # (byte - mean) / deviation, each channel with its own wherever it comes.
    ('rgb', 'imagenet', (-2.1179, 0.2052, 2.6400)),
    ('bgr', 'imagenet', (2.6400, 0.2052, -2.1179)),
])
@pytest.mark.parametrize('shape', [(1, 3, 4, 6), (1, 4, 6, 3)])
def test_a_colour_comes_as_the_network_takes_it(tmp_path, order, values, expected, shape):
    tensor = tensor_of(tmp_path / 'n.onnx', Pixels(order, values), shape=shape)
    assert tensor.size == (6, 4)
    filled = tensor.fill(np.full((4, 6, 3), BGR, np.uint8), IDENTITY, (6, 4))
    assert filled.shape == shape
    assert filled.dtype == np.float32
    pixel = filled[0, :, 2, 3] if shape[1] == 3 else filled[0, 2, 3]
    np.testing.assert_allclose(pixel, expected, atol=1e-3)


@pytest.mark.parametrize(('kind', 'dtype'), [
    (TensorProto.UINT8, np.uint8), (TensorProto.FLOAT16, np.float16)])
def test_a_network_gets_its_own_type(tmp_path, kind, dtype):
    tensor = tensor_of(tmp_path / 'n.onnx', Pixels('bgr', 'bytes'), kind=kind)
    filled = tensor.fill(np.full((4, 6, 3), BGR, np.uint8), IDENTITY, (6, 4))
    assert filled.dtype == dtype
    assert filled[0, :, 0, 0].tolist() == list(BGR)


def test_bytes_are_never_scaled(tmp_path):
    tensor = tensor_of(tmp_path / 'n.onnx', Pixels('bgr', 'imagenet'), kind=TensorProto.UINT8)
    filled = tensor.fill(np.full((4, 6, 3), BGR, np.uint8), IDENTITY, (6, 4))
    assert filled[0, :, 0, 0].tolist() == list(BGR)


def test_what_the_image_does_not_reach_is_the_border(tmp_path):
    tensor = tensor_of(tmp_path / 'n.onnx', Pixels('bgr', 'bytes'), border=114)
    filled = tensor.fill(np.full((2, 6, 3), 9, np.uint8), IDENTITY, (6, 4))
    assert np.unique(filled[0, :, :2]).tolist() == [9]
    assert np.unique(filled[0, :, 2:]).tolist() == [114]


@pytest.mark.parametrize(('batch', 'batched'), [(1, False), ('n', True)])
def test_each_crop_is_one_image_of_the_batch(tmp_path, batch, batched):
    tensor = tensor_of(tmp_path / 'n.onnx', Pixels('bgr', 'bytes'), shape=(batch, 3, 4, 6))
    assert tensor.batched == batched
    image = np.zeros((4, 12, 3), np.uint8)
    image[:, 6:] = 200
    beside = IDENTITY - [[[0, 0, 6], [0, 0, 0]]]
    filled = tensor.fill(image, np.concatenate([IDENTITY, beside]), (6, 4))
    assert [np.unique(each).tolist() for each in filled] == [[0], [200]]
