"""People through time: gaps, stamps, ids, the camera's motion, and what comes out of it."""
from dataclasses import replace

import numpy as np
import pytest

from depth_person.distance.estimator import Distances, Reason
from depth_person.distance.following import FilterOptions, PeopleFilter
from depth_person.distance.stage import DistanceOptions, DistanceStage
from depth_person.distance.tracked import CameraPose
from depth_person.errors import DepthPersonError
from depth_person.pose.people import People

START_NS = 1_700_000_000_000_000_000
SPREAD = 0.05


def people(*ids):
    return People(
        np.full((len(ids), 18, 3), 0.5, np.float32), np.array(ids, np.int32), convention='mesh')


def measured(places, spread=SPREAD, reason=Reason.NONE):
    places = np.reshape(np.array(places, float), (-1, 3))
    return Distances.of(
        position=places, range_sigma=spread * np.linalg.norm(places, axis=1),
        reason=np.full(len(places), reason, np.uint8), cues=np.full(len(places), 4, np.uint8))


class Scene:
    """A filter that is shown people at their places."""

    def __init__(self, **options):
        self.filter = PeopleFilter(FilterOptions(**options))

    def see(self, time_s, places, *, pose=None, spread=SPREAD):
        """Return the result for a frame; places by track id."""
        return self.filter.measure(
            people(*places), measured(list(places.values()), spread),
            stamp_ns=START_NS + round(time_s * 1e9), camera_pose=pose)

    def walk(self, where, until_s, *, rate=15.0, since_s=0.0):
        """Return the results while one person is at where(time); None is out of sight."""
        times = np.arange(round(since_s * rate), round(until_s * rate)) / rate
        return times, [
            self.see(time, {} if where(time) is None else {1: where(time)}) for time in times]


def ranges(results):
    return np.array([result.distances.range[0] for result in results])


def sigmas(results):
    return np.array([result.distances.range_sigma[0] for result in results])


def away(time):
    return (0.0, 0.0, 4.0 + 1.5 * time)


@pytest.mark.parametrize('rate', [5.0, 15.0, 30.0])
def test_a_steady_walk_is_followed_without_lag(rate):
    times, results = Scene().walk(away, 4.0, rate=rate)
    lag = (4.0 + 1.5 * times - ranges(results)) / 1.5
    assert np.abs(lag[times > 1]).max() < 0.1
    assert results[-1].velocity[0] == pytest.approx([0, 0, 1.5], abs=0.15)
    assert 0 < results[-1].velocity_sigma[0] < 1.0


def test_five_and_thirty_hertz_agree():
    def noisy(time):  # the same at the same time, whatever the rate
        return (0.0, 0.0, (4 + time) * (1 + 0.02 * np.sin(40 * time)))
    last = [Scene().walk(noisy, 4.0 + 1 / rate, rate=rate)[1][-1] for rate in (5.0, 30.0)]
    slow, fast = (result.distances for result in last)
    assert slow.range[0] == pytest.approx(fast.range[0], rel=0.02)
    assert slow.range_sigma[0] == pytest.approx(fast.range_sigma[0], rel=0.15)


def test_a_rate_that_falls_from_30_to_3_hertz_is_no_trouble():
    scene = Scene()
    scene.walk(away, 2.0, rate=30.0)
    times, results = scene.walk(away, 5.0, rate=3.0, since_s=2.0)
    assert not any(result.predicted[0] for result in results)
    assert ranges(results) == pytest.approx(4.0 + 1.5 * times, abs=0.1)


@pytest.mark.parametrize('seed', range(3))
def test_noise_is_taken_away_and_the_raw_values_stay(seed):
    random = np.random.default_rng(seed)
    truth = (1.0, 0.0, 5.0)
    _, results = Scene().walk(
        lambda time: np.multiply(truth, np.exp(0.03 * random.normal())), 4.0)
    raw = np.array([result.measured.range[0] for result in results[15:]])
    assert raw.std() / 5.1 > 0.02
    assert ranges(results[15:]).std() < 0.6 * raw.std()


def test_hidden_people_are_predicted_then_gone_and_rejoin_smoothly():
    def hiding(time):
        return None if 3.0 <= time < 3.8 else away(time)
    times, results = Scene().walk(hiding, 6.0)
    error = np.abs(ranges(results) - 4.0 - 1.5 * times)
    assert (error < 2 * sigmas(results)).all()
    hidden = (times >= 3.0) & (times < 3.8)
    assert [bool(result.predicted[0]) for result in results] == hidden.tolist()
    assert (np.diff(sigmas(results)[hidden]) > 0).all()
    assert np.abs(np.diff(ranges(results)) - 0.1).max() < 0.1
    assert np.isnan(results[50].people.keypoints).all()
    assert np.isnan(results[50].measured.range).all()
    assert results[50].people.track_ids.tolist() == [1]


