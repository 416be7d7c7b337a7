"""Draws what the demo measured, beside the truth."""
import csv

import cv2
from matplotlib.figure import Figure
import numpy as np

COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9')


def read_samples(path):
    """Return the watcher's samples as columns."""
    with path.open(newline='') as stream:
        rows = list(csv.DictReader(stream))
    names = rows[0] if rows else ()
    return {name: np.array([float(each[name]) for each in rows]) for name in names}


def draw_report(samples, truth, picture, path):
    """
    Write the report.

    :param samples: columns, as read_samples returns them.
    :param truth: rows of (stamp, id, x, z, range).
    :param picture: a BGR image shown above the plots.
    :param path: of the PNG.
    """
    figure = Figure(figsize=(10, 9), dpi=90, layout='constrained')
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, 1), width_ratios=(1.5, 1))
    overlay, over_time, above = (
        figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]),
        figure.add_subplot(grid[1, 1]))
    overlay.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
    overlay.set_axis_off()
    start = truth[:, 0].min()
    for index, person in enumerate(np.unique(truth[:, 1]).astype(int)):
        colour = COLOURS[index % len(COLOURS)]
        true = truth[truth[:, 1] == person]
        own = {name: column[samples['truth_id'] == person] for name, column in samples.items()}
        time = own['stamp_s'] - start
        over_time.plot(true[:, 0] - start, true[:, 4], color=colour, lw=1.2)
        over_time.errorbar(
            time, own['range'], yerr=own['range_sigma'], fmt='o', ms=2.5, lw=0.7, alpha=0.6,
            color=colour, label=f'person {person}')
        above.plot(true[:, 2], true[:, 3], color=colour, lw=1.2)
        above.plot(own['x'], own['z'], 'o', ms=2.5, alpha=0.6, color=colour)
    highest = 1.4 * truth[:, 4].max()
    over_time.set(
        xlabel='time (s)', ylabel='range (m)', ylim=(0, highest),
        title='range ± sigma (dots) and truth (lines)')
    over_time.legend(loc='upper left', fontsize='small')
    above.plot(0, 0, '^', color='black', ms=9, label='camera')
    above.set(
        xlabel='right (m)', ylabel='forward (m)', xlim=(-highest / 2, highest / 2),
        ylim=(-0.5, highest), aspect='equal', title="bird's-eye view")
    above.legend(loc='upper left', fontsize='small')
    for axes in (over_time, above):
        axes.grid(alpha=0.3)
    figure.savefig(path)
