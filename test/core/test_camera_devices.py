"""V4L2 cameras without one: what is asked of the driver, and what is said when it refuses."""
import errno
import logging
import os
import threading

import cv2
import numpy as np
import pytest

from depth_person.camera import devices
from depth_person.camera.devices import DeviceOptions
from depth_person.camera.source import SourceUnusable
from depth_person.camera.sources import open_source
from depth_person.errors import DepthPersonError
from depth_person.settings.camera import CameraSettings

MJPG = 0x47504A4D  # little-endian letters


class FakeV4L2:
    """A capture that has these properties and takes changes of some."""

    def __init__(self, properties=(), fixed=(), opened=True):
        self.properties = dict(properties)
        self.asked = []
        self._fixed, self._opened = fixed, opened
        self._released = threading.Event()

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self._opened

    def set(self, prop, value):
        self.asked.append((prop, value))
        if prop not in self._fixed:
            self.properties[prop] = value
        return True

    def get(self, prop):
        return self.properties.get(prop, 0.0)

    def grab(self):
        return not self._released.wait(0.01)

    def retrieve(self):
        return True, np.zeros((4, 4, 3), np.uint8)

    def release(self):
        self._released.set()


@pytest.fixture
def camera(tmp_path, monkeypatch):
    """Return a function that puts a fake behind a device, whose path it returns."""
    device = tmp_path / 'video0'
    device.touch()

    def put(capture, capabilities=0x04200001):
        monkeypatch.setattr(devices, 'open_capture', lambda source, backend: capture)
        monkeypatch.setattr(devices, '_query_capabilities', lambda path: capabilities)
        return str(device)
    return put


def open_device(device, timeout_s=20.0, **options):
    return devices.open_device(device, options=DeviceOptions(**options), frame_id='eye',
                               clock=lambda: 0, timeout_s=timeout_s)


def test_a_camera_is_asked_for_all_that_is_wished_the_format_first(camera, caplog):
    fake = FakeV4L2()

    with open_device(camera(fake), size=(1280, 720), pixel_format='MJPG', fps=30.0,
                     exposure_ms=5.0, gain=12.0) as source:
        assert source.read().image.shape == (4, 4, 3)

    assert fake.asked == [
        (cv2.CAP_PROP_BUFFERSIZE, 2), (cv2.CAP_PROP_FOURCC, MJPG),
        (cv2.CAP_PROP_FRAME_WIDTH, 1280), (cv2.CAP_PROP_FRAME_HEIGHT, 720),
        (cv2.CAP_PROP_FPS, 30.0), (cv2.CAP_PROP_AUTO_EXPOSURE, 1), (cv2.CAP_PROP_EXPOSURE, 50),
        (cv2.CAP_PROP_GAIN, 12.0)]
    assert not caplog.records


@pytest.mark.parametrize(('options', 'asked'), [
    ({}, []),
    ({'exposure_ms': 0.0}, [(cv2.CAP_PROP_AUTO_EXPOSURE, 3)]),
    ({'exposure_ms': 0.01}, [(cv2.CAP_PROP_AUTO_EXPOSURE, 1), (cv2.CAP_PROP_EXPOSURE, 1)]),
])
def test_what_is_not_wished_is_left_alone(camera, options, asked):
    fake = FakeV4L2()
    open_device(camera(fake), **options).close()
    assert fake.asked[1:] == asked


def test_what_a_camera_does_not_take_is_said_once_with_what_it_has(camera, caplog):
    fake = FakeV4L2(
        {cv2.CAP_PROP_FRAME_WIDTH: 640, cv2.CAP_PROP_FOURCC: 0x56595559},
        fixed=(cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FOURCC))

    with caplog.at_level(logging.WARNING):
        open_device(camera(fake), size=(1280, 720), pixel_format='MJPG').close()

    assert len(caplog.records) == 1
    assert 'does not take format MJPG (gives YUYV); width 1280 (has 640 for 1280)' in caplog.text
    assert 'v4l2-ctl' in caplog.text


