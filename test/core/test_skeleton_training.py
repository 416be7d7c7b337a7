from average_body import average_body
import numpy as np
import pytest

from depth_person import cli
from depth_person.distance.canonical import LEFT, RIGHT
from depth_person.distance.lifter import Lifted
from depth_person.distance.training.hiding import PATTERNS, swapped, visible
from depth_person.distance.training.metrics import groups, report, temperature
from depth_person.distance.training.population import Population, widen_shoulders
from depth_person.distance.training.poses import KINDS, PoseSampler, rotations
from depth_person.distance.training.views import make_examples, ViewOptions
from depth_person.pose.skeleton import Keypoint


def people(n=40):
    body = average_body().astype(np.float32)
    return Population(
        np.repeat(body[None], n, axis=0), np.full(n, 1.69, np.float32),
        np.full(n, 0.336, np.float32), np.arange(n) % 4 == 0, np.zeros(n, np.int64))


def examples(n=3000, **options):
    return make_examples(np.random.default_rng(3), people(), n, ViewOptions(**options))


def test_rotations_turn_right_handed():
    quarter = rotations(np.array([0.0, 0.0, 2.0]), np.array([90.0]))
    np.testing.assert_allclose(quarter[0] @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_sampled_poses_are_rotations_of_every_kind():
    sampler = PoseSampler(np.random.default_rng(0), 400)
    bones = sampler.sample()
    assert set(np.unique(sampler.kind)) == set(range(len(KINDS)))
    assert {'root', 'head', 'upperarm01.L', 'lowerleg01.R'} <= set(bones)
    for rotation in bones.values():
        np.testing.assert_allclose(
            rotation @ rotation.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (400, 3, 3)),
            atol=1e-9)
        np.testing.assert_allclose(np.linalg.det(rotation), 1)


def test_wider_shoulders_take_the_arms_along():
    body = average_body()[None]
    wide = widen_shoulders(body, np.array([1.5]))[0]
    assert np.linalg.norm(wide[2] - wide[5]) == pytest.approx(1.5 * 0.336)
    np.testing.assert_allclose(wide[4] - wide[2], body[0, 4] - body[0, 2])
    np.testing.assert_allclose(wide[8:], body[0, 8:])


def test_visibility_hides_every_pattern_and_faces_from_behind():
    rng = np.random.default_rng(0)
    points = np.broadcast_to(average_body()[:, [0, 2]] * (1, -1), (4000, 18, 2))
    front, back = (visible(rng, points, np.full(4000, yaw)) for yaw in (0.0, np.pi))
    assert front[:, Keypoint.NOSE].mean() > 2 * back[:, Keypoint.NOSE].mean()
    head = front[:, [0, 14, 15]].all(axis=1) & ~front[:, 2:14].any(axis=1)
    assert head.mean() > 0.03
    one_side = front[:, LEFT].sum(axis=1) >= front[:, RIGHT].sum(axis=1) + 5
    assert one_side.mean() > 0.01
    assert sum(share for share, _ in PATTERNS) < 1


def test_sides_are_swapped_mostly_from_behind():
    rng = np.random.default_rng(0)
    front, back = (swapped(rng, np.full(2000, yaw)) for yaw in (0.0, np.pi))
    assert front[:, 2].mean() < 0.05 < 0.15 < back[:, 2].mean()
    assert not (front | back)[:, [Keypoint.NOSE, Keypoint.NECK]].any()


def test_examples_are_finite_and_true_to_their_ranges():
    some = examples(children=0.0, gravity=1.0)
    for values in some.inputs.as_feed().values():
        assert np.isfinite(values).all()
    whole = (some.inputs.known[:, 2:14].all(axis=1) & (some.range > 3)
             & (np.abs(some.elevation) < 0.2))
    assert whole.sum() > 100
    assert np.median(np.abs(some.log_correction[whole])) < 0.15
    level = np.abs(some.inputs.gravity[:, 2] - np.sin(some.elevation))
    assert np.median(level) < 0.25


@pytest.mark.parametrize(('option', 'column'), [
    ('stature', 9), ('shoulder_width', 12), ('children', 14)])
def test_examples_hold_as_much_knowledge_as_was_asked_for(option, column):
    for share in (0.0, 1.0):
        context = examples(500, **{option: share}).inputs.context
        assert (context[:, column] == share).all()
    assert examples(100).inputs.context.shape[1] == 15


def test_the_same_seed_gives_the_same_examples():
    np.testing.assert_array_equal(examples().inputs.points, examples().inputs.points)


def test_the_report_counts_sigmas_and_the_temperature_sets_them_right():
    some = examples()
    rng = np.random.default_rng(0)
    n = len(some.range)
    spread = np.full(n, 0.1)
    told = Lifted(
        some.log_correction + rng.normal(0, 0.2, n), spread, some.neck, np.zeros((n, 2)))
    assert temperature(some, told) == pytest.approx(2.0, rel=0.1)
    told = Lifted(told.log_correction, 2 * spread, told.neck, told.yaw)
    figures = report(some, told)
    assert set(figures) == set(groups(some))
    assert figures['all']['n'] == n
    assert figures['all']['within_1_sigma'] == pytest.approx(0.683, abs=0.03)
    assert figures['all']['within_2_sigma'] == pytest.approx(0.954, abs=0.02)
    assert figures['all']['median_relative_error'] == pytest.approx(0.135, abs=0.015)


def test_training_without_its_libraries_says_what_to_install(monkeypatch, capsys, tmp_path):
    import builtins
    real_import = builtins.__import__

    def without_torch(name, *args, **kwargs):
        if name.partition('.')[0] == 'torch':
            raise ImportError('no torch', name='torch')
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, '__import__', without_torch)
    assert cli.main(['train', 'skeleton', '--out', str(tmp_path)]) == 1
    assert "pip install 'depth_person[train]'" in capsys.readouterr().err
