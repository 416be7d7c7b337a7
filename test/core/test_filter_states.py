"""The filter's mathematics: covariances, frames, rates, gates and times to contact."""
from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from depth_person.distance.contact import time_to_contact
from depth_person.distance.conventions import CONVENTIONS
from depth_person.distance.estimator import Body, Cue
from depth_person.distance.filtering import predicted, started, updated
from depth_person.distance.motion import Motion
from depth_person.distance.scale import (
    BODY_SPREAD,
    body_spread,
    CHILDREN_SPREAD,
    ErrorShares,
    lasting,
)
from depth_person.distance.states import N_STATES, POSITION, States, VELOCITY

ORIGIN, SAME = np.zeros(3), np.eye(3)
MOTION = Motion(speed=1.0, acceleration=0.4, turn_rate=0.5, turn_acceleration=1.0)
places = st.tuples(st.floats(-5, 5), st.floats(-3, 3), st.floats(0.5, 40))
spreads = st.floats(0.01, 0.4)
#: Of one person: the seconds since the last, where it seems to be, and its spread.
sightings = st.lists(st.tuples(st.floats(0.0, 1.0), places, spreads), min_size=1, max_size=12)
angles = st.tuples(*[st.floats(-np.pi, np.pi)] * 3)


def rotation(a, b, c):
    def turn(axis, angle):
        i, j = [each for each in range(3) if each != axis]
        matrix = np.eye(3)
        matrix[[i, j], [i, j]] = np.cos(angle)
        matrix[i, j], matrix[j, i] = np.sin(angle), -np.sin(angle)
        return matrix
    return turn(0, a) @ turn(1, b) @ turn(2, c)


def shares_of(spread):
    return ErrorShares.of(np.array([spread]), np.array([spread]))


def followed(rows, *, turn=SAME, shift=ORIGIN):
    """Return the states after the likely sightings, in a frame that is turned and shifted."""
    states = None
    for elapsed, place, spread in rows:
        place, shares = np.array([place]) @ turn.T + shift, shares_of(spread)
        if states is None:
            states = started(place, shares, shift, MOTION)
            continue
        states = predicted(states, elapsed, MOTION, shift)
        update = updated(states, place, shares, shift)
        if update.likely[0]:
            states = update.states
    return states


@given(sightings)
def test_covariances_stay_symmetric_and_positive(rows):
    covariance = followed(rows).covariance[0]
    scale = np.sqrt(np.diag(covariance))
    assert (scale > 0).all()
    correlation = covariance / np.outer(scale, scale)
    assert correlation == pytest.approx(correlation.T, abs=1e-9)
    assert np.linalg.eigvalsh((correlation + correlation.T) / 2).min() > -1e-9


@settings(max_examples=50)
@given(sightings, angles, places)
def test_the_choice_of_the_fixed_frame_makes_no_difference(rows, turned, shift):
    turn, shift = rotation(*turned), np.array(shift)
    here = followed(rows)
    assume(np.linalg.norm(here.mean[0, POSITION]) > 0.3)
    there = followed(rows, turn=turn, shift=shift)
    back = there.moved(turn.T, -turn.T @ shift)
    scale = 1 + np.abs(here.mean).max()
    assert back.mean == pytest.approx(here.mean, abs=1e-6 * scale)
    assert back.covariance == pytest.approx(here.covariance, abs=1e-6 * scale ** 2)


@given(places, st.floats(0.02, 1.0), spreads, st.floats(0.0, 3.0))
def test_who_is_seen_much_nearer_is_not_followed_behind_the_camera(place, nearer, spread, elapsed):
    seen = np.multiply(place, nearer)
    states = started(np.array([place]), shares_of(spread), ORIGIN, MOTION)
    states = predicted(states, elapsed, MOTION, ORIGIN)
    states = updated(states, seen[None], shares_of(spread), ORIGIN).states
    assert states.mean[0, POSITION] @ place >= 0.49 * np.square(place).sum()


@given(st.floats(0.01, 2.0), st.integers(2, 30), sightings)
def test_one_long_step_is_many_short_ones(elapsed, parts, rows):
    fixed = Motion(speed=1.0, acceleration=0.4)
    start = followed(rows)
    once = predicted(start, elapsed, fixed, ORIGIN)
    often = start
    for _ in range(parts):
        often = predicted(often, elapsed / parts, fixed, ORIGIN)
    assert often.mean == pytest.approx(once.mean, rel=1e-6, abs=1e-9)
    assert often.covariance == pytest.approx(once.covariance, rel=1e-6, abs=1e-9)


@given(st.floats(0.005, 0.5))
def test_the_shares_of_an_error_make_up_about_its_spread(spread):
    shares = shares_of(spread)
    assert 0.999 * spread <= np.sqrt(shares.variance[0]) <= 1.13 * spread
    assert shares.body[0] == min(spread, BODY_SPREAD)


