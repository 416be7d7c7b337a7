"""Files that are no known network, images that are none, and providers that are not here."""
from __future__ import annotations

from typing import ClassVar

import numpy as np
import onnx
from onnx import TensorProto
import onnxruntime
from pose_graphs import (
    blazepose_of_spots,
    constant,
    rtmo_of_spots,
    simcc_of_spots,
    SPOTS,
    spotted,
    veiled,
)
import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose import runtime
from depth_person.pose.graph import Graph
from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions, settled
from depth_person.pose.skeleton import Keypoint

HEAT = np.zeros((1, 19, 8, 8), np.float32)
FIELD = np.zeros((1, 38, 8, 8), np.float32)


def opened(path, **options):
    return open_network(PoseOptions(model=str(path), **options))


@pytest.mark.parametrize(('outputs', 'told'), [
    ({'probs': np.zeros((1, 1000))}, r'gives probs \(1, 1000\) float'),
    ({'heat': HEAT}, r'gives heat \(1, 19, 8, 8\) float'),  # and no fields
    ({'dets': np.zeros((1, 3, 5))}, r'gives dets \(1, 3, 5\)'),
    ({'dets': np.zeros((1, 3, 5)), 'keypoints': np.zeros((1, 3, 21, 3))},
     r'keypoints \(1, 3, 21, 3\)'),
    ({'simcc_x': np.zeros((1, 17, 384))}, r'simcc_x \(1, 17, 384\)'),
    ({'ld_3d': np.zeros((1, 195))}, r'ld_3d \(1, 195\)'),  # and no flag
])
def test_a_network_of_no_known_kind_is_refused_with_what_was_found(tmp_path, outputs, told):
    path = constant(
        tmp_path / 'net.onnx', {key: np.float32(value) for key, value in outputs.items()})
    with pytest.raises(DepthPersonError, match=told) as caught:
        opened(path)
    assert 'takes image (1, 3, 256, 256) float' in str(caught.value)
    assert 'none of the networks known here (MoveNet as `depth_person models ' in str(
        caught.value)


@pytest.mark.parametrize('options', [
    {'shape': (1, 1, 64, 64)}, {'shape': (1, 64, 64)}, {'shape': (1, 3, 64, 3)},
    {'shape': ()}, {'shape': ('b', 'c', 'h', 'w')},
    {'kind': TensorProto.INT64}, {'inputs': 2}])
def test_a_network_that_takes_no_image_is_refused(tmp_path, options):
    path = constant(tmp_path / 'net.onnx', {'heat': HEAT, 'field': FIELD}, **options)
    with pytest.raises(DepthPersonError, match='it should take one image'):
        opened(path)


def test_simcc_with_an_unknown_number_of_keypoints_is_refused(tmp_path):
    path = simcc_of_spots(tmp_path / 'hand.onnx', keypoints=21)
    with pytest.raises(DepthPersonError, match='should have 17, 26, 133 keypoints'):
        opened(path)


@pytest.mark.parametrize(('write', 'colour'), [
    (rtmo_of_spots, 0), (simcc_of_spots, 2), (blazepose_of_spots, 2)])
def test_outputs_that_tell_their_shapes_only_at_a_run_are_known(tmp_path, write, colour):
    detector = str(rtmo_of_spots(tmp_path / 'rtmo.onnx'))
    network = opened(veiled(write(tmp_path / 'net.onnx')), detector=detector)
    # The nose is at the first channel of the image.
    np.testing.assert_allclose(
        network(spotted())[0, Keypoint.NOSE, :2], SPOTS[colour], atol=0.3)


def test_heads_that_tell_their_channels_only_at_a_run_are_known(tmp_path):
    path = constant(
        tmp_path / 'net.onnx', {'heat': HEAT, 'field': FIELD}, shape=(1, 3, 64, 64))
    assert opened(veiled(path)).neck_measured


def test_a_batch_that_is_free_in_name_only_is_run_one_by_one(tmp_path):
    path = blazepose_of_spots(tmp_path / 'blaze.onnx')
    model = onnx.load(path)
    model.graph.input[0].type.tensor_type.shape.dim[0].dim_param = 'batch'
    onnx.save(model, path)
    marks = np.full((1, 2, 17, 3), 0.9, np.float32)
    marks[..., :2] = np.arange(34).reshape(17, 2)[::-1]
    marks[0, :, :, :2] += np.array([[[30, 60]], [[430, 60]]])
    boxes = np.float32([[[0, 0, 90, 90, 0.9], [400, 0, 490, 90, 0.8]]])
    two = constant(
        tmp_path / 'two.onnx', {'dets': boxes, 'keypoints': marks}, shape=(1, 3, 640, 640))
    spots = np.array([[40.0, 70.0], [55.0, 85.0], [45.0, 80.0]])
    others = spots + np.array([400.0, 0.0])
    found = opened(path, detector=str(two))(
        spotted(640, 640, spots) + spotted(640, 640, others))
    np.testing.assert_allclose(found[:, Keypoint.NOSE, :2], [spots[2], others[2]], atol=0.5)


