import builtins

import numpy as np
import pytest

from depth_person import cli
from depth_person.distance.body_dimensions import model_file
from depth_person.distance.validation import (
    agreement,
    moved_to_truth,
    perspective_shift,
    t_test_p_value,
    without_bias,
)


def test_the_figures_of_a_hand_worked_table():
    # Errors 1, 2, 3: mean 2, s = 1, s / sqrt(3) = 0.5774, t = 3.4641 on 2 degrees of freedom.
    told = agreement([100.0, 200.0, 300.0], [101.0, 202.0, 303.0])
    assert told.rmse == pytest.approx(np.sqrt(14 / 3))
    assert told.mean_error == pytest.approx(2.0)
    assert told.error_spread == pytest.approx(1.0)
    assert told.standard_error == pytest.approx(0.57735, abs=1e-5)
    assert told.t == pytest.approx(3.46410, abs=1e-5)
    assert told.degrees_of_freedom == 2
    assert told.p_value == pytest.approx(0.07418, abs=1e-5)
    assert told.pearson_r == pytest.approx(1.0)
    assert not told.biased


def test_the_t_that_the_paper_prints_rejects_nothing():
    assert t_test_p_value(0.9968, 158) == pytest.approx(0.3204, abs=1e-4)
    assert t_test_p_value(-0.9968, 158) == t_test_p_value(0.9968, 158)


@pytest.mark.parametrize(('t', 'degrees', 'p'), [
    (12.706, 1, 0.05), (2.228, 10, 0.05), (1.975, 158, 0.05), (0.0, 5, 1.0)])
def test_the_t_test_gives_what_tables_print(t, degrees, p):
    assert t_test_p_value(t, degrees) == pytest.approx(p, abs=2e-4)


def test_a_constant_error_is_a_bias_for_certain():
    told = agreement([1.0, 2.0, 4.0], [1.5, 2.5, 4.5])
    assert told.biased
    assert told.p_value == 0.0
    assert not agreement([1.0, 2.0, 4.0], [1.0, 2.0, 4.0]).biased


@pytest.mark.parametrize(('actual', 'predicted'), [
    ([1.0, 2.0], [1.0, 2.0]), ([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]),
    ([1.0, 2.0, 3.0], [2.0, 2.0, 2.0])])
def test_what_has_no_correlation_is_refused(actual, predicted):
    with pytest.raises(ValueError, match='at least three'):
        agreement(actual, predicted)


def test_the_papers_correction_looks_at_the_truth():
    actual = np.array([500.0, 500.0, 500.0])
    predicted = np.array([510.0, 490.0, 503.0])
    assert moved_to_truth(actual, predicted, 7.0).tolist() == [503.0, 497.0, 503.0]
    # The same prediction is moved either way, depending on what it should have been.
    assert moved_to_truth([480.0, 520.0], [500.0, 500.0], 7.0).tolist() == [493.0, 507.0]


def test_the_correction_that_can_be_used_does_not_look_at_its_own_row():
    actual, predicted = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.5, 2.5, 3.5, 4.5])
    assert without_bias(actual, predicted) == pytest.approx(actual)
    other = actual.copy()
    other[0] = 9.0
    assert without_bias(other, predicted)[0] == without_bias(actual, predicted)[0]
    assert without_bias(other, predicted)[1] != without_bias(actual, predicted)[1]


def test_a_change_of_depth_moves_along_the_view_ray():
    assert perspective_shift(2.0, np.radians(45)) == pytest.approx(2.0)
    assert perspective_shift([1.0, -1.0], np.radians(30)) == pytest.approx([0.57735, -0.57735])


PAIRS = [(400, 404), (500, 498), (600, 611), (700, 689), (800, 804)]


def table(tmp_path, rows, header='actual_distance_cm,predicted_distance_cm'):
    path = tmp_path / 'pairs.csv'
    path.write_text('\n'.join([header, *(','.join(map(str, row)) for row in rows)]) + '\n')
    return str(path)


