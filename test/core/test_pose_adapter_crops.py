"""RTMO, RTMPose and BlazePose see the right pixels, and their marks come back to raw ones."""
from __future__ import annotations

import numpy as np
from pose_graphs import blazepose_of_spots, constant, rtmo_of_spots, simcc_of_spots, SPOTS, spotted
import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose.blazepose import BlazePose
from depth_person.pose.graph import Graph
from depth_person.pose.networks import open_network
from depth_person.pose.options import PoseOptions
from depth_person.pose.simcc import SimCC
from depth_person.pose.skeleton import from_coco17, Keypoint
from depth_person.pose.topdown import TopDown
from depth_person.pose.warps import crop_matrices, fitted_size, letterbox_matrix, to_raw


def coco17_of(points):
    """Return COCO-18 keypoints of which COCO-17's keypoint k lies at points[k % 3]."""
    marks = np.ones((1, 17, 3))
    marks[0, :, :2] = np.asarray(points)[np.arange(17) % 3]
    return from_coco17(marks)[0]


def people_at(*centres, scale=1.0, turned=0.0):
    """Return people about points, 200 px tall at scale 1, turned clockwise by degrees."""
    upright = np.array([
        [0, -90], [12, -60], [-12, -60], [16, 0], [-16, 0]]) * scale
    angle = np.radians(turned)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    people = np.full((len(centres), 18, 3), np.nan, np.float32)
    rows = [Keypoint.NOSE, Keypoint.L_SHOULDER, Keypoint.R_SHOULDER, Keypoint.L_HIP,
            Keypoint.R_HIP]
    for person, centre in zip(people, centres, strict=True):
        person[rows, :2] = upright @ turn.T + centre
        person[rows, 2] = 0.8
    return people


@pytest.mark.parametrize(('width', 'height'), [(1280, 720), (720, 1280), (640, 640)])
def test_rtmo_marks_spots_where_they_are(tmp_path, width, height):
    scale = np.array([width, height]) / (1280, 720)
    spots = SPOTS * scale
    network = open_network(PoseOptions(model=str(rtmo_of_spots(tmp_path / 'rtmo.onnx'))))
    found = network(spotted(width, height, spots))
    # It takes blue, green, red, so channel 0 is the first spot.
    np.testing.assert_allclose(found[0, :, :2], coco17_of(spots)[:, :2], atol=0.15)
    assert found.shape == (1, 18, 3)
    assert not network.neck_measured
    assert 0 < network.inference_s < 60


def test_rtmo_takes_colours_in_the_order_that_the_user_says(tmp_path):
    network = open_network(PoseOptions(
        model=str(rtmo_of_spots(tmp_path / 'rtmo.onnx')), pixel_order='rgb'))
    np.testing.assert_allclose(
        network(spotted())[0, :, :2], coco17_of(SPOTS[::-1])[:, :2], atol=0.15)


def rtmo_of(path, dets, scores=0.9):
    """Write an RTMO that gives boxes, keypoint k at (100 b + 10 k, 20) of box b."""
    marks = np.zeros((1, len(dets), 17, 3), np.float32)
    marks[..., 0] = 100 * np.arange(len(dets))[:, None] + 10 * np.arange(17)
    marks[..., 1], marks[..., 2] = 20, scores
    return constant(path, {'dets': np.float32([dets]), 'keypoints': marks},
                    shape=(1, 3, 640, 640))


def test_rtmo_without_its_last_step_counts_nobody_twice(tmp_path):
    path = rtmo_of(tmp_path / 'rtmo.onnx', [
        [0, 0, 100, 200, 0.5], [2, 1, 101, 202, 0.7], [300, 0, 400, 200, 0.9],
        [0, 0, 90, 100, 0.05]])
    found = open_network(PoseOptions(model=str(path)))(np.zeros((640, 640, 3), np.uint8))
    np.testing.assert_allclose(found[:, Keypoint.NOSE, 0], [200, 100], atol=1e-3)


def test_rtmo_that_finds_nobody_gives_nobody(tmp_path):
    path = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 0, 0, 0]])
    found = open_network(PoseOptions(model=str(path)))(np.zeros((640, 640, 3), np.uint8))
    assert found.shape == (0, 18, 3)


