import json

from average_body import CAMERA
from known_frames import edit, person, write_frame
import numpy as np
import pytest

from depth_person.errors import DepthPersonError
from depth_person.replay.dataset import Reference, TruePerson
from depth_person.replay.reading import read_dataset


def test_stills_and_sequences_are_read_from_one_folder(tmp_path):
    write_frame(tmp_path, 'b', [person((0, 0, 5))])
    write_frame(tmp_path, 'a', [person((0, 0, 4)), person((1, 0, 6), identity=1)])
    for i in range(3):
        write_frame(tmp_path / 'seq' / 'walk', f'{i:03d}', [person((0, 0, 5 + i))], time_s=i / 10)
    dataset = read_dataset(tmp_path)
    assert [[frame.name for frame in clip] for clip in dataset.clips] == [
        ['images/a.png'], ['images/b.png'],
        [f'seq/walk/images/{i:03d}.png' for i in range(3)]]
    assert [frame.time_s for frame in dataset.clips[2]] == [0.0, 0.1, 0.2]
    assert not dataset.faults
    still = dataset.clips[0][0]
    assert still.intrinsics == CAMERA
    assert (still.scenario, still.tag) == ('still', 'a')
    assert [found.range for found in still.people] == pytest.approx([4, 37 ** 0.5])
    assert still.image.is_file()


def test_a_folder_of_timed_frames_is_one_sequence(tmp_path):
    for i in range(3):
        write_frame(tmp_path, str(i), [], time_s=i / 10)
    assert [len(clip) for clip in read_dataset(tmp_path).clips] == [3]


def test_keys_that_a_data_set_does_not_know_are_left_unknown(tmp_path):
    write_frame(
        tmp_path, 'a',
        [person((0, 0, 5), kind=None, yaw_deg=None, visible_fraction=None, keypoints_px=None,
                keypoints_flag=None, neck_px=None, stature_m=None)],
        dist_plumb_bob=None, scenario=None, tag=None)
    frame, = read_dataset(tmp_path).clips[0]
    found, = frame.people
    assert (found.kind, found.yaw_deg, found.keypoints, found.flags, found.neck) == (None,) * 5
    assert frame.intrinsics == CAMERA
    assert (frame.scenario, frame.tag, frame.time_s) == ('', '', None)
    assert frame.mounting.gravity is None


@pytest.mark.parametrize(('pitch', 'roll', 'gravity'), [
    (0, 0, (0, 1, 0)), (90, 0, (0, 0, 1)), (0, 90, (1, 0, 0)), (30, 0, (0, 0.75 ** 0.5, 0.5))])
def test_pitch_and_roll_become_the_direction_down(tmp_path, pitch, roll, gravity):
    write_frame(tmp_path, 'a', [], camera={
        'pitch_down_deg': pitch, 'roll_cw_deg': roll, 'height_m': 1.5, 'slope_fwd_deg': 0.0})
    mounting = read_dataset(tmp_path).clips[0][0].mounting
    np.testing.assert_allclose(mounting.gravity, gravity, atol=1e-12)
    assert mounting.height == 1.5


def test_a_height_above_sloping_ground_is_not_the_height_above_people_s_feet(tmp_path):
    write_frame(tmp_path, 'a', [], camera={'height_m': 1.5, 'slope_right_deg': 4.0})
    assert read_dataset(tmp_path).clips[0][0].mounting.height is None


@pytest.mark.parametrize(('words', 'reference'), [
    (None, Reference.NECK), ('KITTI tracking label: bottom-centre', Reference.VERTICAL),
    ('3D box centre', Reference.VERTICAL),
    ('median depth of a chest ROI (front surface of torso)', Reference.SURFACE)])
def test_the_reference_point_is_known_by_its_words(tmp_path, words, reference):
    write_frame(tmp_path, 'a', [person((0, 0, 5), reference_point=words)])
    assert read_dataset(tmp_path).clips[0][0].people[0].reference is reference


@pytest.mark.parametrize(('reference', 'expected'), [
    (Reference.NECK, 10.4), (Reference.VERTICAL, 8.0 * 1.25), (Reference.SURFACE, 8.075 * 1.25)])
def test_a_range_is_carried_to_the_neck_along_its_ray(reference, expected):
    labelled = TruePerson(0, depth=8.0, range=10.4, reference=reference)
    assert labelled.range_along(np.array([0.75, 0.0, 1.0])) == pytest.approx(expected)
    assert labelled.range_along(np.array([7.5, 0.0, 10.0])) == pytest.approx(expected)


def _remove(*path):
    def change(record):
        for key in path[:-1]:
            record = record[key]
        del record[path[-1]]
    return change


def _set(value, *path):
    def change(record):
        for key in path[:-1]:
            record = record[key]
        record[path[-1]] = value
    return change


