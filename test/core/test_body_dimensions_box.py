from average_body import CAMERA, seen, standing_at
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.body_box import (
    angle_boxes,
    ANGLE_FEATURES,
    MISSING,
    pixel_boxes,
    usable,
)
from depth_person.distance.conventions import CONVENTIONS, place, Placement
from depth_person.pose.skeleton import Keypoint

NO_GRAVITY = np.full((1, 3), np.nan)
ADULTS = np.array([False])
MESH = Placement()


def in_angles(points, *, gravity=NO_GRAVITY, placement=MESH, known=None):
    """Return the boxes of keypoints (n, 18, 3) in the camera's frame."""
    points = np.reshape(points, (-1, 18, 3))
    return angle_boxes(
        points[..., :2] / points[..., 2:],
        np.ones(points.shape[:2], bool) if known is None else known,
        gravity=gravity, placement=placement, children=ADULTS)


def feature(boxes, name):
    return boxes.features[0, ANGLE_FEATURES.index(name)]


def marked(**places):
    """Return one person's keypoints (1, 18, 3), those named, with score 1."""
    keypoints = np.full((1, 18, 3), np.nan, np.float32)
    for name, place_ in places.items():
        keypoints[0, Keypoint[name]] = (*place_, 1.0)
    return keypoints


def test_a_box_in_pixels_reaches_from_crown_to_soles():
    # 200 px from face to ankles: the crown is 16.6 px above, the soles 14 px below.
    boxes = pixel_boxes(marked(
        NOSE=(60, 104), R_EYE=(58, 96), R_WRIST=(40, 200), L_WRIST=(90, 190),
        R_ANKLE=(55, 302), L_ANKLE=(66, 298)))
    assert boxes[0] == pytest.approx([230.6, 50 + 0.05 * 230.6, 65.0, (83.4 + 314.0) / 2])


@pytest.mark.parametrize('places', [
    {'NOSE': (60, 100), 'R_HIP': (60, 200)}, {'R_ANKLE': (60, 300), 'R_HIP': (60, 200)},
    {'NOSE': (60, 300), 'R_ANKLE': (60, 100)}, {}])
def test_without_face_or_ankle_or_upside_down_there_is_no_box_in_pixels(places):
    assert np.isnan(pixel_boxes(marked(**places))).all()


def test_unsure_keypoints_are_left_out():
    keypoints = marked(NOSE=(60, 100), R_ANKLE=(60, 300), R_WRIST=(500, 200))
    keypoints[0, Keypoint.R_WRIST, 2] = 0.05
    assert not usable(keypoints)[0, Keypoint.R_WRIST]
    assert pixel_boxes(keypoints)[0, 1] == pytest.approx(0.05 * 1.153 * 200)


angles = st.floats(-3.0, 3.0)


@given(x=angles, y=st.floats(-0.6, 0.6), roll=angles, yaw=angles)
@settings(max_examples=50)
def test_turning_and_rolling_the_camera_changes_no_box_in_angles(x, y, roll, yaw):
    points = standing_at((0, 0.3, 6.0), yaw_deg=np.degrees(yaw))
    cos, sin = np.cos([0.3 * x, y, roll]), np.sin([0.3 * x, y, roll])
    turn = (np.array([[cos[2], -sin[2], 0], [sin[2], cos[2], 0], [0, 0, 1]])
            @ np.array([[1, 0, 0], [0, cos[1], -sin[1]], [0, sin[1], cos[1]]])
            @ np.array([[cos[0], 0, sin[0]], [0, 1, 0], [-sin[0], 0, cos[0]]]))
    straight, turned = in_angles(points), in_angles(points @ turn.T)
    assert turned.features == pytest.approx(straight.features, abs=1e-9)
    assert turned.neck == pytest.approx(straight.neck @ turn.T, abs=1e-9)


def test_twice_as_far_is_half_the_height_and_otherwise_the_same():
    near, far = (in_angles(standing_at((0, 0.5, depth), yaw_deg=30)) for depth in (20.0, 40.0))
    assert far.height / near.height == pytest.approx(0.5, rel=5e-3)
    scale_free = [i for i, name in enumerate(ANGLE_FEATURES) if name != 'height_rad']
    assert far.features[0, scale_free] == pytest.approx(near.features[0, scale_free], abs=6e-3)


def test_the_height_is_the_stature_over_the_distance():
    boxes = in_angles(standing_at((0, 0.5, 30.0)))
    face_to_ankles = 1.27 + np.mean([0.183, 0.216, 0.216, 0.196, 0.196])
    assert boxes.height[0] * 30.0 == pytest.approx(1.153 * face_to_ankles, rel=0.01)
    assert feature(boxes, 'shoulder_width') == pytest.approx(
        0.336 / (1.153 * face_to_ankles), rel=0.01)


@pytest.mark.parametrize('down_deg', [-10, 0, 25, 60])
def test_gravity_tells_how_steeply_the_camera_looks_down(down_deg):
    pitch = np.radians(down_deg)
    gravity = np.array([[0, np.cos(pitch), np.sin(pitch)]])
    boxes = in_angles(standing_at((0, -0.55, 12.0)), gravity=gravity)
    assert feature(boxes, 'elevation_rad') == pytest.approx(pitch, abs=0.02)
    assert feature(in_angles(standing_at((0, 0, 12.0))), 'elevation_rad') == MISSING


def test_what_hidden_joints_would_tell_is_missing_and_nothing_else():
    known = np.ones((1, 18), bool)
    known[:, [Keypoint.R_KNEE, Keypoint.L_KNEE, Keypoint.R_EAR]] = False
    features = in_angles(standing_at((0, 0.5, 8.0)), known=known).features[0]
    missing = {name for name, value in zip(ANGLE_FEATURES, features, strict=True)
               if value == MISSING}
    assert missing == {'knee_level', 'ear_width', 'elevation_rad'}


@pytest.mark.parametrize('name', CONVENTIONS)
def test_the_convention_of_a_network_is_undone(name):
    placement = CONVENTIONS[name].placement
    mesh = standing_at((0, 0.3, 9.0))[None]
    as_marked = place(mesh, placement.as_array()[None])
    undone, truth = in_angles(as_marked, placement=placement), in_angles(mesh)
    columns = [ANGLE_FEATURES.index(column) for column in (
        'height_rad', 'shoulder_level', 'hip_level', 'knee_level', 'shoulder_width', 'hip_width',
        'ear_width', 'nose_level')]
    assert undone.features[0, columns] == pytest.approx(truth.features[0, columns], abs=2e-3)
    if placement.ankle_drop < -0.02:
        assert in_angles(as_marked).height[0] < 0.99 * truth.height[0]


def test_both_boxes_agree_before_an_upright_camera():
    points = standing_at((0.0, 0.55, 15.0))
    height_px, width_px, _, _ = pixel_boxes(seen(points).keypoints)[0]
    boxes = in_angles(points)
    assert height_px / CAMERA.fy == pytest.approx(boxes.height[0], rel=0.01)
    assert np.log(width_px / height_px) == pytest.approx(feature(boxes, 'log_aspect'), abs=0.01)