def test_rtmo_guesses_are_missing(tmp_path):
    scores = np.full(17, 0.9)
    scores[5] = 0.1
    path = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 100, 200, 0.5]], scores)
    found = open_network(PoseOptions(model=str(path)))(np.zeros((640, 640, 3), np.uint8))[0]
    assert np.isnan(found[[Keypoint.L_SHOULDER, Keypoint.NECK]]).all()
    assert np.isfinite(np.delete(found, [Keypoint.L_SHOULDER, Keypoint.NECK], 0)).all()


def test_rtmo_keeps_somebody_of_whom_only_the_head_shows(tmp_path):
    scores = np.where(np.arange(17) < 5, 0.6, 0.1)  # nose, eyes, ears
    path = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 50, 60, 0.5]], scores)
    found = open_network(PoseOptions(model=str(path)))(np.zeros((640, 640, 3), np.uint8))
    assert np.flatnonzero(np.isfinite(found[0, :, 2])).tolist() == [
        Keypoint.NOSE, Keypoint.R_EYE, Keypoint.L_EYE, Keypoint.R_EAR, Keypoint.L_EAR]


def test_rtmo_keeps_people_apart_who_overlap_by_half(tmp_path):
    path = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 100, 200, 0.5], [30, 0, 130, 200, 0.7]])
    found = open_network(PoseOptions(model=str(path)))(np.zeros((640, 640, 3), np.uint8))
    np.testing.assert_allclose(found[:, Keypoint.NOSE, 0], [100, 0], atol=1e-3)
    np.testing.assert_allclose(found[:, Keypoint.R_ANKLE, 0], [260, 160], atol=1e-3)


@pytest.mark.parametrize('batch', ['batch', 1])
@pytest.mark.parametrize('scale', [2.0, 3.5])
def test_rtmpose_marks_spots_on_the_crop_of_each_person(tmp_path, batch, scale):
    network = SimCC(
        Graph(simcc_of_spots(tmp_path / 'rtm.onnx', batch=batch)), PoseOptions())
    hips = np.array([[940, 480], [320, 420]])
    middles = hips - (0, 45 * scale)
    spots = [(SPOTS - SPOTS.mean(0)) * 0.3 * scale * turn + middle
             for middle, turn in zip(middles, (1, -1), strict=True)]
    found = network(spotted(spots=spots[0]) + spotted(spots=spots[1]),
                    people_at(*hips, scale=scale))
    for person, points in zip(found, spots, strict=True):
        # Red, green and blue: channel 0 is the last spot.
        np.testing.assert_allclose(
            person[:, :2], coco17_of(points[::-1])[:, :2], atol=0.2)
    assert (found[..., 2] > 0.95).all()  # a Gaussian's highest bin


@pytest.mark.parametrize(('keypoints', 'measured'), [(17, False), (26, True), (133, False)])
def test_a_neck_of_the_layout_is_taken(tmp_path, keypoints, measured):
    network = SimCC(
        Graph(simcc_of_spots(tmp_path / 'rtm.onnx', keypoints=keypoints)), PoseOptions())
    assert network.neck_measured == measured
    found = network(spotted(), people_at((757, 458), scale=3))[0]
    # Halpe's neck is keypoint 18: that of the channel 0.
    expected = SPOTS[2] if measured else found[[Keypoint.R_SHOULDER, Keypoint.L_SHOULDER], :2
                                               ].mean(0)
    np.testing.assert_allclose(found[Keypoint.NECK, :2], expected, atol=0.3)


@pytest.mark.parametrize('order', ['rgb', 'bgr'])
def test_a_network_for_crops_marks_whom_the_detector_finds(tmp_path, order):
    options = PoseOptions(
        model=str(simcc_of_spots(tmp_path / 'rtm.onnx')), pixel_order=order,
        detector=str(rtmo_of_spots(tmp_path / 'rtmo.onnx')))
    network = open_network(options)
    found = network(spotted())
    spots = SPOTS if order == 'bgr' else SPOTS[::-1]
    np.testing.assert_allclose(found[0, :, :2], coco17_of(spots)[:, :2], atol=0.3)
    nobody = open_network(PoseOptions(
        model=options.model, detector=str(rtmo_of(tmp_path / 'no.onnx', [[0] * 5]))))
    assert nobody(spotted()).shape == (0, 18, 3)


