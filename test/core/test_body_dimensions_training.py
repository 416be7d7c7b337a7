import builtins
import json

from average_body import average_body
import numpy as np
import onnx
import pytest
from sklearn.model_selection import GroupShuffleSplit, train_test_split

from depth_person import cli
from depth_person.distance.body_box import ANGLE_FEATURES, MISSING
from depth_person.distance.body_dimensions import BodyDimensionsModel, FEATURES, model_file
from depth_person.distance.training.body_report import figures
from depth_person.distance.training.body_rows import normalised_rows, paper_rows
from depth_person.distance.training.body_tables import table_rows
from depth_person.distance.training.body_views import (
    PAPER_CAMERA,
    PAPER_DISTANCES,
    paper_views,
    random_camera,
    random_views,
)
from depth_person.distance.training.population import Population
from depth_person.distance.training.views import tilted
from depth_person.errors import DepthPersonError

CAMERA = {'focal_px': 900.0, 'center_x_px': 639.5, 'center_y_px': 359.5, 'pitch_down_deg': 0.0}


def people(n=40):
    """Return average bodies of statures from 1.15 to 2.0 m, standing on the floor."""
    size = np.linspace(1.15, 2.0, n) / 1.69
    keypoints = (average_body() + np.array([0, 0, 1.36])) * size[:, None, None]
    return Population(
        keypoints.astype(np.float32), (1.69 * size).astype(np.float32),
        (0.336 * size).astype(np.float32), size < 0.8, np.zeros(n, np.int64))


def boxes(n=60, seed=1):
    """Return the rows of a table of boxes seen by a level camera one metre above the floor."""
    rng = np.random.default_rng(seed)
    stature, z = rng.uniform(1.1, 1.9, n), rng.uniform(3.8, 6.8, n)
    focal = CAMERA['focal_px']
    return [
        {'real_height_cm': 100 * s, 'actual_distance_cm': 100 * d, 'd1_height_px': focal * s / d,
         'd2_width_px': focal * 0.3 * s / d, 'd3_center_x_px': 640 + rng.normal(0, 50),
         'd4_center_y_px': 359.5 + focal * (1.0 - s / 2) / d, 'person': f'p{i // 2}', **CAMERA}
        for i, (s, d) in enumerate(zip(stature, z, strict=True))]


def written(tmp_path, rows, leave_out=()):
    names = [name for name in rows[0] if name not in leave_out]
    path = tmp_path / 'boxes.csv'
    path.write_text('\n'.join([
        ','.join(names), *(','.join(str(row[name]) for name in names) for row in rows)]) + '\n')
    return path


def test_random_views_show_people_where_they_are_said_to_be():
    rng = np.random.default_rng(3)
    for _ in range(5):
        camera = random_camera(rng)
        views = random_views(rng, people(), camera, 200)
        assert len(views) > 20
        assert np.linalg.norm(views.gravity, axis=1) == pytest.approx(1.0)
        assert (views.stature >= 1.1).all()
        rows = normalised_rows(rng, views)
        height = rows.features[:, ANGLE_FEATURES.index('height_rad')]
        level = np.abs(views.elevation) < 0.2
        # An upright rod of the person's stature, but for noise and what perspective does.
        assert np.median((views.range * height / views.stature)[level]) == pytest.approx(
            1.0, abs=0.06)
        elevation = rows.features[:, ANGLE_FEATURES.index('elevation_rad')]
        known = elevation != MISSING
        assert 0.3 < known.mean() < 0.7
        assert np.median(np.abs(elevation - views.elevation)[known & level]) < 0.1


def test_the_papers_views_are_at_its_distances_before_its_camera():
    views = paper_views(np.random.default_rng(4), people(), 10)
    assert set(np.round(views.distance, 1)) <= set(np.round(PAPER_DISTANCES, 1))
    assert (np.abs(views.distance[:, None] - PAPER_DISTANCES).min(axis=1) < 1e-6).all()
    assert (views.range > views.distance).all()
    rows = paper_rows(views)
    expected = PAPER_CAMERA.focal_px * rows.stature / rows.distance
    assert np.median(rows.features[:, 0] / expected) == pytest.approx(1.0, abs=0.05)
    soles = rows.features[:, 3] + rows.features[:, 0] / 2
    depression = PAPER_CAMERA.focal_px * 1.0 / rows.distance
    assert np.median((soles - 1999.5) / depression) == pytest.approx(1.0, abs=0.07)


def test_an_attitude_sensors_error_is_as_large_as_it_is_said_to_be():
    down = np.repeat([[0.0, 1.0, 0.0]], 4000, axis=0)
    off = np.arccos(np.clip(tilted(np.random.default_rng(5), down)[:, 1], -1, 1))
    assert 0.005 < np.median(off) < 0.02
    assert off.max() < 0.2


def test_figures_of_a_hand_worked_table():
    told = figures(np.array([1.0, 2.0, 4.0]), np.array([1.1, 2.0, 3.0]), np.array([0.2, 0.2, 0.6]))
    assert told['n'] == 3
    assert told['rmse_m'] == pytest.approx(np.sqrt(1.01 / 3), abs=1e-4)
    assert told['median_relative_error'] == pytest.approx(0.1)
    assert told['within_1_sigma'] == pytest.approx(2 / 3, abs=1e-4)
    assert told['within_2_sigma'] == 1.0