def test_validate_prints_rows_figures_and_the_conclusion(tmp_path, capsys):
    assert cli.main(['validate', table(tmp_path, PAIRS), '--plots', str(tmp_path / 'out')]) == 0
    printed = capsys.readouterr().out
    told = agreement(*np.array(PAIRS, float).T)
    figures = next(line for line in printed.splitlines() if line.startswith('predicted'))
    assert figures.split()[1:4] == ['5', f'{told.rmse:.2f}', f'{told.pearson_r:.4f}']
    assert len([line for line in printed.splitlines() if line.strip()[:1].isdigit()]) == 5
    assert f't = {told.t:.4f} on 4 degrees of freedom, p = {told.p_value:.4f}' in printed
    assert 'is not rejected at 5%' in printed
    assert (tmp_path / 'out' / 'validation.png').stat().st_size > 5000


def test_validate_says_when_there_is_a_bias(tmp_path, capsys):
    rows = [(true, told + 60) for true, told in PAIRS]
    assert cli.main(['validate', table(tmp_path, rows)]) == 0
    printed = capsys.readouterr().out
    assert 'is rejected at 5%' in printed
    assert 'it does not show' not in printed


def test_validate_takes_heights_printed_corrections_and_a_step(tmp_path, capsys):
    header = ('real_height_cm,predicted_height_cm,actual_distance_cm,predicted_distance_cm,'
              'corrected_distance_cm')
    rows = [(150, '', 400, 404, 402), (160, 163, 500, 498, 498), (170, 171, 600, 611, 607),
            (180, 176, 700, 689, 693)]
    assert cli.main(['validate', table(tmp_path, rows, header), '--dx', '4']) == 0
    printed = capsys.readouterr().out
    heights = next(line for line in printed.splitlines() if line.startswith('height'))
    assert heights.split()[1:3] == ['3', f'{np.sqrt((9 + 1 + 16) / 3):.2f}']
    assert 'corrected, printed' in printed
    assert 'dx = 4.00 cm' in printed
    third = next(line for line in printed.splitlines() if line.split()[:1] == ['3'])
    assert third.split()[3:5] == ['611.00', '607.00']


def test_validate_predicts_with_a_model(tmp_path, capsys):
    header = 'actual_distance_cm,d1_height_px,d2_width_px,d3_center_x_px,d4_center_y_px'
    # 1.75 m tall and 0.55 m wide before the paper's camera, one metre above the floor.
    focal = 24 / 3.9e-3
    rows = [(100 * z, round(focal * 1.75 / z, 1), round(focal * 0.55 / z, 1), 3000,
             round(1999.5 + focal * 0.125 / z, 1)) for z in (4.0, 5.0, 6.0, 6.6)]
    path = table(tmp_path, rows, header)
    assert cli.main(['validate', path, '--model', str(model_file('paper'))]) == 0
    figures = next(line for line in capsys.readouterr().out.splitlines()
                   if line.startswith('predicted'))
    assert float(figures.split()[2]) < 35
    assert cli.main(['validate', path, '--model', str(model_file('normalised'))]) == 1
    assert 'takes one of kind paper' in capsys.readouterr().err


@pytest.mark.parametrize(('rows', 'message'), [
    (PAIRS[:2], '2 rows are too few; 3 are needed'),
    ([(400, 400), (400, 401), (400, 402)], 'actual_distance_cm is 400 in all 3 rows'),
    ([(400, 500), (410, 500), (420, 500)], 'predicted_distance_cm is 500 in all 3 rows'),
    ([*PAIRS, (900, 'far')], "row 6, column predicted_distance_cm: 'far' is not a number"),
    ([*PAIRS, PAIRS[0]], 'row 6 repeats row 1')])
def test_validate_names_what_is_wrong_with_a_table(tmp_path, capsys, rows, message):
    assert cli.main(['validate', table(tmp_path, rows)]) == 1
    assert message in capsys.readouterr().err


def test_validate_without_scipy_says_what_to_install(tmp_path, capsys, monkeypatch):
    real_import = builtins.__import__

    def without_scipy(name, *args, **kwargs):
        if name.startswith('scipy'):
            raise ImportError(f'No module named {name!r}', name=name)
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, '__import__', without_scipy)
    assert cli.main(['validate', table(tmp_path, PAIRS)]) == 1
    assert "pip install 'depth_person[train]'" in capsys.readouterr().err