def test_the_detector_takes_pixels_as_its_kind_does_whatever_is_said_of_the_model(tmp_path):
    # Told to scale pixels to one, an RTMO would see no spot.
    network = open_network(PoseOptions(
        model=str(simcc_of_spots(tmp_path / 'rtm.onnx', threshold=0.5)), pixel_values='unit',
        detector=str(rtmo_of_spots(tmp_path / 'rtmo.onnx'))))
    np.testing.assert_allclose(
        network(spotted())[0, :, :2], coco17_of(SPOTS[::-1])[:, :2], atol=0.3)


def test_two_crops_of_one_person_give_one(tmp_path):
    # Two boxes apart, so that the detector counts two; their crops show the same three spots.
    path = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 9, 9, 0.9], [50, 0, 59, 9, 0.8]])
    network = open_network(PoseOptions(
        model=str(simcc_of_spots(tmp_path / 'rtm.onnx')), detector=str(path)))
    spots = np.array([[180.0, 30.0], [150.0, 60.0], [200.0, 70.0]])
    assert len(network(spotted(640, 640, spots))) == 1


def test_a_network_for_crops_is_no_detector(tmp_path):
    path = str(simcc_of_spots(tmp_path / 'rtm.onnx'))
    with pytest.raises(DepthPersonError, match='marks people on crops, and finds none'):
        open_network(PoseOptions(model=path, detector=path))


@pytest.mark.parametrize('turned', [0, 35, -120, 180])
def test_blazepose_marks_spots_on_a_turned_crop(tmp_path, turned):
    network = BlazePose(Graph(blazepose_of_spots(tmp_path / 'blaze.onnx')), PoseOptions())
    people = people_at((760, 330), (100, 100), scale=1.5, turned=turned)
    found = network(spotted(), people[:1])[0]
    # Landmark k of BlazePose lies at the spot of channel k % 3, red first.
    by_channel = SPOTS[::-1]
    for row, landmark in ((Keypoint.NOSE, 0), (Keypoint.L_EYE, 2), (Keypoint.R_EYE, 5),
                          (Keypoint.L_EAR, 7), (Keypoint.R_EAR, 8), (Keypoint.L_SHOULDER, 11),
                          (Keypoint.R_SHOULDER, 12), (Keypoint.L_ELBOW, 13),
                          (Keypoint.R_WRIST, 16), (Keypoint.L_HIP, 23), (Keypoint.R_HIP, 24),
                          (Keypoint.L_KNEE, 25), (Keypoint.R_ANKLE, 28)):
        np.testing.assert_allclose(found[row, :2], by_channel[landmark % 3], atol=0.2)
    np.testing.assert_allclose(found[Keypoint.NOSE, 2], 1 / (1 + np.exp(-2)), atol=1e-4)


def landmarks(x, y, *, present=0.9):
    """Return outputs of a BlazePose with every landmark at one point of the crop."""
    marks = np.tile(np.float32([x, y, 0, 3, 3]), (1, 39))
    return {'ld_3d': marks, 'output_poseflag': np.float32([[present]])}


@pytest.mark.parametrize('turned', [0, 35, -120, 180])
def test_the_crop_is_turned_so_that_shoulders_are_above_hips(tmp_path, turned):
    path = constant(tmp_path / 'blaze.onnx', landmarks(128, 64), shape=(1, 256, 256, 3))
    network = BlazePose(Graph(path), PoseOptions())
    found = network(spotted(), people_at((600, 300), turned=turned))[0, Keypoint.NOSE, :2]
    way = found - (600, 300)
    np.testing.assert_allclose(
        way / np.hypot(*way), [np.sin(np.radians(turned)), -np.cos(np.radians(turned))],
        atol=1e-3)
    # The circle about the hips reaches a tenth beyond the nose, the crop a quarter beyond that.
    np.testing.assert_allclose(np.hypot(*way), 90 * 1.1 * 1.25 / 2, rtol=1e-3)


def test_someone_without_hips_is_cut_out_by_the_box(tmp_path):
    path = constant(tmp_path / 'blaze.onnx', landmarks(128, 128), shape=(1, 256, 256, 3))
    people = people_at((600, 300))
    people[:, [Keypoint.L_HIP, Keypoint.R_HIP]] = np.nan
    found = BlazePose(Graph(path), PoseOptions())(spotted(), people)[0]
    np.testing.assert_allclose(found[Keypoint.NOSE, :2], [600, 300 - 75], atol=0.01)