def test_the_split_of_a_table_without_persons_is_the_papers():
    learn, judge = next(GroupShuffleSplit(1, test_size=0.3, random_state=66).split(
        np.zeros(50), groups=np.arange(50)))
    theirs, held_out = train_test_split(np.arange(50), test_size=0.3, random_state=66)
    assert set(judge) == set(held_out)
    assert set(learn) == set(theirs)


def test_a_table_gives_the_box_in_angles(tmp_path):
    rows = boxes()
    told = table_rows(written(tmp_path, rows, ['pitch_down_deg']), 'normalised')
    column = {name: told.features[:, i] for i, name in enumerate(ANGLE_FEATURES)}
    assert np.median(told.distance * column['height_rad'] / told.stature) == pytest.approx(
        1.0, abs=0.03)
    assert column['log_aspect'] == pytest.approx(np.log(0.3))
    assert (column['elevation_rad'] == MISSING).all()
    assert (column['hip_level'] == MISSING).all()
    assert (column['children'] == 1).all()
    assert len(np.unique(told.person)) == 30
    level = table_rows(written(tmp_path, [
        {**row, 'hip_level': 0.45} for row in rows]), 'normalised')
    elevation = level.features[:, ANGLE_FEATURES.index('elevation_rad')]
    below = [row['d4_center_y_px'] - 359.5 for row in rows]
    assert elevation == pytest.approx(np.arctan(np.array(below) / 900), abs=1e-3)
    assert (level.features[:, ANGLE_FEATURES.index('hip_level')] == 0.45).all()


@pytest.mark.parametrize(('kind', 'leave_out', 'change', 'message'), [
    ('paper', ('d2_width_px',), {}, 'no column d2_width_px'),
    ('normalised', ('focal_px',), {}, 'no column focal_px'),
    ('paper', (), {'d1_height_px': -5}, 'row 1, column d1_height_px: -5 is not positive'),
    ('paper', (), {'real_height_cm': 'tall'}, "row 1, column real_height_cm: 'tall' is not a num"),
])
def test_a_bad_training_table_is_named(tmp_path, kind, leave_out, change, message):
    rows = boxes()
    rows[0] |= change
    with pytest.raises(DepthPersonError, match=message):
        table_rows(written(tmp_path, rows, leave_out), kind)


def test_too_few_rows_and_one_height_train_nothing(tmp_path, capsys):
    few = written(tmp_path, boxes(29))
    assert cli.main(['train', 'body-dimensions', str(few), '--out', str(tmp_path)]) == 1
    assert '29 rows are too few; 30 are needed' in capsys.readouterr().err
    same = written(tmp_path, [{**row, 'real_height_cm': 170} for row in boxes()])
    assert cli.main(['train', 'body-dimensions', str(same), '--out', str(tmp_path)]) == 1
    assert 'real_height_cm is 170 in all 60 rows' in capsys.readouterr().err


def test_a_users_table_trains_both_models_which_then_measure(tmp_path, capsys):
    path = written(tmp_path, boxes(150))
    arguments = ['train', 'body-dimensions', str(path), '--out', str(tmp_path), '--trees', '30']
    assert cli.main(arguments) == 0
    for kind in FEATURES:
        summary = json.loads((tmp_path / f'body_dimensions_{kind}.json').read_text())
        assert summary['split']['distance']['n'] in (45, 46)
        assert summary['split']['distance']['pearson_r'] > 0.9
        model = BodyDimensionsModel(tmp_path / f'body_dimensions_{kind}.onnx')
        assert model.kind == kind
        assert model.camera is None
    fresh = written(tmp_path, boxes(30, seed=2))
    model = tmp_path / 'body_dimensions_paper.onnx'
    capsys.readouterr()
    assert cli.main(['validate', str(fresh), '--model', str(model)]) == 0
    figures_line = next(line for line in capsys.readouterr().out.splitlines()
                        if line.startswith('predicted'))
    assert float(figures_line.split()[3]) > 0.9


def test_training_without_scikit_learn_says_what_to_install(tmp_path, capsys, monkeypatch):
    real_import = builtins.__import__

    def without(name, *args, **kwargs):
        if name.endswith('training.body_dimensions'):
            raise ImportError("No module named 'sklearn'", name='sklearn')
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, '__import__', without)
    assert cli.main(['train', 'body-dimensions', 'any.csv', '--out', str(tmp_path)]) == 1
    assert "sklearn is missing; install them with: pip install 'depth_person[train]'" in (
        capsys.readouterr().err)


@pytest.mark.parametrize('kind', FEATURES)
def test_the_models_that_ship_are_small_and_valid(kind):
    assert model_file(kind).stat().st_size <= 1_000_000
    onnx.checker.check_model(onnx.load(model_file(kind)), full_check=True)
    assert (BodyDimensionsModel(model_file(kind)).camera is not None) == (kind == 'paper')


@pytest.mark.parametrize('kind', FEATURES)
def test_sigma_was_true_on_people_who_were_held_out(kind):
    summary = json.loads(model_file(kind).with_suffix('.json').read_text())
    for name, groups in summary['held_out_people'].items():
        told = groups['all']['body_dimensions']
        assert told['n'] > 500, name
        assert 0.6 <= told['within_1_sigma'] <= 0.78, name
        assert 0.9 <= told['within_2_sigma'] <= 0.98, name
