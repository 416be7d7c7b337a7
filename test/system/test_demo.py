"""The demo from its command to its results."""
import csv
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest

DEMO = Path(__file__).parents[2] / 'demo'
COMMAND = (sys.executable, DEMO / 'demo.py', '--out')


@pytest.fixture(scope='module')
def demo(tmp_path_factory):
    """Return the folder of a finished demo and what it printed."""
    out = tmp_path_factory.mktemp('demo')
    run = subprocess.run(
        [*COMMAND, out], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        timeout=240, check=False)
    assert run.returncode == 0, run.stdout
    return out, run.stdout


@pytest.fixture(scope='module')
def samples(demo):
    """Return the columns of what the watcher saw."""
    with (demo[0] / 'samples.csv').open(newline='') as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def test_every_sample_is_a_plain_number(samples):
    measured = ('stamp_s', 'track_id', 'x', 'y', 'z', 'range', 'range_sigma')
    assert all(np.isfinite(samples[name]).all() for name in measured)
    assert (samples['range_sigma'] > 0).all()
    position = np.stack([samples[axis] for axis in 'xyz'])
    assert np.linalg.norm(position, axis=0) == pytest.approx(samples['range'], rel=1e-3)


def test_all_three_people_are_followed_from_begin_to_end(samples):
    stamps = samples['stamp_s'] - samples['stamp_s'].min()
    for person in range(3):
        own = stamps[samples['truth_id'] == person]
        assert own.min() < 2
        assert own.max() > 6


# A slow machine looks at few images, and predicts for longer; how right each image alone is,
# core/test_demo_bag.py says.
def test_hardly_anybody_else_is_seen(samples):
    assert (samples['truth_id'] < 0).mean() < 0.15


@pytest.mark.parametrize('person', range(3))
def test_ranges_are_right_within_a_tenth(samples, person):
    own = samples['truth_id'] == person
    ratio = samples['range'][own] / samples['truth_range'][own]
    assert np.median(np.abs(ratio - 1)) < 0.1


def test_the_sigma_tells_the_size_of_the_error(samples):
    known = samples['truth_id'] >= 0
    error = np.abs(samples['range'] - samples['truth_range'])[known]
    sigma = samples['range_sigma'][known]
    assert (error < 2 * sigma).mean() > 0.8
    assert np.median(sigma / samples['range'][known]) < 0.1


def test_the_summary_is_printed(demo):
    _, said = demo
    assert 'Traceback' not in said
    assert 'median error' in said
    for node in ('camera_node', 'pose_node', 'depth_node'):
        assert f'{node}: ' in said


def test_the_video_plays_for_as_long_as_the_scene(demo):
    video = cv2.VideoCapture(str(demo[0] / 'overlay.mp4'))
    frames = 0
    while video.read()[0]:
        frames += 1
    assert frames / video.get(cv2.CAP_PROP_FPS) == pytest.approx(8.0, abs=0.5)


def test_the_report_is_a_picture_with_something_on_it(demo):
    report = cv2.imread(str(demo[0] / 'report.png'))
    assert report.shape[0] > 500
    assert report.std() > 20


def test_what_a_node_says_is_shown_when_it_ends(tmp_path):
    run = subprocess.run(
        [*COMMAND, tmp_path / 'out'], env={**os.environ, 'DEPTH_PERSON_HOME': str(tmp_path)},
        capture_output=True, text=True, timeout=240, check=False)
    assert run.returncode == 1
    assert 'pose_node ended with exit code' in run.stderr
    assert 'depth_person models install' in run.stderr
    assert 'Traceback' not in run.stdout + run.stderr


def children(pid):
    return [int(word) for word in Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]


@pytest.mark.parametrize(('moment', 'least'), [('loading', 0), ('starting', 1), ('playing', 4)])
def test_ctrl_c_ends_every_process(tmp_path, moment, least):
    with subprocess.Popen(
            [*COMMAND, tmp_path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True) as run:
        said = []
        while not said or not said[-1].startswith(moment):
            said.append(run.stdout.readline())
            assert said[-1], said
        time.sleep(0.2)
        while len(started := children(run.pid)) < least:
            assert run.poll() is None, run.stdout.read()
            time.sleep(0.02)
        run.send_signal(signal.SIGINT)
        run.send_signal(signal.SIGINT)  # impatient users press it twice
        said += run.stdout.readlines()
    assert run.returncode == 130
    assert not any(Path(f'/proc/{pid}').exists() for pid in started)
    assert 'Traceback' not in ''.join(said)
