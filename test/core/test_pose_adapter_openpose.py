"""Peaks are found between the cells, and joined to the people that were drawn."""
from __future__ import annotations

from drawn_fields import BODY_25, COCO, DrawnFields, figure
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from pose_graphs import constant
import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose.heatmaps import find_peaks
from depth_person.pose.networks import open_network
from depth_person.pose.openpose import BODY25, COCO18
from depth_person.pose.options import PoseOptions
from depth_person.pose.paf import group

STRIDE = 8


@settings(max_examples=40)
@given(x=st.floats(2, 17), y=st.floats(2, 13), score=st.floats(0.3, 1))
def test_a_peak_is_found_where_it_is_between_the_cells(x, y, score):
    maps = DrawnFields(COCO, 16, 20)
    maps.mark(4, x, y, score)
    peaks = find_peaks(maps.heat, min_score=0.1)
    assert peaks.maps.tolist() == [4]
    np.testing.assert_allclose(peaks.points, [[x, y]], atol=0.01)
    # The highest cell is up to half a cell from the peak, in x and in y.
    assert 0.7 * score < peaks.scores[0] <= score + 1e-6


def test_a_peak_exactly_between_cells_is_one_peak():
    maps = DrawnFields(COCO, 12, 12)
    maps.mark(0, 5.5, 6.5, 0.8)
    np.testing.assert_allclose(find_peaks(maps.heat, min_score=0.1).points, [[5.5, 6.5]])


@pytest.mark.parametrize(('x', 'y'), [(0, 0), (11, 0), (0, 9), (11, 9), (5, 0)])
def test_a_peak_at_the_edge_stays_inside(x, y):
    maps = DrawnFields(COCO, 10, 12)
    maps.mark(0, x, y, 0.8)
    np.testing.assert_allclose(find_peaks(maps.heat, min_score=0.1).points, [[x, y]], atol=1e-4)


@pytest.mark.parametrize('shape', [(1, 1, 3), (1, 9, 3), (2, 2, 3)])
def test_maps_too_small_to_look_between_cells_have_peaks(shape):
    heat = np.zeros(shape, np.float32)
    heat[-1, -1, 2] = 0.5
    peaks = find_peaks(heat, min_score=0.1)
    assert (peaks.maps.tolist(), peaks.points.tolist()) == (
        [2], [[shape[1] - 1, shape[0] - 1]])


def test_only_the_highest_peaks_of_a_map_are_kept():
    noise = np.random.default_rng(1).random((40, 40, 2), np.float32)
    peaks = find_peaks(noise, min_score=0.1, per_map=5)
    assert peaks.maps.tolist() == [0] * 5 + [1] * 5
    assert (np.diff(peaks.scores[:5]) <= 0).all()
    assert peaks.scores[0] == noise[..., 0].max()


def skeletons(maps, *, layout=COCO18):
    """Return the people (n, 18, 2) that are joined in maps, in cells."""
    peaks = find_peaks(maps.heat[..., :layout.n_parts], min_score=0.1)
    people = group(peaks, maps.field, layout.limbs, n_maps=layout.n_parts)[:, layout.rows]
    points = np.concatenate([peaks.points, [[np.nan, np.nan]]])
    return points[people]


def assert_same_people(found, drawn, *, atol=0.05):
    assert len(found) == len(drawn)
    for person in drawn:
        apart = [np.nanmax(np.abs(each - person)) + 9 * (
            np.isnan(each) != np.isnan(person)).any() for each in found]
        assert min(apart) < atol


@pytest.mark.parametrize(('drawing', 'layout'), [(COCO, COCO18), (BODY_25, BODY25)])
@pytest.mark.parametrize('places', [
    [(12, 6)],
    [(10, 6), (30, 6)],
    [(12, 6), (15.3, 6.8)],  # one person's shoulder behind the other's neck
    [(12, 6), (14.2, 7.4)],
    [(8 + 6 * column, 5 + 22 * row) for column in range(10) for row in range(2)],
])
def test_people_are_joined_as_they_were_drawn(drawing, layout, places):
    maps = DrawnFields(drawing, 48, 72)
    drawn = [maps.draw(figure(*place)) for place in places]
    # Marks and fields of overlapping people are drawn over each other: half a cell may be lost.
    assert_same_people(skeletons(maps, layout=layout), drawn, atol=0.5)


@settings(max_examples=5)
@given(seed=st.integers(0, 10_000))
def test_people_anywhere_apart_are_joined_as_they_were_drawn(seed):
    random = np.random.default_rng(seed)
    maps = DrawnFields(COCO, 60, 80)
    places = np.array([[x, y] for x in (12, 32, 52, 70) for y in (8, 36)])
    places = places + random.uniform(-2, 2, places.shape)
    drawn = [maps.draw(figure(*place, scale=random.uniform(0.6, 1.1))) for place in places]
    assert_same_people(skeletons(maps), drawn)


def test_limbs_go_to_whom_the_field_points_and_not_to_the_nearer():
    maps = DrawnFields(COCO, 30, 40)
    first, second = figure(12, 6), figure(17, 6)
    # Each one's right wrist hangs from the other's elbow.
    first[4], second[4] = second[4] - (0.6, 0), first[4] + (0.6, 0)
    drawn = [maps.draw(first), maps.draw(second)]
    assert_same_people(skeletons(maps), drawn, atol=0.3)


