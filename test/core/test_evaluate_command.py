import json
import sys

from average_body import CAMERA, seen, standing_at
import cv2
from known_frames import COCO17, edit, person, write_frame
import numpy as np
import pytest

from depth_person import cli
from depth_person.distance.estimator import Distances, Reason
from depth_person.pose import pipeline
from depth_person.pose.people import People
from depth_person.verbs import evaluate as verb

TRUTH = ['--estimator', 'shoulder', '--shoulder-width', '0.336', '--keypoints', 'truth']


def evaluate(folder, out, *options):
    """Run the command; return its exit code and what it wrote."""
    code = cli.main(['evaluate', str(folder), '--json', str(out / 'out.json'), *options])

    def never(constant):
        raise AssertionError(f'{constant} in JSON')

    return code, json.loads((out / 'out.json').read_text(), parse_constant=never)


@pytest.fixture
def folder(tmp_path):
    """Return a folder of three stills and a sequence."""
    data = tmp_path / 'data'
    write_frame(data, 'two', [person((-1, 0, 4)), person((1, 0, 8), identity='b')])
    write_frame(data, 'side', [person((0, 0, 5), yaw_deg=90)])
    write_frame(data, 'nobody', [])
    for i in range(3):
        write_frame(data / 'seq' / 'walk', f'{i}', [person((0, 0, 6 + i))], time_s=i / 2,
                    scenario='walk')
    return data


def test_every_true_person_is_a_sample(folder, tmp_path, capsys):
    code, result = evaluate(folder, tmp_path, *TRUTH)
    assert code == 0
    samples = {(s['image'], s['person']): s for s in result['samples']}
    assert set(samples) == {
        ('images/two.png', 0), ('images/two.png', 'b'), ('images/side.png', 0),
        *((f'seq/walk/images/{i}.png', 0) for i in range(3))}
    b = samples['images/two.png', 'b']
    assert {key: b[key] for key in ('scenario', 'tag', 'found', 'reason', 'cues', 'track_id')} == {
        'scenario': 'still', 'tag': 'two', 'found': True, 'reason': None, 'cues': ['shoulders'],
        'track_id': 1}
    assert (b['depth_true'], b['range_true']) == (8.0, pytest.approx(65 ** 0.5))
    assert b['depth'] == pytest.approx(8, rel=1e-3)
    assert b['range'] == pytest.approx(65 ** 0.5, rel=1e-3)
    assert 0.5 < b['range_sigma'] < 1.5
    assert b['shoulder_error_px'] == pytest.approx(0, abs=0.01)
    side = samples['images/side.png', 0]
    assert side['found']
    assert (side['range'], side['depth'], side['range_sigma']) == (None, None, None)
    assert side['reason'] == 'coincident_shoulders'
    assert result['summary']['overall']['n'] == 6
    assert result['summary']['overall']['median_rel'] < 1e-3
    assert result['summary']['by_scenario']['walk']['with_range'] == 1
    assert result['faults'] == []
    printed = capsys.readouterr().out
    assert 'overall' in printed
    assert 'walk' in printed


def test_noise_and_seed_decide_the_samples(folder, tmp_path):
    once, again, other = (
        evaluate(folder, tmp_path, *TRUTH, '--noise', '2', '--seed', seed)[1]['samples']
        for seed in ('1', '1', '2'))
    assert once == again
    assert once != other
    assert max(s['shoulder_error_px'] for s in once) > 0.5


def test_a_measured_neck_sees_a_turned_person(tmp_path):
    write_frame(tmp_path / 'data', 'a', [person((0, 0, 3), yaw_deg=40)])
    _, told = evaluate(tmp_path / 'data', tmp_path, *TRUTH, '--measured-neck')
    _, blind = evaluate(tmp_path / 'data', tmp_path, *TRUTH)
    assert told['samples'][0]['range'] == pytest.approx(3, rel=1e-3)
    assert told['samples'][0]['cues'] == ['shoulders', 'neck']
    assert blind['samples'][0]['range'] == pytest.approx(3 / np.cos(np.radians(40)), rel=0.02)


def test_the_limit_is_of_stills_and_sequences(folder, tmp_path):
    _, result = evaluate(folder, tmp_path, *TRUTH, '--limit', '2')
    assert [s['image'] for s in result['samples']] == ['images/side.png']


