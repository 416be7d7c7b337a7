"""Which intrinsics a frame is given, and the size it is brought to."""
import numpy as np
import pytest

from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.optics import Optics, Uncalibrated
from depth_person.errors import DepthPersonError

#: A point one metre in front, half a metre to the right and a quarter down.
POINT = (0.5, 0.25, 1.0)


def make_frame(width, height, intrinsics=None):
    return Frame(np.zeros((height, width, 3), np.uint8), 0, 'eye', intrinsics)


def calibration(width, height):
    return Intrinsics(width, height, 0.8 * width, 0.81 * width, 0.51 * width, 0.49 * height,
                      distortion=(-0.2, 0.05, 0.001, -0.001, 0.0))


def given(optics, frame):
    """Return the frame as it is published."""
    height, width = frame.image.shape[:2]
    small = optics.shrink(frame)
    return small, optics.intrinsics(small, taken=(width, height))


def test_a_frame_is_scaled_down_and_its_intrinsics_with_it():
    known = calibration(1280, 720)

    frame, intrinsics = given(Optics(calibration=known, width=640), make_frame(1280, 720))

    assert frame.image.shape == (360, 640, 3)
    assert intrinsics.fits(frame.image)
    # The middle of the left upper pixel of four lies half a pixel further right and down.
    np.testing.assert_allclose(
        intrinsics.project(POINT), (known.project(POINT) + 0.5) / 2 - 0.5, atol=1e-9)


def test_pixels_go_where_the_intrinsics_say():
    image = np.zeros((720, 1280, 3), np.uint8)
    image[400:404, 800:804] = 255  # centre 801.5, 401.5
    frame = Optics(width=320).shrink(Frame(image, 0, 'eye'))
    v, u = np.argwhere(frame.image[..., 0] > 128).mean(axis=0)
    assert (u, v) == ((801.5 + 0.5) / 4 - 0.5, (401.5 + 0.5) / 4 - 0.5)


@pytest.mark.parametrize('width', [None, 1280, 4000])
def test_a_frame_that_is_narrow_enough_is_left_as_it_is(width):
    frame = make_frame(1280, 720)
    assert Optics(width=width).shrink(frame) is frame


def test_a_calibration_of_the_size_that_is_published_fits_as_it_is():
    known = calibration(640, 360)
    assert given(Optics(calibration=known, width=640), make_frame(1280, 720))[1] == known


def test_the_field_of_view_stays_that_of_the_camera():
    _, full = given(Optics(horizontal_fov=60.0), make_frame(1280, 720))
    _, small = given(Optics(horizontal_fov=60.0, width=320), make_frame(1280, 720))
    assert small.fx == pytest.approx(full.fx / 4)


def test_what_frames_bring_comes_last():
    own, known = calibration(640, 480), Intrinsics.from_horizontal_fov(50, width=640, height=480)
    assert given(Optics(), make_frame(640, 480, own))[1] == own
    assert given(Optics(horizontal_fov=50.0), make_frame(640, 480, own))[1] == known
    assert given(Optics(calibration=own, horizontal_fov=50.0), make_frame(640, 480))[1] == own
    assert given(Optics(width=320), make_frame(640, 480, own))[1] == own.scaled(
        width=320, height=240)


def test_nothing_known_is_said():
    with pytest.raises(Uncalibrated, match='set camera_info_url to a calibration file or a'):
        given(Optics(), make_frame(640, 480))


def test_another_size_is_an_error_unless_rescaling_is_asked_for():
    known = calibration(1920, 1080)

    said = r'for 1920x1080 px, the images have 1280x720; .*, or set rescale_calibration'
    with pytest.raises(DepthPersonError, match=said):
        given(Optics(calibration=known), make_frame(1280, 720))

    _, rescaled = given(Optics(calibration=known, rescale=True), make_frame(1280, 720))
    assert rescaled == known.scaled(width=1280, height=720)


def test_a_cropped_image_is_not_rescaled_even_if_asked_for():
    with pytest.raises(DepthPersonError, match='one of the two is cropped'):
        given(Optics(calibration=calibration(1920, 1080), rescale=True), make_frame(640, 480))
