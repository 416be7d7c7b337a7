"""The verb validate: the second paper's validation of predicted distances, on a table."""
from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depth_person.distance.body_box import PIXEL_FEATURES
from depth_person.distance.body_dimensions import BodyDimensionsModel
from depth_person.distance.body_table import BodyTable, read_body_table
from depth_person.distance.validation import (
    Agreement,
    agreement,
    moved_to_truth,
    SIGNIFICANCE,
    without_bias,
)
from depth_person.errors import DepthPersonError
from depth_person.verbs.numbers import positive

_Array = NDArray[np.float64]

_ACTUAL, _PREDICTED, _CORRECTED = (
    'actual_distance_cm', 'predicted_distance_cm', 'corrected_distance_cm')
_HEIGHTS = ('real_height_cm', 'predicted_height_cm')
#: Fewer pairs have neither a correlation nor a spread worth the name.
_LEAST_ROWS = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        'table', type=Path, metavar='TABLE',
        help=f'CSV file with the columns {_ACTUAL} and {_PREDICTED}, and, if at hand, '
             f'{", ".join((*_HEIGHTS, _CORRECTED))}')
    parser.add_argument(
        '--model', type=Path, metavar='ONNX',
        help='predict with this model of kind paper, from the columns '
             + ', '.join(PIXEL_FEATURES))
    parser.add_argument(
        '--dx', type=positive, metavar='CM',
        help="the paper's step towards the actual distance (default: s / sqrt(n) of the errors)")
    parser.add_argument(
        '--plots', type=Path, metavar='DIR', help='draw the scatter plot into DIR/validation.png')


def main(args: argparse.Namespace) -> int:
    """Print the table, the figures and what the t-test says."""
    table = read_body_table(
        args.table, required=(_ACTUAL, *(PIXEL_FEATURES if args.model else (_PREDICTED,))),
        optional=(*_HEIGHTS, _CORRECTED), least_rows=_LEAST_ROWS)
    table.must_vary(_ACTUAL, 'there is no correlation with one distance')
    actual = table[_ACTUAL]
    predicted = _told(table, args.model) if args.model else table[_PREDICTED]
    if np.ptp(predicted) == 0:
        raise DepthPersonError(
            f'{args.table}: {_PREDICTED} is {predicted[0]:g} in all {len(table)} rows; '
            'there is no correlation with one distance')
    plain = agreement(actual, predicted)
    dx = plain.standard_error if args.dx is None else args.dx
    columns = {
        'predicted': predicted, 'towards truth': moved_to_truth(actual, predicted, dx),
        'without bias': without_bias(actual, predicted)}
    if _CORRECTED in table and np.isfinite(table[_CORRECTED]).all():
        columns['corrected, printed'] = table[_CORRECTED]
    print('\n'.join(_rows(actual, columns)))
    print()
    print('\n'.join(_figures({name: agreement(actual, told) for name, told in columns.items()})))
    print()
    print('\n'.join(_conclusions(plain, dx)))
    print('\n'.join(_heights(table)))
    if args.plots:
        print(f'wrote {_plot(actual, columns, plain, args.plots)}')
    return 0


def _told(table: BodyTable, path: Path) -> _Array:
    """Return what a model predicts from the boxes of the table, centimetres."""
    model = BodyDimensionsModel(path)
    if model.kind != 'paper':
        raise DepthPersonError(
            f'{path} is of kind {model.kind}, which needs the camera of each box; '
            'validate --model takes one of kind paper')
    told = model.predict(np.column_stack([table[name] for name in PIXEL_FEATURES]))
    return 100 * np.exp(told.log_distance)


def _rows(actual: _Array, columns: dict[str, _Array]) -> Iterator[str]:
    names = list(columns)
    yield f'{"row":>5}{"actual":>10}{"error":>10}' + ''.join(f'{name:>20}' for name in names)
    for i, true in enumerate(actual):
        yield f'{i + 1:5d}{true:10.2f}{columns["predicted"][i] - true:+10.2f}' + ''.join(
            f'{columns[name][i]:20.2f}' for name in names)


def _figures(results: dict[str, Agreement]) -> Iterator[str]:
    yield (f'{"cm":20}{"n":>6}{"RMSE":>9}{"r":>9}{"bias":>9}{"s":>9}{"s/sqrt(n)":>11}'
           f'{"t":>9}{"df":>6}{"p":>9}')
    for name, told in results.items():
        yield (f'{name:20}{told.n:6d}{told.rmse:9.2f}{told.pearson_r:9.4f}'
               f'{told.mean_error:+9.2f}{told.error_spread:9.2f}{told.standard_error:11.2f}'
               f'{told.t:9.4f}{told.degrees_of_freedom:6d}{told.p_value:9.4f}')


def _conclusions(plain: Agreement, dx: float) -> Iterator[str]:
    verdict = 'rejected' if plain.biased else 'not rejected'
    yield (f'That the true mean error is zero is {verdict} at {SIGNIFICANCE:.0%}: '
           f't = {plain.t:.4f} on {plain.degrees_of_freedom} degrees of freedom, '
           f'p = {plain.p_value:.4f} (two-sided).')
    if not plain.biased:
        yield 'Such a test finds no bias; it does not show that there is none.'
    yield (f'"towards truth" moves a prediction by dx = {dx:.2f} cm where that brings it nearer '
           'to the actual distance:')
    yield ('it has to know the distance, so nothing can use it to measure one. "without bias" '
           'takes off the mean')
    yield (f'error of the other rows, which a calibration can. One prediction is right to within '
           f's = {plain.error_spread:.2f} cm, not dx.')


def _heights(table: BodyTable) -> Iterator[str]:
    if not all(name in table for name in _HEIGHTS):
        return
    real, told = (table[name] for name in _HEIGHTS)
    both = np.isfinite(real) & np.isfinite(told)
    if both.sum() >= _LEAST_ROWS and np.ptp(real[both]) > 0 and np.ptp(told[both]) > 0:
        yield ''
        yield from _figures({'height': agreement(real[both], told[both])})


def _plot(
    actual: _Array, columns: dict[str, _Array], plain: Agreement, folder: Path,
) -> Path:
    from depth_person.replay.drawing import Figure, save_figures  # needs matplotlib
    figure = Figure(figsize=(7, 7), layout='constrained')
    axes = figure.subplots()
    for (name, told), marker in zip(columns.items(), 'ox+^', strict=False):
        axes.plot(actual, told, marker, ms=5, alpha=0.8, label=name)
    ends = [min(actual.min(), columns['predicted'].min()),
            max(actual.max(), columns['predicted'].max())]
    axes.plot(ends, ends, 'k-', lw=0.8)
    axes.set(xlabel='actual distance (cm)', ylabel='predicted distance (cm)',
             title=f'RMSE {plain.rmse:.1f} cm, r {plain.pearson_r:.3f}')
    axes.legend(fontsize='small')
    return save_figures({'validation.png': figure}, folder)[0]