def test_bad_frames_are_named_and_the_others_measured(folder, tmp_path, capsys):
    (folder / 'gt' / 'torn.json').write_text('{')
    bad = write_frame(folder, 'keyless', [person((0, 0, 5))])
    edit(bad, lambda record: record['persons'][0].pop('depth_z_m'))
    write_frame(folder, 'bare', [person((0, 0, 5), keypoints_px=None)])
    code, result = evaluate(folder, tmp_path, *TRUTH)
    assert code == 1
    assert result['summary']['overall']['n'] == 6
    assert {fault['file'] for fault in result['faults']} == {
        'gt/torn.json', 'gt/keyless.json', 'images/bare.png'}
    complaints = capsys.readouterr().err
    assert 'left out gt/torn.json: is not valid JSON' in complaints
    assert 'left out gt/keyless.json: persons[0]: depth_z_m is missing' in complaints
    assert 'left out images/bare.png: has no keypoints_px' in complaints


@pytest.mark.parametrize(('options', 'message'), [
    (['--estimator', 'pixie'], 'invalid choice'), (['--noise', '-1'], 'at least 0'),
    (['--noise', 'nan'], 'at least 0'), (['--limit', '0'], 'at least 1')])
def test_options_out_of_range_are_refused(folder, options, message, capsys):
    with pytest.raises(SystemExit, match='2'):
        cli.main(['evaluate', str(folder), *options])
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'message'), [
    (['FOLDER/missing', *TRUTH], 'holds no gt'),
    (['FOLDER', '--shoulder-width', '35', '--keypoints', 'truth'], 'shoulder width of 35 m'),
    (['FOLDER', *TRUTH, '--json', 'FOLDER/gt/two.json/out.json'], 'cannot write'),
    (['FOLDER', *TRUTH, '--plots', 'FOLDER/gt/two.json'], 'cannot write'),
])
def test_what_the_user_can_mend_is_said_in_a_line(folder, arguments, message, capsys):
    arguments = [argument.replace('FOLDER', str(folder)) for argument in arguments]
    assert cli.main(['evaluate', *arguments]) == 1
    complaint = capsys.readouterr().err
    assert message in complaint
    assert complaint.count('\n') == 1


class Stage:
    """Stands for the pose stage: in every image someone at (0, 0, 6) and someone far off."""

    def __init__(self, options):
        self.options = options

    def estimate(self, frame):
        assert frame.image.shape == (720, 1280, 3)
        people = seen([standing_at((0, 0, 6)), standing_at((4, 0, 9))])
        return People(people.keypoints, np.array([7, 8], np.int32))


def test_people_of_the_network_are_matched_and_strangers_told(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, 'PoseEstimator', Stage)
    code, result = evaluate(folder, tmp_path, '--estimator', 'shoulder', '--shoulder-width',
                            '0.336', '--pose-model', 'movenet-thunder')
    assert code == 0
    first = [s for s in result['samples'] if s['image'] == 'seq/walk/images/0.png']
    assert [(s['person'], s['found'], s['track_id']) for s in first] == [
        (0, True, 7), (None, True, 8)]
    assert first[0]['range'] == pytest.approx(6, rel=1e-3)
    assert first[1]['range'] == pytest.approx(97 ** 0.5, rel=1e-3)
    assert (first[1]['range_true'], first[1]['shoulder_error_px']) == (None, None)
    two = [s for s in result['samples'] if s['image'] == 'images/two.png']
    assert [(s['person'], s['found'], s['range'], s['reason']) for s in two[:2]] == [
        (0, False, None, None), ('b', False, None, None)]
    assert result['summary']['false_people'] == sum(s['person'] is None for s in result['samples'])


def test_an_image_that_cannot_be_used_is_left_out(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, 'PoseEstimator', Stage)
    (folder / 'images' / 'two.png').write_bytes(b'torn')
    (folder / 'images' / 'side.png').unlink()
    cv2.imwrite(str(folder / 'images' / 'nobody.png'), np.zeros((36, 64, 3), np.uint8))
    code, result = evaluate(folder, tmp_path)
    assert code == 1
    assert {fault['file']: fault['message'].split(',')[0] for fault in result['faults']} == {
        'gt/side.json': 'image names images/side.png',
        'images/two.png': 'is not an image that OpenCV can read',
        'images/nobody.png': 'is 64x36 px'}
    assert result['summary']['overall']['n'] == 3


class Witness:
    """Stands for an estimator: keeps what it is told of the mounting."""

    name = 'witness'

    def __init__(self):
        self.mountings = []

    def estimate(self, people, intrinsics, mounting):
        self.mountings.append(mounting)
        return Distances.none(len(people), Reason.TOO_FEW_KEYPOINTS)


