"""Evaluate with people followed through sequences."""
import json

from known_frames import person, write_frame
import numpy as np
import pytest

from depth_person import cli

HIDDEN = range(14, 19)


def evaluate(folder, out, *options):
    """Return the samples that the command writes."""
    code = cli.main([
        'evaluate', str(folder), '--keypoints', 'truth', '--noise', '2', '--json', str(out),
        *options])
    assert code == 0
    return json.loads(out.read_text())['samples']


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a still, and a walk of two seconds in which the person is hidden for a while."""
    data = tmp_path_factory.mktemp('data')
    write_frame(data, 'still', [person((0, 0, 5))])
    for i in range(20):
        flags = ['occluded' if i in HIDDEN else 'visible'] * 17
        write_frame(
            data / 'seq' / 'walk', f'{i:02}', [person((0, 0, 5 + 0.1 * i), keypoints_flag=flags)],
            time_s=i / 10)
    return data


def test_ranges_are_those_over_time_and_the_raw_ones_stay(folder, tmp_path):
    alone = evaluate(folder, tmp_path / 'alone.json')
    followed = evaluate(folder, tmp_path / 'followed.json', '--filter')
    assert [each['range_measured'] for each in followed] == [each['range'] for each in alone]
    assert followed[0]['range'] == followed[0]['range_measured']  # the still
    errors = np.array([
        [each[name] - each['range_true'] for name in ('range_measured', 'range')]
        for each in followed[5:] if each['found']])
    raw, filtered = (errors - errors.mean(axis=0)).std(axis=0)
    assert filtered < 0.8 * raw


def test_the_hidden_are_not_found_but_have_a_range(folder, tmp_path):
    followed = evaluate(folder, tmp_path / 'followed.json', '--filter')[1:]
    alone = evaluate(folder, tmp_path / 'alone.json')[1:]
    for index, (one, other) in enumerate(zip(followed, alone, strict=True)):
        hidden = index in HIDDEN
        assert (one['found'], one['predicted'], other['range'] is None) == (
            not hidden, hidden, hidden)
        assert abs(one['range'] - one['range_true']) < 2 * one['range_sigma']
        assert one['time_s'] == pytest.approx(index / 10)
    assert followed[18]['range_sigma'] > followed[14]['range_sigma']
    assert all(each['person'] is not None for each in followed)
