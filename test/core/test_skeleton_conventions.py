from average_body import average_body
import numpy as np
import pytest

from depth_person.distance.conventions import CONVENTIONS, N_FIGURES, place, Placement
from depth_person.pose.skeleton import Keypoint as Row


def placed(**figures):
    return place(average_body()[None], Placement(**figures).as_array()[None])[0]


def length(body, first, second):
    return np.linalg.norm(body[first] - body[second])


@pytest.mark.parametrize(('figures', 'pair', 'ratio'), [
    ({'shoulder_width': np.log(0.9)}, (Row.L_SHOULDER, Row.R_SHOULDER), 0.9),
    ({'hip_width': np.log(1.2)}, (Row.L_HIP, Row.R_HIP), 1.2),
    ({'face_size': np.log(0.8)}, (Row.L_EAR, Row.R_EAR), 0.8),
    ({'ankle_drop': -0.05}, (Row.L_KNEE, Row.L_ANKLE), 0.95),
    ({'shoulder_drop': 0.1}, (Row.L_SHOULDER, Row.R_SHOULDER), 1.0),
])
def test_a_figure_changes_its_length_by_its_ratio(figures, pair, ratio):
    assert length(placed(**figures), *pair) == pytest.approx(ratio * length(average_body(), *pair))


@pytest.mark.parametrize(('figures', 'ratio'), [
    ({'shoulder_drop': 0.1}, 0.9), ({'hip_drop': 0.1}, 1.1), ({'hip_drop': -0.02}, 0.98)])
def test_drops_change_the_torso_by_their_part_of_it(figures, ratio):
    def torso(body):
        return np.linalg.norm(
            body[[Row.L_SHOULDER, Row.R_SHOULDER]].mean(0) - body[[Row.L_HIP, Row.R_HIP]].mean(0))

    assert torso(placed(**figures)) == pytest.approx(ratio * torso(average_body()))


def test_the_mesh_is_its_own_convention_and_the_neck_stays_between_the_shoulders():
    np.testing.assert_array_equal(placed(), average_body())
    body = placed(shoulder_width=-0.2, shoulder_drop=0.05)
    np.testing.assert_allclose(
        body[Row.NECK], body[[Row.L_SHOULDER, Row.R_SHOULDER]].mean(axis=0))
    assert Placement().as_array().shape == (N_FIGURES,)


@pytest.mark.parametrize('name', CONVENTIONS)
def test_keypoints_are_less_sure_with_a_lower_score_more_pixels_and_from_nearer(name):
    def spread(score, rad_per_px=1e-3, guess=5.0):
        noise = CONVENTIONS[name].noise_rad(
            np.full((1, 18), score), rad_per_px=np.array([rad_per_px]), guess=np.array([guess]))
        assert noise.shape == (1, 18)
        return noise[0, 0]

    scores = [spread(score) for score in (0.05, 0.1, 0.3, 0.6, 1.0)]
    assert scores == sorted(scores, reverse=True)
    assert spread(0.3) > spread(0.6)
    assert spread(0.6, rad_per_px=2e-3) > spread(0.6)
    assert spread(0.6, guess=2.0) > spread(0.6)


def test_the_mesh_convention_means_a_pixel():
    noise = CONVENTIONS['mesh'].noise_rad(
        np.ones((1, 18)), rad_per_px=np.array([1e-3]), guess=np.array([1e6]))
    np.testing.assert_allclose(noise, 1e-3)