@pytest.mark.parametrize('prediction_time', [0.0, 0.5, 2.0])
def test_prediction_ends_after_its_time(prediction_time):
    scene = Scene(prediction_time=prediction_time)
    scene.walk(away, 2.0, rate=10.0)
    counts = [len(scene.see(1.9 + age, {})) for age in np.arange(1, 31) / 10]
    assert counts == [1 if age / 10 <= prediction_time else 0 for age in range(1, 31)]


def test_nobody_ever_seen_predicts_nobody():
    assert len(Scene().see(0.0, {})) == 0


def test_one_outlier_changes_nothing_and_repeated_ones_begin_anew():
    scene = Scene()
    scene.walk(lambda time: (0, 0, 5.0), 2.0)
    lone = scene.see(2.0, {1: (0, 0, 12.0)})
    assert lone.predicted.tolist() == [True]
    assert lone.distances.range[0] == pytest.approx(5.0, abs=0.1)
    assert lone.measured.range[0] == 12.0
    _, results = scene.walk(lambda time: (0, 0, 12.0), 4.0, since_s=2.1)
    assert ranges(results)[0] < 6.0
    assert ranges(results)[8] == pytest.approx(12.0, abs=0.1)


def test_who_is_seen_without_a_range_is_predicted():
    scene = Scene()
    scene.walk(lambda time: (0, 0, 5.0), 1.0)
    result = scene.filter.measure(
        people(1), measured([0, 0, 5.0], reason=Reason.NO_SHOULDERS), stamp_ns=START_NS + 10**9)
    assert result.predicted.tolist() == [True]
    assert result.distances.range[0] == pytest.approx(5.0, abs=0.1)
    assert result.measured.reason.tolist() == [Reason.NO_SHOULDERS]


@pytest.mark.parametrize('back_s', [0.0, 0.02, 0.5])
def test_a_late_or_repeated_frame_is_as_measured_and_changes_nothing(back_s):
    disturbed, calm = Scene(), Scene()
    for scene in (disturbed, calm):
        scene.walk(away, 2.0, rate=10.0)
    late = disturbed.see(1.9 - back_s, {1: (0, 0, 9.0)})
    assert late.distances.range.tolist() == late.measured.range.tolist() == [9.0]
    after = [scene.see(2.0, {1: away(2.0)}) for scene in (disturbed, calm)]
    assert after[0].distances.range == after[1].distances.range


@pytest.mark.parametrize('back_s', [1.5, 3600.0])
def test_a_clock_set_back_or_a_bag_that_loops_begins_anew(back_s):
    scene = Scene()
    scene.walk(away, 2.0)
    again = scene.see(2.0 - back_s, {1: (0, 0, 30.0)})
    assert again.distances.range == pytest.approx([30.0])
    assert not again.predicted.any()
    assert scene.see(2.1 - back_s, {1: (0, 0, 30.0)}).distances.range == pytest.approx([30.0])


def test_a_loop_shorter_than_a_second_begins_anew_after_three_frames():
    scene = Scene()
    for _ in range(3):
        _, results = scene.walk(away, 0.8, rate=10.0)
        assert np.isfinite([result.velocity for result in results[2:]]).all()


def test_a_clock_that_jumps_ahead_forgets_everybody():
    scene = Scene()
    scene.walk(away, 2.0)
    assert len(scene.see(3600.0, {})) == 0
    assert scene.see(3600.1, {1: (0, 0, 30.0)}).distances.range == pytest.approx([30.0])


def test_a_new_id_in_the_place_of_a_lost_one_goes_on_with_its_state():
    scene = Scene()
    _, before = scene.walk(away, 2.0)
    assert len(scene.see(2.3, {})) == 1
    found = scene.see(2.5, {8: away(2.5)})
    assert found.people.track_ids.tolist() == [8]
    assert found.velocity[0] == pytest.approx([0, 0, 1.5], abs=0.2)
    stranger = scene.see(2.6, {8: away(2.6), 9: (3.0, 0.0, 4.0)})
    assert stranger.people.track_ids.tolist() == [8, 9]
    assert stranger.velocity[1] == pytest.approx([0, 0, 0])
    assert before[-1].people.track_ids.tolist() == [1]