def test_a_network_for_several_images_at_once_is_refused(tmp_path):
    path = constant(tmp_path / 'n.onnx', {'heat': HEAT, 'field': FIELD}, shape=(4, 3, 64, 64))
    with pytest.raises(DepthPersonError, match='takes 4 images at once; export it for one'):
        opened(path)


def test_a_network_that_does_not_run_is_refused_before_the_first_frame(tmp_path):
    path = rtmo_of_spots(tmp_path / 'rtmo.onnx')
    model = onnx.load(path)
    for axis in (2, 3):  # it says that it takes any size, and does not
        model.graph.input[0].type.tensor_type.shape.dim[axis].dim_param = 'side'
    onnx.save(model, path)
    with pytest.raises(DepthPersonError, match=r'does not run on a tensor \(1, 3, 512, 512\)'):
        opened(path)


@pytest.mark.parametrize('content', [b'', b'not a network'])
def test_a_file_that_is_no_network_is_refused(tmp_path, content):
    path = tmp_path / 'net.onnx'
    path.write_bytes(content)
    with pytest.raises(DepthPersonError, match=r'cannot open .*net\.onnx'):
        opened(path)


@pytest.mark.parametrize('image', [
    np.zeros((0, 640, 3), np.uint8), np.zeros((480, 0, 3), np.uint8),
    np.zeros((480, 640), np.uint8), np.zeros((480, 640, 4), np.uint8),
    np.zeros((480, 640, 3), np.float32)])
@pytest.mark.parametrize('kind', ['rtmo', 'openpose', 'simcc'])
def test_what_is_no_image_is_one_error(tmp_path, kind, image):
    detector = str(rtmo_of_spots(tmp_path / 'rtmo.onnx'))
    path = {
        'rtmo': lambda: detector,
        'openpose': lambda: constant(tmp_path / 'n.onnx', {'heat': HEAT, 'field': FIELD}),
        'simcc': lambda: simcc_of_spots(tmp_path / 'n.onnx')}[kind]()
    with pytest.raises(DepthPersonError, match=r'is no \(height, width, 3\) uint8'):
        opened(path, detector=detector)(image)


def test_an_image_of_one_pixel_has_nobody_in_it(tmp_path):
    path = constant(tmp_path / 'n.onnx', {'heat': HEAT, 'field': FIELD})
    assert opened(path)(np.zeros((1, 1, 3), np.uint8)).shape == (0, 18, 3)


def test_landmarks_that_are_no_numbers_are_one_error(tmp_path):
    path = blazepose_of_spots(tmp_path / 'blaze.onnx')
    network = opened(path, detector=str(rtmo_of_seen(tmp_path / 'rtmo.onnx')))
    # Without spots every centre of mass is 0/0.
    with pytest.raises(DepthPersonError, match=r'output Identity of .* holds NaN or infinity'):
        network(np.zeros((480, 640, 3), np.uint8))


def rtmo_of_seen(path):
    """Write an RTMO that sees one person in whatever it is given."""
    marks = np.full((1, 1, 17, 3), 0.9, np.float32)
    marks[..., :2] = np.arange(34).reshape(17, 2) * 5
    return constant(
        path, {'dets': np.float32([[[0, 0, 200, 200, 0.9]]]), 'keypoints': marks},
        shape=(1, 3, 640, 640))


def test_a_tensor_that_the_network_cannot_take_is_one_error(tmp_path):
    graph = Graph(rtmo_of_spots(tmp_path / 'rtmo.onnx'))
    said = r'rtmo\.onnx does not run on a tensor \(1, 3, 8, 8\)'
    with pytest.raises(DepthPersonError, match=said) as caught:
        graph.run(np.zeros((1, 3, 8, 8), np.float32), ('dets',))
    assert 'provider' not in str(caught.value)


def test_a_movenet_that_fails_at_a_run_is_one_error(network, monkeypatch):
    """As of a graphics card whose memory is full."""
    movenet = open_network(PoseOptions(model=str(network('movenet-lightning'))))

    def fail(*_):
        raise RuntimeError('out of memory')
    monkeypatch.setattr(onnxruntime.InferenceSession, 'run', fail)
    monkeypatch.setattr(runtime.Session, 'get_providers', lambda _: ['CUDAExecutionProvider'])
    said = r'model\.onnx does not run .*: out of memory; it may run with provider: cpu'
    with pytest.raises(DepthPersonError, match=said):
        movenet(np.zeros((480, 640, 3), np.uint8))


def test_a_provider_that_is_not_here_falls_back_with_a_warning():
    options, warning = settled(PoseOptions(provider='cuda'))
    assert options.provider == 'cpu'
    assert "runs on the CPU, slower: ONNX Runtime has no provider 'cuda' here" in warning


