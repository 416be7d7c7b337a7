"""Projection and its inverse, against OpenCV and against each other."""
import warnings

import cv2
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.camera.intrinsics import Intrinsics
from depth_person.errors import DepthPersonError

# Lenses as calibrations give them, from mild to wide.
LENSES = {
    'none': ('plumb_bob', (0.0, 0.0, 0.0, 0.0, 0.0)),
    'webcam': ('plumb_bob', (0.05, -0.12, 0.001, -0.0005, 0.02)),
    'barrel': ('plumb_bob', (-0.3, 0.1, 0.001, -0.0005, 0.02)),
    'pincushion': ('plumb_bob', (0.2, 0.05, -0.001, 0.001, 0.01)),
    'rational': ('rational_polynomial', (2.1, 0.8, 3e-4, -2e-4, 0.03, 2.4, 1.3, 0.18)),
    'fisheye': ('equidistant', (-0.03, 0.01, -0.005, 0.001)),
}
# Folds at 0.80 of the focal length, inside the image.
FOLDING = ('plumb_bob', (-0.35, 0.0, 0.0, 0.0, 0.0))

pixels = st.tuples(st.floats(0, 1279), st.floats(0, 719))


def camera(lens: str | tuple[str, tuple[float, ...]]) -> Intrinsics:
    model, distortion = LENSES[lens] if isinstance(lens, str) else lens
    return Intrinsics(1280, 720, 700.0, 690.0, 645.0, 350.0, model, distortion)


def opencv_projection(intrinsics: Intrinsics, points: np.ndarray) -> np.ndarray:
    module = cv2.fisheye if intrinsics.distortion_model == 'equidistant' else cv2
    found, _ = module.projectPoints(
        points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), intrinsics.matrix,
        np.array(intrinsics.distortion))
    return found.reshape(-1, 2)


@pytest.mark.parametrize('lens', LENSES)
def test_projection_agrees_with_opencv(lens):
    points = np.random.default_rng(1).uniform((-2, -1, 2), (2, 1, 4), (200, 3))

    found = camera(lens).project(points)

    np.testing.assert_allclose(found, opencv_projection(camera(lens), points), atol=1e-9)


@pytest.mark.parametrize('lens', LENSES)
@given(pixel=pixels)
def test_rays_of_pixels_project_back_onto_them(lens, pixel):
    ray = camera(lens).undistort(pixel)

    back = opencv_projection(camera(lens), np.array([[*ray, 1.0]]))[0]

    np.testing.assert_allclose(back, pixel, atol=1e-6)


@pytest.mark.parametrize('lens', LENSES)
@given(x=st.floats(-0.8, 0.8), y=st.floats(-0.5, 0.5), z=st.floats(0.1, 100.0))
def test_points_are_found_again_from_their_pixels(lens, x, y, z):
    pixel = camera(lens).project((x * z, y * z, z))

    np.testing.assert_allclose(camera(lens).undistort(pixel), (x, y), atol=1e-8)


@pytest.mark.parametrize('lens', LENSES)
def test_missing_keypoints_stay_missing_without_a_warning(lens):
    wild = [(np.nan, np.nan), (np.nan, 100.0), (np.inf, 0.0), (5.0, -np.inf)]

    with warnings.catch_warnings():
        warnings.simplefilter('error')
        rays = camera(lens).undistort([*wild, (645.0, 350.0)])

    assert np.isnan(rays[:4]).any(axis=1).all()
    np.testing.assert_array_equal(rays[4], (0, 0))


@pytest.mark.parametrize('lens', [*LENSES, FOLDING])
@given(pixel=st.tuples(st.floats(), st.floats()))
def test_whatever_pixel_gives_a_true_ray_or_none(lens, pixel):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        ray = camera(lens).undistort(pixel)

    if np.isfinite(ray).all():
        back = camera(lens).project((*ray, 1.0))
        np.testing.assert_allclose(back, pixel, rtol=1e-9, atol=1e-5)


