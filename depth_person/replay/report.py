"""One self-contained page about a bag of results."""
from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timezone
from html import escape
from pathlib import Path

import numpy as np

from depth_person.camera.bag import BagReader
from depth_person.errors import DepthPersonError
from depth_person.replay.drawing import as_uri
from depth_person.replay.record import Record
from depth_person.replay.report_frames import sample_frames, SampleFrames
from depth_person.replay.report_page import faults_box, figure, page, paragraphs, picture, table
from depth_person.replay.report_plots import (
    above_figure,
    errors_figure,
    ranges_figure,
    timing_figure,
)
from depth_person.replay.results import choose_topic, read_results, Results
from depth_person.replay.timing import GAP, Timing, timing
from depth_person.replay.truth import read_truth
from depth_person.replay.truth_errors import truth_errors, TruthErrors
from depth_person.replay.unfinished import RunRecord

#: Earlier stamps are of a clock that began at zero, seconds.
_EARLIEST_S = 10**9
#: So many people are listed, those who were there the longest.
MOST_LISTED = 50
#: Column heading -> the figure of depth_person.replay.metrics under it, and how it is printed.
_ERRORS = {
    'n': ('n', '{:d}'), 'found': ('found', '{:.0%}'), 'with range': ('with_range', '{:.0%}'),
    'median error m': ('median_abs', '{:.2f}'), 'mean error m': ('mean_abs', '{:.2f}'),
    'median error': ('median_rel', '{:.1%}'), 'RMSE m': ('rmse', '{:.2f}'),
    'bias m': ('bias', '{:+.2f}'), 'within 1 sigma': ('coverage_1', '{:.0%}'),
    'within 2 sigma': ('coverage_2', '{:.0%}'),
}


@dataclass(frozen=True)
class Report:
    """
    A page, and what was amiss with the bag.

    :ivar html: of the page.
    :ivar faults: what could not be used, a line each.
    """

    html: str
    faults: tuple[str, ...]


def make_report(
    path: Path, *, truth: str | None = None, topic: str | None = None,
    image_topic: str | None = None, frames: int = 6,
) -> Report:
    """
    Return a page about a bag of results; the same bag gives the same page.

    :param truth: a topic, or the path of a CSV file; see depth_person.replay.truth.
    :param topic: of the results; None for the only one.
    :param image_topic: of the sample frames; None for the only one.
    :param frames: how many of them.
    :raises DepthPersonError: when the bag holds no results, or the truth cannot be read.
    """
    results = read_results(path, topic=topic)
    known = None if truth is None else read_truth(truth, results, path)
    errors = None if known is None else truth_errors(known, results)
    with BagReader(path) as bag:
        pictures = sample_frames(
            bag, results, topic=choose_topic(bag, topic), count=frames, image_topic=image_topic)
        contents = [(each.name, each.msgtype, each.count) for each in bag.topics.values()]
    faults = (*results.faults, *pictures.faults, *(known.faults if known else ()))
    run = _run_record(path)
    # What nodes find is recorded after its image; what process finds, at the image's time.
    times = timing(results, offline=run is not None or (
        0 < pictures.simultaneous == pictures.images - pictures.unmeasured))
    points = len(results.people)
    body = [
        faults_box('What could not be used', faults), _origin(results, run),
        _overview(results, times, pictures),
        figure('Range over time', as_uri(ranges_figure(results, known), points=points),
               'Lines: range, with a band of one sigma. Dots: what each frame says by itself, '
               'where that was recorded. Rings: predicted, not seen.'),
        figure("Bird's-eye view", as_uri(above_figure(results, known), points=points),
               'Places relative to the camera; lines of one sigma along the view ray.'),
        _errors(errors), _timing(times), _frames(results, pictures), _topics(contents)]
    return Report(page(f'People in {path.name}', '\n'.join(filter(None, body))), faults)


def _run_record(path: Path) -> RunRecord | None:
    """Return what `process` noted beside a bag; None of one that was recorded in flight."""
    try:
        return RunRecord.read(path if path.is_dir() else path.parent)
    except DepthPersonError:
        return None


def _origin(results: Results, run: RunRecord | None) -> str:
    """Say when the bag was recorded, and what `process` noted beside it."""
    start_s = float(results.stamps_ns[0]) * 1e-9
    when = (f'{datetime.fromtimestamp(start_s, timezone.utc):%Y-%m-%d %H:%M:%S} UTC'
            if start_s > _EARLIEST_S else f'stamp {start_s:.3f} s, of a clock without a date')
    lines = [f'The first frame is of {when}.']
    if run is None:
        return paragraphs(lines)
    try:
        settings = Record(run.settings)
        lines.append(
            f'Made by depth_person process {settings.text("version")}, '
            f'network {settings.child("pose_node").text("model")}, '
            f'estimator {settings.child("depth_node").text("estimator")}.')
    except DepthPersonError:
        lines.append('Made by depth_person process, which has left no record that can be read.')
    if not run.finished:
        lines.append('It was stopped before the end of its input.')
    return paragraphs(lines) + faults_box('What process could not use', run.faults)