def test_a_width_that_changes_only_with_the_height_is_taken(camera, caplog):
    """OpenCV does it so."""
    class Together(FakeV4L2):
        def set(self, prop, value):
            size = (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
            if prop == size[1]:
                self.properties = {size[0]: self.width, size[1]: value}
            self.width = value

    open_device(camera(Together()), size=(1280, 720)).close()
    assert not caplog.records


def test_a_busy_camera_may_become_free(camera):
    device = camera(FakeV4L2(opened=False))

    with pytest.raises(DepthPersonError, match=r'video0 is busy: another program') as caught:
        open_device(device)

    assert not isinstance(caught.value, SourceUnusable)


def test_a_node_of_a_camera_that_gives_no_images_is_refused(camera):
    with pytest.raises(SourceUnusable, match='gives no images'):
        open_device(camera(FakeV4L2(), capabilities=0x04a00000))  # metadata, as UVC has


@pytest.mark.parametrize(('number', 'kind', 'said'), [
    (errno.EACCES, SourceUnusable, 'no permission to use .*; add your user to the group video'),
    (errno.ENOTTY, SourceUnusable, 'is no camera'),
    (errno.EBUSY, DepthPersonError, 'cannot be opened: Device or resource busy'),
    (errno.ENODEV, DepthPersonError, 'cannot be opened: No such device'),
])
def test_what_the_kernel_refuses_is_said_in_words(camera, monkeypatch, number, kind, said):
    device = camera(FakeV4L2())

    def refuse(path):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(devices, '_query_capabilities', refuse)
    with pytest.raises(DepthPersonError, match=said) as caught:
        open_device(device)
    assert type(caught.value) is kind


def test_a_missing_camera_is_answered_with_a_list_of_those_there_are(tmp_path, monkeypatch):
    for name, title in (('video0', 'HD Pro Webcam C920'), ('video2', 'Integrated Camera')):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'name').write_text(title + '\n')
    monkeypatch.setattr(devices, '_CLASS', tmp_path)

    with pytest.raises(DepthPersonError) as caught:
        open_source('7')

    assert str(caught.value) == (
        'there is no camera /dev/video7; there are /dev/video0 (HD Pro Webcam C920), /dev/video2 '
        '(Integrated Camera)')


def test_a_driver_that_hangs_while_it_opens_is_given_up(camera, monkeypatch):
    fake, go_on = FakeV4L2(), threading.Event()
    device = camera(fake)
    monkeypatch.setattr(devices, 'OPEN_TIMEOUT_S', 0.1)

    def hang(source, backend):
        go_on.wait(10)
        return fake

    monkeypatch.setattr(devices, 'open_capture', hang)
    with pytest.raises(DepthPersonError, match=r'has not opened within 0\.1 s'):
        open_device(device)
    go_on.set()
    assert fake._released.wait(5)  # the late capture must not keep the camera


@pytest.mark.parametrize(('options', 'said'), [
    ({'pixel_format': 'MPEG4'}, 'not four letters'),
    ({'pixel_format': 'abc\n'}, 'not four letters'),
    ({'size': (0, 480)}, '0x480 px is none'),
])
def test_impossible_wishes_are_refused(options, said):
    with pytest.raises(DepthPersonError, match=said):
        DeviceOptions(**options)


def test_parameters_become_wishes():
    settings = CameraSettings(
        size='1280x720', pixel_format='MJPG', fps=30.0, exposure=-1.0, gain=0.0)
    assert settings.device_options() == DeviceOptions(
        size=(1280, 720), pixel_format='MJPG', fps=30.0, exposure_ms=0.0, gain=0.0)
    assert CameraSettings().device_options() == DeviceOptions()


@pytest.mark.parametrize('size', ['large', '1280', '1280*720', '-1x5', '0x480'])
def test_a_size_that_is_none_is_refused(size):
    with pytest.raises(DepthPersonError, match='size'):
        CameraSettings(size=size)