def test_pixels_beyond_the_fold_of_a_lens_have_no_ray():
    lens = camera(FOLDING)
    fold = 2 / 3 / np.sqrt(3 * 0.35)  # where r (1 - 0.35 r^2) is largest
    radii = np.array([0.5, 0.99, 1.01, 1.5]) * fold

    rays = lens.undistort(np.column_stack((645 + 700 * radii, np.full(4, 350.0))))

    np.testing.assert_array_equal(np.isnan(rays[:, 0]), [False, False, True, True])


# The second also rises again far out, and is not quite round.
@pytest.mark.parametrize('distortion', [
    FOLDING[1], (-0.35, 0.02, 0.003, -0.003, 0.0), (-0.4, 0.05, 0.003, 0.003, 0.01),
])
def test_near_the_fold_of_a_lens_only_rays_from_before_it_are_found(distortion):
    lens = camera(('plumb_bob', distortion))
    radius, angle = np.meshgrid(np.linspace(350, 750, 500), np.linspace(0, 2 * np.pi, 20))
    pixels = np.stack((645 + radius * np.cos(angle), 350 + radius * np.sin(angle)), axis=-1)

    rays = lens.undistort(pixels)

    rays = rays[np.isfinite(rays).all(axis=-1)]
    assert len(rays) > 2_000
    right, down = (
        lens.project(np.column_stack((rays + 1e-7 * np.array(step), np.ones(len(rays))))) -
        lens.project(np.column_stack((rays, np.ones(len(rays))))) for step in ((1, 0), (0, 1)))
    assert (right[:, 0] * down[:, 1] > right[:, 1] * down[:, 0]).all(), 'mirrored'
    assert np.hypot(*rays.T).max() < 1.4


def test_an_equidistant_camera_has_no_ray_behind_it():
    lens = Intrinsics(1000, 1000, 300.0, 300.0, 499.5, 499.5, 'equidistant', (0.0,) * 4)
    angles = np.radians([10.0, 80.0, 89.9, 91.0])

    rays = lens.undistort(np.column_stack((499.5 + 300 * angles, np.full(4, 499.5))))

    np.testing.assert_allclose(rays[:3, 0], np.tan(angles[:3]), rtol=1e-9)
    assert np.isnan(rays[3]).all()


def test_points_behind_the_camera_have_no_pixel():
    assert np.isnan(camera('barrel').project([(0.1, 0.1, -1.0), (0.1, 0.1, 0.0)])).all()


@pytest.mark.parametrize('shape', [(2,), (0, 2), (0, 18, 2), (3, 18, 2)])
@pytest.mark.parametrize('lens', ['none', 'barrel', 'fisheye'])
def test_shapes_are_kept(lens, shape):
    assert camera(lens).undistort(np.full(shape, 300.0)).shape == shape
    assert camera(lens).project(np.ones((*shape[:-1], 3))).shape == shape


@given(pixel=pixels, scale=st.sampled_from([0.25, 0.5, 2.0]),
       lens=st.sampled_from(list(LENSES)))
def test_a_scaled_camera_sees_the_same_rays(lens, pixel, scale):
    original = camera(lens)
    small = original.scaled(width=round(1280 * scale), height=round(720 * scale))
    # The corner of the image, half a pixel before the first centre, stays where it is.
    resized = (np.array(pixel) + 0.5) * scale - 0.5

    np.testing.assert_allclose(small.undistort(resized), original.undistort(pixel), atol=1e-8)
    assert (small.width, small.height) == (1280 * scale, 720 * scale)


@given(degrees=st.floats(5, 170), width=st.integers(16, 4000))
def test_a_field_of_view_spans_the_image_from_edge_to_edge(degrees, width):
    lens = Intrinsics.from_horizontal_fov(degrees, width=width, height=480)

    edges = lens.undistort([(-0.5, 239.5), (width - 0.5, 239.5)])

    seen = np.degrees(np.arctan(edges[1, 0]) - np.arctan(edges[0, 0]))
    assert seen == pytest.approx(degrees)
    np.testing.assert_allclose(edges[:, 1], 0, atol=1e-12)


@pytest.mark.parametrize('degrees', [0.0, -60.0, 180.0, float('nan')])
def test_an_impossible_field_of_view_is_refused(degrees):
    with pytest.raises(DepthPersonError, match='field of view'):
        Intrinsics.from_horizontal_fov(degrees, width=640, height=480)