def test_a_provider_that_is_not_here_is_refused_if_the_cpu_may_not_stand_in():
    with pytest.raises(DepthPersonError, match='allow the CPU with provider_fallback: true'):
        settled(PoseOptions(provider='openvino', provider_fallback=False))


def test_the_cpu_needs_no_warning():
    options = PoseOptions()
    assert settled(options) == (options, '')


@pytest.fixture
def listed(monkeypatch):
    """Let ONNX Runtime say that it has a provider whose libraries are not there."""
    runtime._usable.cache_clear()
    monkeypatch.setattr(onnxruntime, 'get_available_providers', lambda: [
        'TensorrtExecutionProvider', 'CUDAExecutionProvider', 'CPUExecutionProvider'])
    yield
    runtime._usable.cache_clear()


@pytest.mark.usefixtures('listed')
@pytest.mark.parametrize('provider', ['tensorrt', 'cuda'])
def test_a_provider_whose_libraries_do_not_load_falls_back_too(provider):
    options, warning = settled(PoseOptions(provider=provider))
    assert options.provider == 'cpu'
    assert f"libraries of ONNX Runtime's provider '{provider}' do not load" in warning


class _Session(runtime.Session):
    """A session of an ONNX Runtime whose provider 'openvino' runs the smallest network only."""

    fault: str | None = None
    asked: ClassVar[list[object]] = []

    def __init__(self, network, options, providers, **kwargs):
        self.asked.append(providers[0])
        self._wanted = providers[0] if isinstance(providers[0], str) else providers[0][0]
        self._small = isinstance(network, bytes)
        if self._wanted != 'CPUExecutionProvider' and not self._small and self.fault:
            raise RuntimeError(self.fault)
        super().__init__(network, options, ['CPUExecutionProvider'], **kwargs)

    def get_providers(self):
        return [self._wanted] if self._small else super().get_providers()


@pytest.fixture
def fails_on_large(monkeypatch):
    """Let a provider be there that fails on all networks but the smallest."""
    runtime._usable.cache_clear()
    monkeypatch.setattr(onnxruntime, 'get_available_providers', lambda: [
        'OpenVINOExecutionProvider', 'CPUExecutionProvider'])
    monkeypatch.setattr(runtime, 'Session', _Session)
    yield
    runtime._usable.cache_clear()


@pytest.mark.usefixtures('fails_on_large')
@pytest.mark.parametrize('fault', ['no kernel for Resize', None])
def test_a_network_that_the_provider_cannot_run_is_refused(tmp_path, monkeypatch, fault):
    monkeypatch.setattr(_Session, 'fault', fault)  # None: it is left out without a word
    path = rtmo_of_spots(tmp_path / 'rtmo.onnx')
    said = fault or 'left OpenVINOExecutionProvider out'
    with pytest.raises(DepthPersonError, match=f"'openvino' cannot run .*{said}; choose another"):
        opened(path, provider='openvino')


@pytest.mark.usefixtures('fails_on_large')
def test_a_provider_that_loads_but_does_not_run_falls_back_too(monkeypatch):
    def fail(*_):
        raise DepthPersonError('no kernel image for this device')
    monkeypatch.setattr(_Session, 'run', fail)
    options, warning = settled(PoseOptions(provider='openvino'))
    assert options.provider == 'cpu'
    assert 'do not load or run here' in warning


@pytest.mark.usefixtures('fails_on_large')
def test_openvino_is_told_how_many_threads_it_may_have(tmp_path, monkeypatch):
    monkeypatch.setattr(_Session, 'asked', [])
    with pytest.raises(DepthPersonError):
        opened(rtmo_of_spots(tmp_path / 'rtmo.onnx'), provider='openvino', threads=1)
    assert ('OpenVINOExecutionProvider', {'num_of_threads': '1'}) in _Session.asked


@pytest.mark.usefixtures('fails_on_large')
def test_a_damaged_file_is_not_blamed_on_the_provider(tmp_path):
    path = tmp_path / 'net.onnx'
    path.write_bytes(b'no network')
    with pytest.raises(DepthPersonError, match='the file may be damaged'):
        opened(path, provider='openvino')


def test_more_threads_than_any_machine_has_are_refused(tmp_path):
    with pytest.raises(DepthPersonError, match='threads 100000 is not from 0 to 256'):
        opened(rtmo_of_spots(tmp_path / 'rtmo.onnx'), threads=100_000)


@pytest.mark.parametrize(('option', 'value'), [
    ('pixel_order', 'gbr'), ('pixel_values', '0..1'), ('provider', 'gpu')])
def test_options_that_nothing_is_called_are_refused(option, value):
    with pytest.raises(DepthPersonError, match=f"unknown {option} '{value}'; choose"):
        PoseOptions(**{option: value})
