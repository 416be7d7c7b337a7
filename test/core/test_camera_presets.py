"""Presets: modes, not names, and a source for each number."""
import math

import pytest

from depth_person.camera.calibration import load_camera_info
from depth_person.camera.presets import load_preset, preset_names, preset_uncertainty
from depth_person.errors import DepthPersonError


def degrees(pixels, focal_length):
    return 2 * math.degrees(math.atan(pixels / 2 / focal_length))


@pytest.mark.parametrize(('name', 'across', 'down'), [
    # What the makers state for the whole sensor, by another road than the presets take.
    ('raspberry_pi_camera_1/2592x1944', 53.50, 41.41),
    ('raspberry_pi_camera_2/1640x1232', 62.2, 48.8),
    ('raspberry_pi_camera_3/2304x1296', 66.0, 41.0),
    ('raspberry_pi_ai_camera/2028x1520', 66.0, 52.3),
    ('oak_d_color/4056x3040', 66.0, 54.0),
    ('realsense_d435_color/1920x1080', 69.4, 42.5),
])
def test_fields_of_view_are_those_of_the_data_sheets(name, across, down):
    _, intrinsics = load_preset(name)
    tolerance = preset_uncertainty(name)
    assert degrees(intrinsics.width, intrinsics.fx) == pytest.approx(across, rel=tolerance)
    assert degrees(intrinsics.height, intrinsics.fy) == pytest.approx(down, rel=tolerance)


@pytest.mark.parametrize(('name', 'focal_length'), [
    # What two units say of themselves (librealsense issues 4050, 8689), and one drone's owner.
    ('realsense_d435_color/640x480', 612.4),
    ('realsense_d435_color/640x480', 607.3),
    ('realsense_d435_color/424x240', 306.2),
    ('dji_tello/960x720', 921.2),
])
def test_focal_lengths_agree_with_units_that_were_calibrated(name, focal_length):
    _, intrinsics = load_preset(name)
    assert intrinsics.fx == pytest.approx(focal_length, rel=preset_uncertainty(name))


def test_a_cropped_mode_has_its_own_field_of_view():
    """The whole sensor at half its resolution, and its middle at full, have about one width."""
    _, whole = load_preset('raspberry_pi_camera_2/1640x1232')
    _, cropped = load_preset('raspberry_pi_camera_2/1920x1080')
    assert degrees(whole.width, whole.fx) > 1.5 * degrees(cropped.width, cropped.fx)


def test_every_preset_is_of_its_size_square_and_centred():
    for name in preset_names():
        _, intrinsics = load_preset(name)
        width, height = map(int, name.partition('/')[2].split('x'))
        assert (intrinsics.width, intrinsics.height) == (width, height)
        assert intrinsics.fx == pytest.approx(intrinsics.fy, rel=0.01)
        assert (intrinsics.cx, intrinsics.cy) == ((width - 1) / 2, (height - 1) / 2)
        assert 0 < preset_uncertainty(name) < 0.1


def test_a_preset_is_loaded_by_url():
    name, intrinsics = load_camera_info('preset://logitech_c920/1280x720')
    assert name == 'Logitech C920'
    # 78 degrees over a diagonal of 1468.6 px.
    assert intrinsics.fx == pytest.approx(1468.6 / 2 / math.tan(math.radians(39)), abs=0.1)


@pytest.mark.parametrize(('url', 'said'), [
    ('preset://gopro/1920x1080', "no preset for camera 'gopro'; there are dji_tello, "),
    ('preset://logitech_c920/1x1', "has no mode '1x1'; it has 1920x1080, 1280x720"),
    ('preset://logitech_c920', "has no mode ''"),
    ('preset://../presets/dji_tello/960x720', "no preset for camera '..'"),
])
def test_a_preset_that_is_none_is_answered_with_those_there_are(url, said):
    with pytest.raises(DepthPersonError, match=said):
        load_camera_info(url)