def _overview(results: Results, times: Timing, pictures: SampleFrames) -> str:
    people = results.people
    lines = [
        f'{len(results.stamps_ns)} frames in {times.time_s[-1]:.1f} s, '
        f'{len(results.tracks)} people in {len(people)} sightings, '
        f'{np.isfinite(people.range).sum()} of them with a range.']
    if pictures.images:
        lines.append(f'{pictures.unmeasured} of {pictures.images} images have no result.')
    times_seen = Counter(people.track_id.tolist())
    listed = {track for track, _ in times_seen.most_common(MOST_LISTED)}
    if len(listed) < len(times_seen):
        lines.append(
            f'Listed are the {len(listed)} who were there the longest; '
            f'{len(times_seen) - len(listed)} more were there in at most '
            f'{min(times_seen[track] for track in listed)} frames.')
    rows = [(f'#{track}', *_person(results, track))
            for track in results.tracks if track in listed]
    return (
        '<h2 id="people">People</h2>' + paragraphs(lines)
        + table(('person', 'first seen s', 'last seen s', 'frames', 'of them predicted',
                 'nearest m', 'furthest m', 'median sigma'), rows))


def _topics(contents: Iterable[tuple[str, str, int]]) -> str:
    return '<h2 id="topics">Topics of the bag</h2>' + table(('topic', 'type', 'messages'), [
        (name, kind, str(count) if count else 'not known') for name, kind, count in contents],
        kind='texts')


def _person(results: Results, track: int) -> tuple[str, ...]:
    own = results.people.track_id == track
    people, time = results.people.take(own), results.times_s[own]
    known = np.isfinite(people.range)
    if known.any():
        sigma = np.median(people.range_sigma[known] / people.range[known])
        ranges = (f'{people.range[known].min():.2f}', f'{people.range[known].max():.2f}',
                  f'{sigma:.1%}')
    else:
        ranges = ('-', '-', '-')
    return (f'{time[0]:.2f}', f'{time[-1]:.2f}', str(len(people)), str(people.predicted.sum()),
            *ranges)


def _errors(errors: TruthErrors | None) -> str:
    if errors is None:
        return ''
    rows = [
        (name, *('-' if figures[key] is None else form.format(figures[key])
                 for key, form in _ERRORS.values()))
        for name, figures in errors.tables()]
    points = len(errors.results.people)
    return (
        '<h2 id="errors">Errors</h2>' + table(('people', *_ERRORS), rows)
        + f'<p>Ranges that belong to nobody known: {errors.strangers}. A true normal sigma has '
        '68 % of the errors within one and 95 % within two.</p>'
        + picture('Error over time', as_uri(errors_figure(errors), points=points),
                   'Error over time; bands of two of its own sigmas.'))


def _timing(times: Timing) -> str:
    rows = []
    if len(times.interval_s):
        rate = 1 / np.median(times.interval_s)
        rows.append(('rate, by the median interval between stamps', f'{rate:.2f} Hz'))
        rows.append(('longest interval', f'{1e3 * times.interval_s.max():.0f} ms'))
        rows.append((f'gaps: intervals above {GAP:g} medians', str(times.gaps)))
    if times.latency_s is not None:
        for name, share in (('median', 50), ('95 %', 95), ('99 %', 99), ('largest', 100)):
            value = 1e3 * np.percentile(times.latency_s, share)
            rows.append((f'latency from stamp to recording, {name}', f'{value:.0f} ms'))
    return (
        '<h2 id="timing">Latency and rate</h2>' + table(('', ''), rows)
        + (f'<p>{escape(times.remark)}</p>' if times.remark else '')
        + picture('Latency and rate', as_uri(timing_figure(times), points=len(times.time_s)), ''))


def _frames(results: Results, pictures: SampleFrames) -> str:
    start = int(results.stamps_ns[0])
    shown = ''.join(
        picture('Sample frame', uri, f'{(stamp - start) * 1e-9:.2f} s', kind='sample')
        for stamp, uri in sorted(pictures.pictures.items()))
    return ('<h2 id="frames">Sample frames</h2>' + (
        f'<div class="frames">{shown}</div>' if shown
        else f'<p>None: {escape(pictures.remark or "no image has the stamp of a result")}.</p>'))
