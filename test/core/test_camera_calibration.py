"""Calibration files as camera_calibration writes them, and as they should not be."""
from dataclasses import replace
import os
import stat

import pytest
import yaml

from depth_person.camera.calibration import load_camera_info, resolve_url, save_camera_info
from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

# As camera_calibration's cameracalibrator.py saves it, but for shorter numbers.
TEXT = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [535.1, 0.   , 318.4,
         0.   , 536.2, 242.7,
         0.   , 0.   , 1.   ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.27, 0.06, 0.001, -0.0002, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0.,
         0., 1., 0.,
         0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [480.1, 0.   , 317.2, 0.   ,
         0.   , 510.2, 243.8, 0.   ,
         0.   , 0.   , 1.   , 0.   ]
"""
INTRINSICS = Intrinsics(
    640, 480, 535.1, 536.2, 318.4, 242.7, 'plumb_bob', (-0.27, 0.06, 0.001, -0.0002, 0.0))


@pytest.fixture
def calibration(tmp_path):
    path = tmp_path / 'camera.yaml'
    path.write_text(TEXT)
    return path


def test_a_file_of_camera_calibration_is_read(calibration):
    assert load_camera_info(str(calibration)) == ('narrow_stereo', INTRINSICS)


@pytest.mark.parametrize('intrinsics', [
    INTRINSICS,
    Intrinsics(1280, 720, 1 / 3 * 1000, 333.0, 639.5, 359.5),
    replace(INTRINSICS, distortion_model='equidistant', distortion=(1e-5, -1e-17, 0.1, 0.0)),
    replace(INTRINSICS, distortion_model='rational_polynomial', distortion=(0.1,) * 8),
])
def test_what_is_saved_is_loaded_again_to_the_last_digit(tmp_path, intrinsics):
    path = tmp_path / 'new folder' / 'front camera.yaml'

    save_camera_info(path, 'front', intrinsics)

    assert load_camera_info(path.as_uri()) == ('front', intrinsics)


def test_a_saved_file_has_every_key_that_other_tools_read(tmp_path):
    save_camera_info(tmp_path / 'a.yaml', 'front', INTRINSICS)

    written = yaml.safe_load((tmp_path / 'a.yaml').read_text())

    assert list(written) == list(yaml.safe_load(TEXT))
    assert written['projection_matrix'] == {
        'rows': 3, 'cols': 4,
        'data': [535.1, 0.0, 318.4, 0.0, 0.0, 536.2, 242.7, 0.0, 0.0, 0.0, 1.0, 0.0]}
    assert stat.S_IMODE((tmp_path / 'a.yaml').stat().st_mode) == 0o666 & ~current_umask()


def current_umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_failed_save_leaves_the_old_file_and_nothing_else(calibration, monkeypatch):
    def full_disk(descriptor):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'fsync', full_disk)

    with pytest.raises(DepthPersonError, match=r'cannot write .*camera\.yaml.*No space left'):
        save_camera_info(calibration, 'new', INTRINSICS)

    assert calibration.read_text() == TEXT
    assert list(calibration.parent.iterdir()) == [calibration]


def test_a_file_without_a_name_takes_the_name_asked_for(tmp_path):
    (tmp_path / 'a.yaml').write_text(TEXT.replace('camera_name: narrow_stereo\n', ''))

    name, _ = load_camera_info(str(tmp_path / 'a.yaml'), camera_name='left')

    assert name == 'left'


def test_urls_name_files(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('HOME', '/home/someone')

    def resolved(url):
        return str(resolve_url(url, camera_name='front'))

    assert resolved('/data/camera.yaml') == '/data/camera.yaml'
    assert resolved('~/camera.yaml') == '/home/someone/camera.yaml'
    assert resolved('file:///data/a%20b.yaml') == '/data/a b.yaml'
    assert resolved('file://${ROS_HOME}/camera_info/${NAME}.yaml') == \
        f'{tmp_path}/camera_info/front.yaml'
    monkeypatch.delenv('ROS_HOME')
    assert resolved('${ROS_HOME}/a.yaml') == '/home/someone/.ros/a.yaml'


def test_package_urls_are_found_where_ament_installs(tmp_path, monkeypatch):
    marker = tmp_path / 'share/ament_index/resource_index/packages/my_cameras'
    marker.parent.mkdir(parents=True)
    marker.touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}')

    found = resolve_url('package://my_cameras/config/front.yaml')

    assert found == tmp_path / 'share/my_cameras/config/front.yaml'
    with pytest.raises(DepthPersonError, match='package other is not found in AMENT_PREFIX_PATH'):
        resolve_url('package://other/config/front.yaml')


@pytest.mark.parametrize(('url', 'message'), [
    ('', 'is empty'),
    ('http://host/camera.yaml', 'cannot be opened; calibrations come from'),
    ('file://camera.yaml', 'no absolute path'),
    ('package://alone', 'incomplete'),
    ('file://${HOME}/a.yaml', r'\$\{HOME\}.*not known'),
])
def test_other_urls_are_refused(url, message):
    with pytest.raises(DepthPersonError, match=message):
        resolve_url(url)


@pytest.mark.parametrize(('old', 'new', 'message'), [
    ('image_width: 640', '', 'image_width must be a positive whole number, not None'),
    ('image_height: 480', 'image_height: -480', 'image_height must be a positive'),
    ('image_height: 480', 'image_height: tall', 'image_height must be a positive'),
    ('camera_matrix:', 'other_matrix:', 'camera_matrix is missing'),
    ('  data: [535.1', '  numbers: [535.1', 'camera_matrix is missing or lacks'),
    ('535.1', '.nan', 'camera_matrix holds NaN'),
    ('535.1', 'wide', 'camera_matrix holds something that is no number'),
    ('535.1', '0.', 'not been calibrated'),
    ('535.1, 0.   ,', '535.1,', 'camera_matrix must be 3x3, but says 3x3 with 8 values'),
    ('distortion_model: plumb_bob', '', 'distortion_model is missing'),
    ('plumb_bob', 'spherical', "unknown distortion model 'spherical'"),
    ('  cols: 5', '  cols: 4', 'distortion_coefficients must be 1x4.* with 5 values'),
    ('[-0.27', '[.inf', 'distortion_coefficients holds NaN or infinity'),
    ('[1., 0., 0.,', '[1., 0.,', 'rectification_matrix must be 3x3'),
    ('  cols: 4', '  cols: 3', 'projection_matrix must be 3x4'),
    ('image_width: 640', 'image_width: [640', 'is not YAML'),
])
def test_faults_name_the_file_and_the_key(tmp_path, old, new, message):
    assert old in TEXT
    path = tmp_path / 'faulty.yaml'
    path.write_text(TEXT.replace(old, new, 1))

    with pytest.raises(DepthPersonError, match=r'faulty\.yaml.*' + message) as caught:
        load_camera_info(str(path))

    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'just words', b'\xff\xfe\x00\x81', b'\x00\x01\x02'])
def test_files_of_another_kind_are_refused(tmp_path, content):
    path = tmp_path / 'faulty.yaml'
    path.write_bytes(content)

    with pytest.raises(DepthPersonError, match=r'faulty\.yaml'):
        load_camera_info(str(path))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DepthPersonError, match=r'gone\.yaml cannot be read: .*No such file'):
        load_camera_info(str(tmp_path / 'gone.yaml'))
