"""Networks in other precisions give nearly the same, and what cannot be converted is told."""
from __future__ import annotations

import cv2
import numpy as np
import onnx
from onnx import helper, numpy_helper, TensorProto
from pose_graphs import rtmo_of_spots
import pytest
import skimage.data

from depth_person.cli import main
from depth_person.errors import DepthPersonError
from depth_person.pose.graph import Graph
from depth_person.pose.image_tensor import Pixels
from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions
from depth_person.pose.precision import convert_precision

MOVENET = Pixels('rgb', 'bytes')
FACE = [0, 1, 2, 5, 14, 15, 16, 17]


@pytest.fixture(scope='module')
def photograph():
    return np.ascontiguousarray(skimage.data.astronaut()[..., ::-1])


@pytest.fixture(scope='module')
def images(tmp_path_factory, photograph):
    folder = tmp_path_factory.mktemp('images')
    for angle in (None, cv2.ROTATE_180):
        image = photograph if angle is None else cv2.rotate(photograph, angle)
        cv2.imwrite(str(folder / f'{angle}.jpg'), image)
    return folder


@pytest.mark.parametrize(('precision', 'size', 'most_off'), [
    ('fp16', 0.52, 0.5), ('int8', 0.4, 8)])
def test_a_smaller_network_marks_nearly_the_same(
        network, tmp_path, photograph, images, capsys, precision, size, most_off):
    source, target = network('movenet-lightning'), tmp_path / 'smaller.onnx'
    assert main([
        'models', 'convert', 'movenet-lightning', '--precision', precision, '-o', str(target),
        '--calibrate', str(images)]) == 0
    assert target.stat().st_size < size * source.stat().st_size
    assert f'{target}: {precision}' in capsys.readouterr().out
    before, after = (open_network(PoseOptions(model=str(path)))(photograph)[0, FACE, :2]
                     for path in (source, target))
    off = np.hypot(*(after - before).T)
    assert np.median(off) < most_off  # pixels of 512
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(('options', 'message'), [
    ({'precision': 'int8'}, 'int8 needs images to calibrate on'),
    ({'precision': 'int8', 'images': 'empty'}, 'holds no images'),
    ({'precision': 'int8', 'images': 'broken'}, 'is not an image that OpenCV can read'),
    ({'precision': 'fp16', 'target': 'net.tflite'}, r'should end in \.onnx'),
    ({'precision': 'fp16', 'target': 'nowhere/net.onnx'}, 'cannot write .*nowhere'),
])
def test_what_cannot_be_converted_is_told(network, tmp_path, options, message):
    for name in ('empty', 'broken'):
        (tmp_path / name).mkdir()
    (tmp_path / 'broken' / 'a.png').write_bytes(b'no image')
    images = options.get('images')
    target = tmp_path / options.get('target', 'net.onnx')
    with pytest.raises(DepthPersonError, match=message):
        convert_precision(
            network('movenet-lightning'), target, precision=options['precision'],
            images=None if images is None else tmp_path / images, pixels=MOVENET)
    assert not target.exists()


@pytest.mark.parametrize('precision', ['fp16', 'int8'])
@pytest.mark.parametrize('content', [b'', b'version https://git-lfs.github.com/spec/v1'])
def test_what_is_no_network_is_told_in_one_message(tmp_path, images, precision, content, capsys):
    source = tmp_path / 'net.onnx'
    source.write_bytes(content)
    assert main([
        'models', 'convert', str(source), '--precision', precision, '-o',
        str(tmp_path / 'made.onnx'), '--calibrate', str(images)]) == 1
    assert 'net.onnx' in (said := capsys.readouterr().err)
    assert 'Git LFS pointer' in said
    assert list(tmp_path.iterdir()) == [source]


def test_what_is_of_another_precision_already_is_told(tmp_path):
    source, target = tmp_path / 'net.onnx', tmp_path / 'fp16.onnx'
    rtmo_of_spots(source)
    convert_precision(source, target, precision='fp16', pixels=MOVENET)
    with pytest.raises(DepthPersonError, match=r'fp16\.onnx cannot be converted to fp16; it may'):
        convert_precision(target, tmp_path / 'again.onnx', precision='fp16', pixels=MOVENET)


def test_a_resize_with_empty_tensors_for_what_is_not_given_is_converted(tmp_path):
    # As networks that come from TensorFlow have them.
    graph = helper.make_graph(
        [helper.make_node('Resize', ['image', 'empty', 'empty', 'size'], ['larger'])], 'resize',
        [helper.make_tensor_value_info('image', TensorProto.FLOAT, [1, 3, 8, 8])],
        [helper.make_tensor_value_info('larger', TensorProto.FLOAT, [1, 3, 16, 16])],
        [numpy_helper.from_array(np.zeros(0, np.float32), 'empty'),
         numpy_helper.from_array(np.int64([1, 3, 16, 16]), 'size')])
    source, target = tmp_path / 'net.onnx', tmp_path / 'fp16.onnx'
    onnx.save(helper.make_model(
        graph, opset_imports=[helper.make_opsetid('', 13)], ir_version=8), source)
    convert_precision(source, target, precision='fp16', pixels=MOVENET)
    image = np.arange(192, dtype=np.float32).reshape(1, 3, 8, 8)
    for_both = [Graph(path).run(image, ['larger'])[0] for path in (source, target)]
    np.testing.assert_array_equal(*for_both)
