import warnings

import numpy as np
import pytest

from depth_person.replay.evaluate import Sample
from depth_person.replay.metrics import figures, summarise


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield


def sample(true, estimated=None, *, sigma=1.0, found=True, scenario='s', **more):
    return Sample(
        'image', 0, scenario, '', found, depth_true=true, range_true=true, range_neck=true,
        range=estimated, range_sigma=None if estimated is None else sigma, **more)


def test_figures_by_hand():
    # Errors +1, -2, +3 at sigma 1.5; one found without a range, one not found at all.
    samples = [
        sample(4, 5, sigma=1.5, shoulder_error_px=2.0), sample(10, 8, sigma=1.5),
        sample(12, 15, sigma=1.5, shoulder_error_px=4.0), sample(6, shoulder_error_px=9.0),
        sample(7, found=False)]
    expected = {
        'n': 5, 'found': 0.8, 'with_range': 0.6, 'median_abs': 2.0, 'mean_abs': 2.0,
        'median_rel': 0.25, 'rmse': (14 / 3) ** 0.5, 'bias': 2 / 3, 'coverage_1': 1 / 3,
        'coverage_2': 1.0, 'pearson_r': np.corrcoef([5, 8, 15], [4, 10, 12])[0, 1],
        'median_shoulder_error_px': 4.0}
    assert figures(samples) == pytest.approx(expected)


def test_errors_are_of_the_neck_s_range_not_of_the_labelled_one():
    feet = Sample('image', 0, 's', '', True, depth_true=9.0, range_true=10.0, range_neck=9.5,
                  range=9.6, range_sigma=0.1)
    assert figures([feet])['bias'] == pytest.approx(0.1)


@pytest.mark.parametrize('samples', [[], [sample(5, found=False)], [sample(5)], [sample(5, 5)],
                                     [sample(5, 6)] * 4])
def test_what_cannot_be_told_is_none(samples):
    told = figures(samples)
    assert told['n'] == len(samples)
    assert told['pearson_r'] is None
    measured = sum(s.range is not None for s in samples)
    assert (told['rmse'] is None) == (measured == 0)
    assert (told['found'] is None) == (not samples)
    assert told['median_shoulder_error_px'] is None


def test_groups_hold_each_person_who_says_so():
    samples = [
        sample(4.9, scenario='near', yaw_deg=-10.0, visible_fraction=1.0),
        sample(5.0, scenario='near', yaw_deg=100.0, visible_fraction=0.5),
        sample(19.0, scenario='far', yaw_deg=181.0), sample(21.0, scenario='far', yaw_deg=350.0),
        sample(12.0, scenario='')]
    summary = summarise(samples)
    assert summary['overall']['n'] == 5
    assert {key: {name: group['n'] for name, group in summary[key].items()}
            for key in summary if key.startswith('by_')} == {
        'by_scenario': {'near': 2, 'far': 2},
        'by_distance': {'0-5 m': 1, '5-10 m': 1, '10-15 m': 1, '15-20 m': 1, '>20 m': 1},
        'by_facing': {'front': 2, 'side': 1, 'back': 1},
        'by_visibility': {'whole': 1, 'partly hidden': 1}}
    assert list(summary['by_distance']) == ['0-5 m', '5-10 m', '10-15 m', '15-20 m', '>20 m']


def test_false_people_are_counted_apart():
    stranger = Sample('image', None, 's', '', True, range=3.0, range_sigma=0.1)
    summary = summarise([sample(5, 6), stranger, stranger])
    assert summary['false_people'] == 2
    assert summary['overall']['n'] == 1
    assert summary['by_scenario']['s']['n'] == 1