def test_a_field_that_points_the_wrong_way_joins_nothing():
    maps = DrawnFields(COCO, 30, 30)
    maps.draw(figure(12, 6), missing=range(5, 18))
    maps.field *= -1
    assert skeletons(maps).shape == (0, 18, 2)


def test_missing_keypoints_leave_the_others_of_a_person_together():
    maps = DrawnFields(COCO, 30, 40)
    drawn = [maps.draw(figure(12, 6), missing=(3, 4, 10, 14)),
             maps.draw(figure(26, 6), missing=range(2, 14))]  # the head only
    assert_same_people(skeletons(maps), drawn)


def test_the_surest_person_comes_first():
    maps = DrawnFields(COCO, 30, 60)
    for place, score in ((10, 0.4), (28, 0.8), (46, 0.6)):
        maps.draw(figure(place, 6), score=score)
    necks = skeletons(maps)[:, 1, 0]
    np.testing.assert_allclose(necks, [28, 46, 10], atol=0.01)


def channels_first(array):
    return np.ascontiguousarray(array.transpose(2, 0, 1)[None])


def written(path, maps, form):
    """Write a network that gives the maps in one of the forms that exports have."""
    rows, columns = maps.heat.shape[:2]
    nchw, nhwc = (1, 3, rows * STRIDE, columns * STRIDE), (1, rows * STRIDE, columns * STRIDE, 3)
    both = np.concatenate([maps.heat, maps.field], 2)
    if form == 'one, channels last':
        return constant(path, {'out': both[None]}, shape=nhwc)
    if form == 'one, fields first':
        maps.heat[..., -1] = 1 - maps.heat[..., :-1].max(2)  # the background
        turned = np.concatenate([maps.field, maps.heat], 2)
        return constant(path, {'out': turned[None]}, shape=nhwc)
    if form == 'one, channels first':
        return constant(path, {'out': channels_first(both)}, shape=nchw)
    if form == 'two':
        return constant(path, {
            'L1': channels_first(maps.field), 'L2': channels_first(maps.heat)}, shape=nchw)
    return constant(path, {
        'heat1': channels_first(maps.heat * 0), 'paf1': channels_first(maps.field * 0),
        'heat2': channels_first(maps.heat), 'paf2': channels_first(maps.field)}, shape=nchw)


@pytest.mark.parametrize('drawing', [COCO, BODY_25])
@pytest.mark.parametrize('form', [
    'one, channels last', 'one, fields first', 'one, channels first', 'two', 'stages'])
def test_two_overlapping_people_come_in_raw_pixels_from_every_form_of_output(
        tmp_path, drawing, form):
    maps = DrawnFields(drawing, 30, 40)
    drawn = [maps.draw(figure(*place)) for place in ((12, 6), (15.3, 6.8))]
    network = open_network(PoseOptions(model=str(written(tmp_path / 'n.onnx', maps, form))))
    found = network(np.zeros((480, 640, 3), np.uint8))  # twice the input's size
    # The middle of cell c is pixel 8 c + 3.5 of the input, and of pixel i of it 2 i + 0.5.
    raw = [2 * (STRIDE * person + 3.5) + 0.5 for person in drawn]
    assert_same_people(found[..., :2], raw, atol=0.5 * 2 * STRIDE)
    assert network.neck_measured
    assert network.convention == 'openpose'
    assert found.dtype == np.float32
    assert np.nanmax(found[..., 2]) <= 1


def test_outputs_that_could_be_read_either_way_are_laid_out_as_the_input(tmp_path):
    maps = DrawnFields(COCO, 57, 30)
    drawn = maps.draw(figure(12, 6))
    path = written(tmp_path / 'n.onnx', maps, 'one, channels last')
    found = open_network(PoseOptions(model=str(path)))(np.zeros((456, 240, 3), np.uint8))
    np.testing.assert_allclose(found[0, :, :2], STRIDE * drawn + 3.5, atol=0.1)


def test_heads_of_different_sizes_are_refused(tmp_path):
    path = constant(tmp_path / 'n.onnx', {
        'heat': np.zeros((1, 19, 8, 8), np.float32), 'paf': np.zeros((1, 38, 16, 16), np.float32)})
    with pytest.raises(DepthPersonError, match='heat maps and fields should be of one size'):
        open_network(PoseOptions(model=str(path)))


def test_a_person_alone_comes_to_a_tenth_of_a_pixel(tmp_path):
    maps = DrawnFields(COCO, 30, 40)
    drawn = maps.draw(figure(12, 6))
    network = open_network(PoseOptions(model=str(written(tmp_path / 'n.onnx', maps, 'two'))))
    found = network(np.zeros((480, 640, 3), np.uint8))
    np.testing.assert_allclose(
        found[0, :, :2], 2 * (STRIDE * drawn + 3.5) + 0.5, atol=0.1)


def test_nan_in_the_maps_is_one_error(tmp_path):
    maps = DrawnFields(COCO, 8, 8)
    maps.heat[3, 3, 3] = np.nan
    path = written(tmp_path / 'n.onnx', maps, 'two')
    network = open_network(PoseOptions(model=str(path)))
    with pytest.raises(DepthPersonError, match=r'output L2 of .*n\.onnx holds NaN or infinity'):
        network(np.zeros((64, 64, 3), np.uint8))