def test_who_was_followed_twice_leaves_nobody_behind():
    scene = Scene()
    for step in range(10):
        scene.see(step / 10, {1: away(step / 10), 2: away(step / 10), 3: (3.0, 0.0, 6.0)})
    last = scene.see(1.0, {1: away(1.0)})
    assert last.people.track_ids.tolist() == [1, 3]


@pytest.mark.parametrize(('sure', 'then', 'told'), [
    (True, 0.05, 10.0), (True, 0.1, 10.25), (False, 0.05, 10.4)])
def test_a_sure_look_teaches_the_size_of_the_body(sure, then, told):
    """Feet on the ground tell the range, 10 m, for a second; what is seen then says 4 % more."""
    scene = Scene()
    if sure:
        for step in range(15):
            scene.see(step / 15, {1: (0, 0, 10.0)}, spread=0.012)
    for step in range(15, 90):
        last = scene.see(step / 15, {1: (0, 0, 10.4)}, spread=then)
    assert last.distances.range[0] == pytest.approx(told, abs=0.06)


def test_people_of_one_id_are_as_measured():
    scene = Scene()
    for time in (0.0, 0.1, 0.2):
        result = scene.filter.measure(
            people(5, 5, 6), measured([(0, 0, 4.0), (1, 0, 9.0), (2, 0, 5.0)]),
            stamp_ns=START_NS + round(time * 1e9))
    assert result.distances.range.tolist()[:2] == result.measured.range.tolist()[:2]
    assert np.isfinite(result.velocity).all(axis=1).tolist() == [False, False, True]


def turned(degrees):
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])


def fly(scene, *, since_s, until_s, known, person=(2.0, 0.0, 12.0), rate=10.0):
    """Return what a camera that comes nearer and turns to and fro sees of someone who stands."""
    results = []
    for time in np.arange(round(since_s * rate), round(until_s * rate)) / rate:
        pose = CameraPose(turned(12 * np.sin(2 * time)), np.array([0.3, 0.0, 2.0 * time]))
        seen = pose.rotation.T @ (np.array(person) - pose.position)
        results.append(scene.see(time, {1: seen}, pose=pose if known(time) else None))
    return results


def test_who_stands_has_no_velocity_for_a_camera_that_knows_its_own():
    *_, last = fly(Scene(), since_s=0.0, until_s=3.0, known=lambda time: True)
    assert last.velocity[0] == pytest.approx([0, 0, 0], abs=0.05)
    assert last.distances.range == pytest.approx(last.measured.range, rel=0.01)
    distance = last.measured.range[0]
    assert last.time_to_contact[0] == pytest.approx(distance / 2.0, rel=0.15)
    *_, unknown = fly(Scene(), since_s=0.0, until_s=3.0, known=lambda time: False)
    assert unknown.time_to_contact[0] == pytest.approx(distance / 2.0, rel=0.3)


def test_poses_that_come_and_go_do_not_disturb():
    results = fly(
        Scene(), since_s=0.0, until_s=6.0, known=lambda time: 1 < time < 2 or 3 < time < 5)
    assert not any(result.predicted.any() for result in results)
    raw = np.array([result.measured.range[0] for result in results])
    assert ranges(results)[5:] == pytest.approx(raw[5:], rel=0.06)


def test_a_fixed_frame_that_is_set_anew_does_not_disturb():
    scene, person = Scene(), np.array([2.0, 0.0, 12.0])
    for step in range(40):
        jump = np.array([100.0, -40.0, 0.0]) * (step >= 20)
        pose = CameraPose(turned(5), np.array([0.0, 0.0, 0.1 * step]))
        seen = pose.rotation.T @ (person - pose.position)
        result = scene.see(
            step / 10, {1: seen}, pose=replace(pose, position=pose.position + jump))
        assert not result.predicted.any()
        assert result.distances.range == pytest.approx(result.measured.range, rel=0.03)


@pytest.mark.parametrize(('options', 'said'), [
    ({'prediction_time': -1.0}, 'prediction_time -1'),
    ({'prediction_time': np.nan}, 'prediction_time nan'),
    ({'person_acceleration': 0.0}, 'person_acceleration 0'),
    ({'camera_acceleration': -0.1}, 'camera_acceleration -0.1')])
def test_options_that_make_no_sense_are_refused(options, said):
    with pytest.raises(DepthPersonError, match=said):
        FilterOptions(**options)


def test_without_a_filter_each_frame_is_by_itself():
    stage = DistanceStage(DistanceOptions(filter=None))
    result = stage.measure(people(1), None, stamp_ns=START_NS)
    assert result.measured is result.distances
    assert np.isnan(result.velocity).all()