@pytest.mark.parametrize(('score', 'kept'), [(0.3, 0), (0.6, 1)])
def test_whom_blazepose_does_not_see_is_there_if_the_detector_is_sure(tmp_path, score, kept):
    path = constant(
        tmp_path / 'blaze.onnx', landmarks(128, 128, present=0.3), shape=(1, 256, 256, 3))
    detector = rtmo_of(tmp_path / 'rtmo.onnx', [[0, 0, 170, 40, 0.9]], score)
    found = open_network(PoseOptions(model=str(path), detector=str(detector)))(
        np.zeros((640, 640, 3), np.uint8))
    assert len(found) == kept
    if kept:
        np.testing.assert_allclose(found[0, Keypoint.R_ANKLE], [160, 20, score], atol=1e-3)


class Marker:
    """Marks people where it is told to, instead of on crops."""

    convention, inference_s = 'coco', 0.0

    def __init__(self, marked, *, neck_measured):
        self.marked, self.neck_measured = marked, neck_measured

    def __call__(self, image, people):
        return self.marked.copy()


def told(marked, people, *, neck_measured=False):
    """Return whom a network for crops gives that marks people as told."""
    def detector(image):
        return people.copy()
    detector.inference_s, detector.neck_measured = 0.0, False
    marker = Marker(marked, neck_measured=neck_measured)
    return TopDown(detector, marker, PoseOptions())(np.zeros((480, 640, 3), np.uint8))


def test_a_computed_neck_makes_no_person_of_two_shoulders():
    people = people_at((300, 200))
    people[..., 2] *= 0.4  # the detector is not sure
    marked = np.full_like(people, np.nan)
    rows = [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]
    marked[:, rows] = people[:, rows]
    marked[:, Keypoint.NECK] = people[:, rows].mean(1)
    marked[..., 2] = np.where(np.isfinite(marked[..., 0]), 0.9, np.nan)
    assert len(told(marked, people)) == 0
    marked[:, Keypoint.NOSE] = people[:, Keypoint.NOSE]
    assert len(told(marked, people)) == 1


def test_a_neck_that_the_detector_computed_does_not_pass_for_seen():
    people = people_at((100, 200))
    people[:, Keypoint.NECK] = people[:, [Keypoint.R_SHOULDER, Keypoint.L_SHOULDER]].mean(1)
    unseen = np.full_like(people, np.nan)
    assert np.isfinite(told(unseen, people)[0, Keypoint.NECK]).all()
    assert np.isnan(told(unseen, people, neck_measured=True)[0, Keypoint.NECK]).all()


def test_people_stay_in_the_order_of_the_detector():
    people = people_at((100, 200), (300, 200), (500, 200))
    marked = people.copy()
    marked[1] = np.nan  # as the detector has it
    np.testing.assert_allclose(told(marked, people), people)


def test_somebody_unseen_is_no_double_of_somebody_seen():
    people = people_at((100, 200), (300, 200))
    marked = people.copy()
    marked[0] = np.nan
    marked[1] = people[0]  # the second crop shows the first person
    np.testing.assert_allclose(told(marked, people), people[:1])


@pytest.mark.parametrize(('angle', 'point', 'expected'), [
    (0, (100, 200), (96, 128)),  # the centre, on the middle
    (0, (110, 200), (116, 128)),  # twice as large
    (90, (110, 200), (96, 148)),  # turned clockwise: what was right is below
    (90, (100, 190), (116, 128)),
])
def test_crops_are_cut_turned_and_scaled(angle, point, expected):
    matrices = crop_matrices(
        np.array([[100, 200]]), np.array([96]), (192, 256), angles=np.array([np.radians(angle)]))
    np.testing.assert_allclose(matrices[0] @ (*point, 1), expected, atol=1e-9)
    np.testing.assert_allclose(to_raw(matrices, np.array([[expected]])), [[point]], atol=1e-4)


def test_the_letterbox_maps_outer_corners_on_outer_corners():
    matrix = letterbox_matrix((1280, 720), (640, 640))
    np.testing.assert_allclose(matrix @ (-0.5, -0.5, 1), [-0.5, -0.5])
    np.testing.assert_allclose(matrix @ (1279.5, 719.5, 1), [639.5, 359.5])


@pytest.mark.parametrize(('raw', 'expected'), [
    ((1280, 720), (512, 288)), ((1000, 700), (512, 384)), ((7, 100), (64, 512)),
    ((1, 1), (512, 512))])
def test_an_input_of_any_size_holds_the_whole_image(raw, expected):
    assert fitted_size(raw, 512, step=32) == expected