@given(st.floats(0.01, 0.3), st.floats(-0.1, 0.1))
def test_what_stays_does_not_depend_on_the_spread_of_one_frame(usual, off):
    before = np.array([usual])
    frame = before * np.exp(off)
    shares = ErrorShares.of(frame, ErrorShares.usual(before, frame))
    expected = ErrorShares.of(before, before)
    assert (shares.body, shares.view) == (expected.body, expected.view)


def test_averaging_does_not_take_the_error_of_the_body_away():
    states = followed([(1 / 15, (0.0, 0.0, 5.0), 0.05)] * 300)
    assert 0.9 * BODY_SPREAD < np.sqrt(states.covariance[0, 2, 2]) / 5.0 < 0.05


def test_a_long_uncertainty_along_the_ray_is_short_across():
    states = started(np.array([[3.0, 0.0, 4.0]]), shares_of(0.1), ORIGIN, MOTION)
    ray = np.array([0.6, 0.0, 0.8])
    across = np.array([0.8, 0.0, -0.6])
    covariance = states.covariance[0, POSITION, POSITION]
    assert np.sqrt(ray @ covariance @ ray) == pytest.approx(0.5, rel=0.1)
    assert np.sqrt(across @ covariance @ across) < 0.1


@pytest.mark.parametrize(('place', 'likely'), [
    ((0.0, 0.0, 5.0), True), ((0.0, 0.0, 5.6), True), ((0.0, 0.0, 9.0), False),
    ((0.0, 0.0, 2.5), False), ((1.5, 0.0, 5.0), False), ((0.0, 0.0, -5.0), False)])
def test_the_gate_lets_through_what_is_likely(place, likely):
    states = predicted(
        followed([(1 / 15, (0.0, 0.0, 5.0), 0.05)] * 15), 1 / 15, MOTION, ORIGIN)
    update = updated(states, np.array([place]), shares_of(0.05), ORIGIN)
    assert update.likely.tolist() == [likely]


def at(position, velocity, sigma=1e-3):
    mean = np.zeros((1, N_STATES))
    mean[0, POSITION], mean[0, VELOCITY] = position, velocity
    return States(mean, sigma ** 2 * np.eye(N_STATES)[None])


@pytest.mark.parametrize(('position', 'velocity', 'camera', 'seconds'), [
    ((0, 0, 6), (0, 0, -1.5), (0, 0, 0), 4.0),
    ((0, 0, 6), (0, 0, 0), (0, 0, 3), 2.0),
    ((3, 0, 4), (-0.6, 0, -0.8), (0, 0, 0), 5.0),
    ((0, 0, 6), (5, 0, -2), (0, 0, 0), 3.0),
    ((0, 0, 6), (0, 0, 1.5), (0, 0, 0), np.inf),
    ((0, 0, 6), (0, 0, 0), (0, 0, 0), np.nan)])
def test_time_to_contact(position, velocity, camera, seconds):
    time, sigma = time_to_contact(at(position, velocity), ORIGIN, np.array(camera, float))
    assert time == pytest.approx([seconds], nan_ok=True)
    assert np.isfinite(sigma[0]) == np.isfinite(seconds)


def test_the_sigma_of_time_to_contact_is_what_sampling_gives():
    states = at((1.0, 0.5, 6.0), (0.2, 0.0, -1.5), sigma=0.02)
    random = np.random.default_rng(0).multivariate_normal(
        states.mean[0], states.covariance[0], 20_000)
    times, _ = time_to_contact(
        States(random, np.zeros((len(random), N_STATES, N_STATES))), ORIGIN, np.zeros(3))
    assert time_to_contact(states, ORIGIN, np.zeros(3))[1] == pytest.approx(
        [times.std()], rel=0.05)


@pytest.mark.parametrize(('estimator', 'body', 'spread'), [
    ('skeleton', Body(), BODY_SPREAD), ('skeleton', Body(children=True), CHILDREN_SPREAD),
    ('shoulder', Body(shoulder_width_sigma=0.02), 0.02)])
def test_what_stays_depends_on_who_may_be_there_and_on_the_estimator(estimator, body, spread):
    assert body_spread(estimator, body) == spread
    shares = ErrorShares.of(np.array([0.2]), np.array([0.2]), spread)
    assert shares.body.tolist() == [spread]
    assert shares.variance == pytest.approx([0.2 ** 2])


def test_a_networks_habits_last_as_the_body_does_and_exact_keypoints_have_none():
    cues = np.array([Cue.SKELETON, Cue.SKELETON | Cue.GROUND, Cue.SHOULDERS], np.uint8)
    np.testing.assert_allclose(lasting('mesh', cues), 1.0)
    scale = CONVENTIONS['movenet'].sigma_scale
    np.testing.assert_allclose(lasting('movenet', cues), [scale, scale, 1.0])
    np.testing.assert_allclose(
        lasting('unheard of', cues), lasting('coco', cues))
