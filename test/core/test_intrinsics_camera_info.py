"""What CameraInfo messages of real drivers hold, and what becomes of it."""
import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

K = (700.0, 0.0, 320.0, 0.0, 710.0, 240.0, 0.0, 0.0, 1.0)
FIVE = (-0.3, 0.1, 0.001, -0.002, 0.05)
EIGHT = (*FIVE, 0.2, 0.3, 0.4)


def convert(model, d, k=K):
    return Intrinsics.from_camera_info_fields(640, 480, model, np.array(d), np.array(k))


@pytest.mark.parametrize(('model', 'd', 'expected'), [
    ('plumb_bob', FIVE, ('plumb_bob', FIVE)),
    ('plumb_bob', FIVE[:4], ('plumb_bob', (*FIVE[:4], 0.0))),
    ('plumb_bob', (), ('plumb_bob', (0.0,) * 5)),
    ('plumb_bob', (*FIVE, 0.0, 0.0, 0.0), ('plumb_bob', FIVE)),
    ('rational_polynomial', EIGHT, ('rational_polynomial', EIGHT)),
    ('rational_polynomial', (*EIGHT, 0, 0, 0, 0), ('rational_polynomial', EIGHT)),
    ('rational_polynomial', (*EIGHT, 0, 0, 0, 0, 0, 0), ('rational_polynomial', EIGHT)),
    ('rational_polynomial', FIVE, ('rational_polynomial', (*FIVE, 0.0, 0.0, 0.0))),
    ('equidistant', FIVE[:4], ('equidistant', FIVE[:4])),
    ('equidistant', (), ('equidistant', (0.0,) * 4)),
    ('fisheye', FIVE[:4], ('equidistant', FIVE[:4])),
    ('', (), ('plumb_bob', (0.0,) * 5)),
    ('', (0.0,) * 4, ('plumb_bob', (0.0,) * 5)),
    ('none', (0.0,) * 5, ('plumb_bob', (0.0,) * 5)),
])
def test_models_and_coefficients_are_understood(model, d, expected):
    intrinsics = convert(model, d)

    assert (intrinsics.distortion_model, intrinsics.distortion) == expected
    assert (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy) == (700, 710, 320, 240)
    assert (intrinsics.width, intrinsics.height) == (640, 480)


def test_an_uncalibrated_camera_has_no_intrinsics():
    assert convert('plumb_bob', (), k=np.zeros(9)) is None
    assert convert('', (), k=np.zeros(9)) is None


@pytest.mark.parametrize(('model', 'd', 'k', 'message'), [
    ('plumb_bob', (*FIVE, 0.1, 0.0, 0.0), K, 'plumb_bob takes 5 coefficients, not 8'),
    ('rational_polynomial', (*EIGHT, 0, 0, 0, 0.1), K, 'takes 8 coefficients, not 12'),
    ('equidistant', FIVE, K, 'takes 4 coefficients, not 5'),
    ('', FIVE, K, 'without a distortion_model'),
    ('thin_prism', FIVE, K, "unknown distortion model 'thin_prism'"),
    ('plumb_bob', (np.nan, 0, 0, 0, 0), K, 'NaN'),
    ('plumb_bob', FIVE, (np.nan, *K[1:]), 'NaN'),
    ('plumb_bob', FIVE, (-700.0, *K[1:]), 'not positive'),
    ('plumb_bob', FIVE, (*K[:4], 0.0, *K[5:]), 'not positive'),
    ('plumb_bob', FIVE, K[:8], '8 values, not 9'),
])
def test_what_cannot_belong_to_a_camera_is_refused(model, d, k, message):
    with pytest.raises(DepthPersonError, match=message):
        convert(model, d, k)


def test_a_camera_info_without_a_size_is_refused():
    with pytest.raises(DepthPersonError, match='a size must be given'):
        Intrinsics.from_camera_info_fields(0, 0, 'plumb_bob', FIVE, K)
