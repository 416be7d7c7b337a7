"""Who is nearest, who is the target, and where the target is on the vehicle."""
import numpy as np
import pytest
from vehicle_scene import CAMERA, Scene, standing

from depth_person.autopilot.choice import (
    checked_choice,
    chosen_person,
    nearest_person,
    target_of,
)
from depth_person.errors import DepthPersonError

PEOPLE = ((-15, 6.0, 0.0), (2, 9.0, 0.0), (12, 5.0, 0.0))


@pytest.mark.parametrize(('choice', 'unknown', 'row'), [
    ('nearest', [], 2), ('nearest', [2], 0), ('nearest', [0, 1, 2], None),
    ('center', [], 1), ('center', [1], 2), ('0', [], 0), ('2', [], 2), ('2', [2], None),
    ('7', [], None), ('', [], None)])
def test_who_is_chosen(choice, unknown, row):
    tracked = Scene().tracked(*PEOPLE, unknown=unknown)
    assert chosen_person(tracked, checked_choice(choice), CAMERA) == row


def test_the_nearest_is_by_range_not_by_depth():
    tracked = Scene().tracked((30, 5.0, 0.0), (0, 4.8, 0.0))
    assert tracked.distances.depth[0] < tracked.distances.depth[1]
    assert nearest_person(tracked) == 1


@pytest.mark.parametrize('wrong', ['middle', '-1', '3.0', 'Nearest', '²'])
def test_a_choice_that_is_none(wrong):
    with pytest.raises(DepthPersonError, match='is not nearest, center'):
        checked_choice(wrong)


@pytest.mark.parametrize('scene', [
    Scene(), Scene(look_down=30), Scene(look_right=-90, camera_at=(0.3, -0.2, 0.1)),
    Scene(look_down=20, look_right=40, camera_at=(0.3, 0.2, -0.1))])
def test_a_target_is_in_the_vehicles_frame(scene):
    tracked = scene.tracked((10, 6.0, 1.0), sigma=0.4)
    forward, right, down = standing(10, 6.0, 1.0)[1]
    target = target_of(tracked, 0, scene.camera)
    assert target.track_id == 0
    assert target.position == pytest.approx((forward, -right, -down))


def test_the_covariance_is_long_along_the_ray_and_nowhere_else():
    scene = Scene(look_down=25, look_right=15)
    target = target_of(scene.tracked((20, 8.0, 2.0), sigma=0.5), 0, scene.camera)
    spreads, axes = np.linalg.eigh(target.covariance)
    assert np.sqrt(spreads[2]) == pytest.approx(0.5)
    ray = target.position / np.linalg.norm(target.position)
    assert abs(axes[:, 2] @ ray) == pytest.approx(1.0)
    assert np.sqrt(spreads[:2]) == pytest.approx(np.hypot(0.05, 0.01 * np.hypot(8, 2)), rel=1e-6)
