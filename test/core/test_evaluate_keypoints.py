from average_body import CAMERA, seen, standing_at
import cv2
import numpy as np
import pytest

from depth_person.errors import DepthPersonError
from depth_person.pose.skeleton import COCO17_ROWS, Keypoint
from depth_person.replay.dataset import TrueFrame, TruePerson
from depth_person.replay.keypoints import NetworkKeypoints, RecordedKeypoints, TrueKeypoints

COCO17 = np.argsort(COCO17_ROWS)[1:]


def true_person(*, hidden=(), flags=None, neck=(600.0, 300.0)):
    """Return a person; hidden gives COCO-18 names and what hides each."""
    keypoints = np.insert(CAMERA.project(standing_at((0, 0, 5)))[COCO17], 2, 2.0, axis=1)
    reasons = ['visible'] * 17
    for name, reason in dict(hidden).items():
        row = int(COCO17_ROWS[Keypoint[name]])
        keypoints[row, 2] = 0 if reason == 'outside' else 1
        reasons[row] = reason
    return TruePerson(
        0, 5.0, 5.0, keypoints=keypoints, flags=tuple(reasons) if flags is None else None,
        neck=np.array(neck))


def frame(*people, image=None):
    return TrueFrame('a', image, CAMERA, people)


HIDDEN = {
    'L_SHOULDER': 'self_occluded', 'NOSE': 'self_occluded', 'R_KNEE': 'occluded',
    'L_HIP': 'occluded_by_person', 'R_ANKLE': 'outside'}


@pytest.mark.parametrize(('hidden', 'missing'), [
    ('none', set(HIDDEN) | {'NECK'}),
    ('own-body', {'NOSE', 'R_KNEE', 'L_HIP', 'R_ANKLE'}),
    ('all', {'R_ANKLE'})])
def test_what_is_hidden_is_missing_as_asked(hidden, missing):
    people = TrueKeypoints(hidden=hidden).people(frame(true_person(hidden=HIDDEN)))
    unseen = {row.name for row in Keypoint if np.isnan(people.keypoints[0, row]).any()}
    assert unseen == missing
    assert (people.keypoints[0, Keypoint.R_SHOULDER, 2]) == 1


@pytest.mark.parametrize('hidden', ['none', 'own-body'])
def test_without_flags_all_that_is_hidden_is_missing(hidden):
    people = TrueKeypoints(hidden=hidden).people(
        frame(true_person(hidden={'L_KNEE': 'self_occluded'}, flags=())))
    assert np.isnan(people.keypoints[0, Keypoint.L_KNEE]).all()


def test_noise_is_as_large_as_asked_and_the_same_each_time():
    exact = TrueKeypoints().people(frame(*[true_person()] * 200)).keypoints[..., :2]
    noisy, again = (TrueKeypoints(noise_px=2.0, seed=4).people(frame(*[true_person()] * 200))
                    for _ in range(2))
    error = np.delete(noisy.keypoints[..., :2] - exact, Keypoint.NECK, axis=1)
    assert error.std() == pytest.approx(2.0, rel=0.05)
    np.testing.assert_array_equal(noisy.keypoints, again.keypoints)


def test_the_neck_is_measured_only_if_asked_and_known():
    exact = TrueKeypoints(measure_neck=True).people(frame(true_person()))
    assert exact.neck_measured
    assert exact.keypoints[0, Keypoint.NECK].tolist() == [600, 300, 1]
    assert not TrueKeypoints().people(frame(true_person())).neck_measured
    unknown = TruePerson(0, 5.0, 5.0, keypoints=true_person().keypoints)
    assert not TrueKeypoints(measure_neck=True).people(frame(unknown)).neck_measured


def test_people_without_a_keypoint_are_not_found():
    hidden = {row.name: 'occluded' for row in Keypoint if row != Keypoint.NECK}
    truth = frame(true_person(), true_person(hidden=hidden), true_person())
    source = TrueKeypoints()
    people = source.people(truth)
    assert people.track_ids.tolist() == [0, 2]
    assert source.match(truth, people).tolist() == [0, -1, 1]
    nobody = frame()
    assert len(source.people(nobody)) == 0


def test_recorded_keypoints_of_score_zero_are_missing():
    recorded = np.full((17, 3), (10.0, 20.0, 0.5))
    recorded[3, 2] = 0
    source = RecordedKeypoints()
    people = source.people(frame(TruePerson(0, 5.0, 5.0, recorded=recorded)))
    assert np.isnan(people.keypoints[0, Keypoint.L_EAR]).all()
    assert people.keypoints[0, Keypoint.R_EAR].tolist() == [10, 20, 0.5]


@pytest.mark.parametrize(('source', 'message'), [
    (TrueKeypoints(), 'keypoints_px'), (RecordedKeypoints(), 'keypoints_detected'),
    (NetworkKeypoints(None), 'no image')])
def test_a_source_says_what_a_frame_lacks(source, message):
    with pytest.raises(DepthPersonError, match=message):
        source.people(frame(TruePerson(0, 5.0, 5.0)))


class Stage:
    """A pose stage that keeps the frames it is given."""

    def __init__(self):
        self.frames = []

    def estimate(self, given):
        self.frames.append(given)
        return seen(standing_at((0, 0, 5)))


def test_the_network_sees_each_image_and_an_hour_between_clips(tmp_path):
    path = tmp_path / 'a.png'
    cv2.imwrite(str(path), np.full((720, 1280, 3), (1, 2, 3), np.uint8))
    stage = Stage()
    source = NetworkKeypoints(stage)
    for times in ((0.0, 0.1), (0.0,)):
        source.start_clip()
        for time_s in times:
            source.people(TrueFrame('a', path, CAMERA, (), time_s=time_s))
    stamps = np.array([given.stamp_ns for given in stage.frames])
    assert np.diff(stamps).tolist() == [100_000_000, 3599_900_000_000]
    assert stage.frames[0].image[5, 5].tolist() == [1, 2, 3]
    assert stage.frames[0].intrinsics is CAMERA


@pytest.mark.parametrize(('content', 'message'), [
    (b'', 'not an image'), (b'not a picture', 'not an image'), (None, 'is 64x32 px')])
def test_an_image_that_cannot_be_used_is_an_error(tmp_path, content, message):
    path = tmp_path / 'a.png'
    if content is None:
        cv2.imwrite(str(path), np.zeros((32, 64, 3), np.uint8))
    else:
        path.write_bytes(content)
    with pytest.raises(DepthPersonError, match=message):
        NetworkKeypoints(Stage()).people(frame(image=path))