@pytest.mark.parametrize(('change', 'message'), [
    (_remove('K'), 'K is missing'), (_remove('K', 'fx'), 'K: fx is missing'),
    (_set('wide', 'K', 'fx'), "K: fx is not a number but 'wide'"),
    (_set(-5, 'K', 'fy'), 'K: fy is -5, not positive'),
    (_set(float('nan'), 'K', 'cx'), 'K: cx is nan'),
    (_set(True, 'width'), 'width is not a number'),
    (_set([0.1], 'dist_plumb_bob'), 'dist_plumb_bob has the shape (1,), not (5,)'),
    (_set(['k1'] * 5, 'dist_plumb_bob'), 'dist_plumb_bob is not a list of numbers'),
    (_remove('persons'), 'persons is missing'), (_set({}, 'persons'), 'persons is not a list'),
    (_set([3], 'persons'), 'persons[0]: is not a JSON object'),
    (_remove('persons', 1, 'range_m'), 'persons[1]: range_m is missing'),
    (_set(0, 'persons', 0, 'depth_z_m'), 'persons[0]: depth_z_m is 0, not positive'),
    (_set([[1, 2]], 'persons', 0, 'keypoints_px'), 'persons[0]: keypoints_px has the shape'),
    (_set(['visible'], 'persons', 0, 'keypoints_flag'), 'is not a list of 17 texts'),
    (_set([1.5], 'persons', 0, 'id'), 'persons[0]: id is neither'),
    (_set(7, 'scenario'), 'scenario is not a text but 7'), (_remove('image'), 'image is missing'),
    (_set('images/none.png', 'image'), 'image names images/none.png, which is not there'),
])
def test_a_bad_frame_is_named_with_its_key_and_the_rest_is_read(tmp_path, change, message):
    write_frame(tmp_path, 'good', [person((0, 0, 5))])
    bad = write_frame(tmp_path, 'bad', [person((0, 0, 5)), person((1, 0, 5), identity=1)])
    edit(bad, change)
    dataset = read_dataset(tmp_path)
    assert [frame.name for frame in dataset.frames] == ['images/good.png']
    fault, = dataset.faults
    assert fault.file == 'gt/bad.json'
    assert message in fault.message


@pytest.mark.parametrize('content', [b'{"image": ', b'', b'\xff\xfe\x00', b'[1, 2]', b'null'])
def test_a_torn_file_is_named(tmp_path, content):
    write_frame(tmp_path, 'good', [])
    (tmp_path / 'gt' / 'torn.json').write_bytes(content)
    dataset = read_dataset(tmp_path)
    assert len(list(dataset.frames)) == 1
    assert [fault.file for fault in dataset.faults] == ['gt/torn.json']


def test_a_folder_without_frames_is_an_error(tmp_path):
    with pytest.raises(DepthPersonError, match=r'holds no gt/\*\.json'):
        read_dataset(tmp_path)
    with pytest.raises(DepthPersonError, match=r'holds no gt/\*\.json'):
        read_dataset(tmp_path / 'missing')


def recording(people):
    return {'reference_point': '3D box centre', 'people': people}


def recorded_person(frame='000001', **more):
    return {
        'frame': frame, 'K': {'fx': 700.0, 'fy': 710.0, 'cx': 600.0, 'cy': 170.0},
        'keypoints_detected': [[500.0 + i, 200.0, 0.5] for i in range(17)],
        'xyz_m': [1.0, 1.0, 20.0], 'range_m': 20.2, **more}


def test_recorded_people_are_grouped_by_frame(tmp_path):
    path = tmp_path / 'recorded.json'
    path.write_text(json.dumps(recording(
        [recorded_person('b'), recorded_person('a'), recorded_person('b', range_m=30.0)])))
    dataset = read_dataset(path)
    assert [(frame.name, len(frame.people)) for frame in dataset.frames] == [('a', 1), ('b', 2)]
    frame = dataset.clips[1][0]
    assert [(found.id, found.depth, found.range) for found in frame.people] == [
        (0, 20.0, 20.2), (2, 20.0, 30.0)]
    assert frame.people[0].reference is Reference.VERTICAL
    assert (frame.intrinsics.fx, frame.intrinsics.fy) == (700.0, 710.0)
    assert frame.image is None


@pytest.mark.parametrize(('wrong', 'message'), [
    ({'xyz_m': [1.0, 1.0, -3.0]}, 'people[1]: xyz_m has the depth -3'),
    ({'keypoints_detected': []}, 'people[1]: keypoints_detected has the shape (0,)'),
    ({'K': None}, 'people[1]: K is missing')])
def test_a_bad_recorded_person_is_named_and_the_rest_is_read(tmp_path, wrong, message):
    path = tmp_path / 'recorded.json'
    path.write_text(json.dumps(recording([recorded_person(), recorded_person(**wrong)])))
    dataset = read_dataset(path)
    assert [len(frame.people) for frame in dataset.frames] == [1]
    assert message in dataset.faults[0].message


def test_a_file_that_is_no_recording_is_an_error(tmp_path):
    path = tmp_path / 'recorded.json'
    path.write_text('{"persons": []}')
    with pytest.raises(DepthPersonError, match=r'recorded\.json people is missing'):
        read_dataset(path)
