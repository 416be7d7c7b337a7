import cv2
import numpy as np
import pytest

from depth_person.camera.deblur import motion_kernel, wiener_deblur
from depth_person.errors import DepthPersonError


def scene():
    """Return a picture with edges of every direction."""
    image = np.full((120, 160, 3), 90, np.uint8)
    cv2.circle(image, (60, 50), 25, (200, 60, 30), -1)
    cv2.rectangle(image, (95, 40), (140, 100), (30, 180, 220), -1)
    cv2.line(image, (10, 110), (150, 15), (250, 250, 250), 2)
    return image


def difference(a, b):
    return float(np.sqrt(np.mean((a.astype(float) - b.astype(float)) ** 2)))


@pytest.mark.parametrize('angle', [0, 90, 180])
def test_an_even_motion_along_an_axis_is_a_row_of_equal_weights(angle):
    kernel = motion_kernel(5, angle)
    row = kernel if angle % 180 == 0 else kernel.T
    middle = row.shape[0] // 2
    assert kernel.sum() == pytest.approx(1.0)
    assert row[middle].sum() == pytest.approx(1.0)
    inner = row[middle, middle - 1:middle + 2]
    assert inner == pytest.approx(np.full(3, inner[0]), rel=0.05)


@pytest.mark.parametrize(('length', 'angle'), [(1, 0), (7.5, 30), (20, -60), (31, 135)])
def test_a_kernel_has_its_length_direction_and_centre(length, angle):
    kernel = motion_kernel(length, angle)
    y, x = np.indices(kernel.shape) - kernel.shape[0] // 2
    assert kernel.sum() == pytest.approx(1.0)
    assert (kernel * x).sum() == pytest.approx(0, abs=1e-9)
    assert (kernel * y).sum() == pytest.approx(0, abs=1e-9)
    along = x * np.cos(np.radians(angle)) + y * np.sin(np.radians(angle))
    spread = np.sqrt((kernel * along ** 2).sum())
    # An even line of this length has a standard deviation of length / sqrt(12).
    assert spread == pytest.approx((length - 1) / np.sqrt(12), abs=0.5)


@pytest.mark.parametrize(('length', 'angle'), [(9, 0), (15, 40)])
def test_a_known_blur_is_mostly_undone(length, angle):
    image, kernel = scene(), motion_kernel(length, angle)
    soft = cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REFLECT_101)
    sharp = wiener_deblur(soft, kernel, noise_to_signal=1e-3)
    assert difference(sharp, image) < 0.5 * difference(soft, image)


def test_an_even_image_stays_as_it_is():
    image = np.full((50, 70, 3), (10, 128, 250), np.uint8)
    sharp = wiener_deblur(image, motion_kernel(9, 20), noise_to_signal=0.01)
    assert (sharp == image).all()


def test_more_noise_to_signal_amplifies_noise_less():
    rng = np.random.default_rng(1)
    noisy = np.clip(rng.normal(128, 5, (90, 90, 3)), 0, 255).astype(np.uint8)
    kernel = motion_kernel(9, 0)
    loud, quiet = (wiener_deblur(noisy, kernel, noise_to_signal=ratio).std()
                   for ratio in (1e-4, 0.1))
    assert quiet < 0.5 * loud


@pytest.mark.parametrize('length', [0.5, -3, float('nan'), float('inf')])
def test_what_blurs_nothing_is_refused(length):
    with pytest.raises(DepthPersonError, match='has to be 1 px or more'):
        motion_kernel(length, 0)


@pytest.mark.parametrize('ratio', [0, -0.1, float('nan'), float('inf')])
def test_a_noise_ratio_that_is_not_positive_is_refused(ratio):
    with pytest.raises(DepthPersonError, match='is not positive'):
        wiener_deblur(scene(), motion_kernel(5, 0), noise_to_signal=ratio)
