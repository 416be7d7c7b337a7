"""Turns what the demo measured into a video and a picture beside the truth."""
import csv

import cv2
import imageio_ffmpeg
from matplotlib import style
from matplotlib.figure import Figure
import numpy as np
from tqdm import tqdm

from depth_person.overlay import person_colour

FAR = 1.15  # the plots reach so many times the furthest truth


def read_samples(path):
    """Return the watcher's samples as columns."""
    with path.open(newline='') as stream:
        rows = list(csv.DictReader(stream))
    names = rows[0] if rows else ()
    return {name: np.array([float(each[name]) for each in rows]) for name in names}


def decoded(message):
    """Return the BGR picture of a sensor_msgs/CompressedImage."""
    return cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_COLOR)


def write_video(overlays, stamps, path):
    """
    Write the overlays as H.264, each for as long as it was the newest.

    :param overlays: CompressedImage by stamp.
    :param stamps: of all images that were sent, in order.
    """
    shown = decoded(next(iter(overlays.values())))
    height, width = shown.shape[:2]
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), pix_fmt_in='bgr24', fps=1 / np.diff(stamps).mean(),
        codec='libx264', quality=7, macro_block_size=2)
    writer.send(None)
    for stamp in tqdm(stamps, desc=path.name, unit='frame'):
        if stamp in overlays:
            shown = decoded(overlays[stamp])
        writer.send(shown)
    writer.close()


def draw_report(samples, truth, picture, path):
    """
    Write the report; each track has the colour that it has in the overlay.

    :param samples: columns, as read_samples returns them.
    :param truth: rows of (stamp, id, x, z, range).
    :param picture: a BGR image shown above the plots.
    :param path: of the PNG.
    """
    with style.context('dark_background'):
        figure = Figure(figsize=(10, 9.2), dpi=90, layout='constrained')
        grid = figure.add_gridspec(2, 2, height_ratios=(1.5, 1), width_ratios=(1.6, 1))
        overlay = figure.add_subplot(grid[0, :])
        overlay.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
        overlay.set_axis_off()
        furthest = FAR * truth[:, 4].max()
        _draw_over_time(figure.add_subplot(grid[1, 0]), samples, truth, furthest)
        _draw_from_above(figure.add_subplot(grid[1, 1]), samples, truth, furthest)
        figure.savefig(path)


def _tracks(samples):
    """Yield (label, colour, columns) of each track, in the order of their ids."""
    for track_id in np.unique(samples['track_id']).astype(int):
        blue, green, red = np.array(person_colour(track_id)) / 255
        own = samples['track_id'] == track_id
        yield (f'#{track_id}', (red, green, blue),
               {name: column[own] for name, column in samples.items()})


def _truths(truth):
    """Yield (label, rows) of each true person; one label is enough for all."""
    for index, person in enumerate(np.unique(truth[:, 1])):
        yield '_' if index else 'truth', truth[truth[:, 1] == person]


def _draw_over_time(axes, samples, truth, furthest):
    """Draw every range, with one sigma to both sides, against time."""
    start = truth[:, 0].min()
    for label, colour, own in _tracks(samples):
        time, distance, sigma = own['stamp_s'] - start, own['range'], own['range_sigma']
        axes.fill_between(
            time, distance - sigma, distance + sigma, color=colour, alpha=0.25, lw=0)
        axes.plot(time, distance, 'o', ms=2.5, color=colour, label=label)
    for label, rows in _truths(truth):
        axes.plot(rows[:, 0] - start, rows[:, 4], color='white', lw=1.2, label=label)
    axes.set(xlabel='time (s)', ylabel='range (m)', ylim=(0, furthest), title='range ± sigma')
    axes.legend(loc='upper left', fontsize='small')
    axes.grid(alpha=0.2)


def _draw_from_above(axes, samples, truth, furthest):
    """Draw every position, with one sigma along its view ray, from above."""
    for _, colour, own in _tracks(samples):
        ends = 1 + np.outer((-1, 1), own['range_sigma'] / own['range'])
        axes.plot(ends * own['x'], ends * own['z'], color=colour, alpha=0.25, lw=1)
        axes.plot(own['x'], own['z'], 'o', ms=2.5, color=colour)
    for _, rows in _truths(truth):
        axes.plot(rows[:, 2], rows[:, 3], color='white', lw=1.2)
    axes.plot(0, 0, '^', color='white', ms=9)
    axes.annotate('camera', (0, 0), (8, -3), textcoords='offset points', fontsize='small')
    axes.set(xlabel='right (m)', ylabel='forward (m)', xlim=(-furthest / 2, furthest / 2),
             ylim=(-0.05 * furthest, furthest), aspect='equal', title="bird's-eye view")
    axes.grid(alpha=0.2)