@pytest.mark.parametrize(('option', 'height'), [('truth', 1.4), ('none', None)])
def test_the_mounting_is_told_only_if_asked(tmp_path, monkeypatch, option, height):
    witness = Witness()
    monkeypatch.setattr(verb, 'make_estimator', lambda name, body: witness)
    write_frame(tmp_path / 'data', 'a', [person((0, 0, 5))], camera={
        'height_m': 1.4, 'pitch_down_deg': 30.0, 'roll_cw_deg': 0.0})
    evaluate(tmp_path / 'data', tmp_path, '--keypoints', 'truth', '--mounting', option)
    mounting, = witness.mountings
    assert mounting.height == height
    assert (mounting.gravity is None) == (height is None)


def test_a_fixed_mounting_is_told_of_every_frame(tmp_path, monkeypatch):
    witness = Witness()
    monkeypatch.setattr(verb, 'make_estimator', lambda name, body: witness)
    write_frame(tmp_path / 'data', 'a', [person((0, 0, 5))], camera={
        'height_m': 1.4, 'pitch_down_deg': 30.0, 'roll_cw_deg': 0.0})
    evaluate(tmp_path / 'data', tmp_path, '--keypoints', 'truth', '--mounting', 'fixed',
             '--camera-height', '1.65', '--camera-pitch', '10', '--attitude-sigma', '0.5')
    mounting, = witness.mountings
    assert mounting.height == 1.65
    assert mounting.gravity == pytest.approx(
        [0, np.cos(np.radians(10)), np.sin(np.radians(10))])
    assert mounting.gravity_sigma == pytest.approx(np.radians(0.5))


def test_a_fixed_mounting_is_not_told_and_then_ignored(tmp_path, capsys):
    write_frame(tmp_path / 'data', 'a', [person((0, 0, 5))])
    assert cli.main(['evaluate', str(tmp_path / 'data'), '--keypoints', 'truth',
                     '--mounting', 'truth', '--camera-height', '1.5']) == 1
    assert 'go with --mounting fixed' in capsys.readouterr().err


def test_a_recording_is_measured_at_the_depth_of_its_boxes(tmp_path):
    position = np.array([2.0, 0.1, 12.0])
    pixels = CAMERA.project(standing_at(position))[COCO17]
    people = [{
        'frame': '000001', 'K': {'fx': CAMERA.fx, 'fy': CAMERA.fy, 'cx': CAMERA.cx,
                                 'cy': CAMERA.cy},
        'keypoints_detected': np.insert(pixels, 2, 0.8, axis=1).tolist(),
        'xyz_m': [99.0, 1.5, 12.0], 'range_m': 12.4}]
    path = tmp_path / 'recorded.json'
    path.write_text(json.dumps({'reference_point': '3D box centre', 'people': people}))
    code, result = evaluate(
        path, tmp_path, '--keypoints', 'recorded', '--estimator', 'shoulder',
        '--shoulder-width', '0.336')
    sample, = result['samples']
    assert code == 0
    assert sample['range_true'] == 12.4
    assert sample['range_neck'] == pytest.approx(np.linalg.norm(position), rel=1e-3)
    assert sample['range'] == pytest.approx(np.linalg.norm(position), rel=1e-3)


def test_plots_are_pictures(folder, tmp_path):
    assert cli.main(['evaluate', str(folder), *TRUTH, '--plots', str(tmp_path / 'plots')]) == 0
    for name in ('ranges', 'errors', 'coverage'):
        picture = cv2.imread(str(tmp_path / 'plots' / f'{name}.png'))
        assert picture.shape[0] > 300
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20


def test_plots_of_nothing_are_refused(tmp_path, capsys):
    write_frame(tmp_path, 'side', [person((0, 0, 5), yaw_deg=90)])
    assert cli.main(['evaluate', str(tmp_path), *TRUTH, '--plots', str(tmp_path / 'p')]) == 1
    assert 'nothing to plot' in capsys.readouterr().err


def test_a_missing_matplotlib_is_said_before_the_work(folder, monkeypatch, capsys):
    for module in ('drawing', 'plots'):
        monkeypatch.delitem(sys.modules, f'depth_person.replay.{module}', raising=False)
    monkeypatch.setitem(sys.modules, 'matplotlib.figure', None)
    assert cli.main(['evaluate', str(folder), *TRUTH, '--plots', 'x']) == 1
    captured = capsys.readouterr()
    assert 'pip install "depth_person[demo]"' in captured.err
    assert captured.out == ''
