"""One self-contained page about a bag of results."""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template

import numpy as np

from depth_person.camera.bag import BagReader
from depth_person.replay.drawing import as_uri
from depth_person.replay.report_frames import sample_frames, SampleFrames
from depth_person.replay.report_plots import (
    above_figure,
    errors_figure,
    ranges_figure,
    timing_figure,
)
from depth_person.replay.results import choose_topic, read_results, Results
from depth_person.replay.timing import Timing, timing
from depth_person.replay.truth import read_truth
from depth_person.replay.truth_errors import truth_errors, TruthErrors

#: Nothing may be loaded from anywhere, and no script may run.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="$policy">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.45 sans-serif; margin: 1.5em auto; max-width: 76em; padding: 0 1em;
       color: #222; background: #fff; }
h1 { font-size: 1.5em; } h2 { font-size: 1.2em; margin-top: 2em; }
table { border-collapse: collapse; margin: 0.6em 0; }
th, td { padding: 0.15em 0.8em; text-align: right; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; }
img { max-width: 100%; height: auto; }
.frames { display: grid; grid-template-columns: repeat(auto-fill, minmax(34em, 1fr)); gap: 1em; }
figure { margin: 0; } figcaption { color: #666; }
.faults { background: #fdecea; padding: 0.6em 1em; }
</style>
</head>
<body>
<h1>$title</h1>
$body
</body>
</html>
""")
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
    times = timing(results)
    points = len(results.people)
    body = [
        _faults(faults), _overview(results, times, pictures, contents),
        _figure('Range over time', as_uri(ranges_figure(results, known), points=points),
                'Lines: range, with a band of one sigma. Dots: what each frame says by itself, '
                'where that was recorded. Rings: predicted, not seen.'),
        _figure("Bird's-eye view", as_uri(above_figure(results, known), points=points),
                'Places relative to the camera; lines of one sigma along the view ray.'),
        _errors(errors), _timing(times), _frames(results, pictures)]
    return Report(
        _PAGE.substitute(policy=_POLICY, title=escape(f'People in {path.name}'),
                         body='\n'.join(filter(None, body))), faults)


def _faults(faults: Sequence[str]) -> str:
    if not faults:
        return ''
    items = ''.join(f'<li>{escape(fault)}</li>' for fault in faults)
    return f'<div class="faults" id="faults"><b>What could not be used</b><ul>{items}</ul></div>'


def _overview(
    results: Results, times: Timing, pictures: SampleFrames,
    contents: Iterable[tuple[str, str, int]],
) -> str:
    people = results.people
    lines = [
        f'{len(results.stamps_ns)} frames in {times.time_s[-1]:.1f} s, '
        f'{len(results.tracks)} people in {len(people)} sightings, '
        f'{np.isfinite(people.range).sum()} of them with a range.']
    if pictures.images:
        lines.append(f'{pictures.unmeasured} of {pictures.images} images have no result.')
    rows = [(f'#{track}', *_person(results, track)) for track in results.tracks]
    return (
        '<h2 id="people">People</h2>' + ''.join(f'<p>{escape(line)}</p>' for line in lines)
        + _table(('person', 'first s', 'last s', 'frames', 'predicted', 'nearest m',
                  'furthest m', 'median sigma'), rows)
        + '<h2 id="topics">Topics of the bag</h2>'
        + _table(('topic', 'type', 'messages'), [
            (name, kind, str(count) if count else 'not known') for name, kind, count in contents]))


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
        '<h2 id="errors">Errors</h2>' + _table(('people', *_ERRORS), rows)
        + f'<p>Ranges that belong to nobody known: {errors.strangers}. A true normal sigma has '
        '68 % of the errors within one and 95 % within two.</p>'
        + _picture('Error over time', as_uri(errors_figure(errors), points=points),
                   'Error over time; bands of two of its own sigmas.'))


def _timing(times: Timing) -> str:
    rows = []
    if len(times.interval_s):
        rate = 1 / np.median(times.interval_s)
        rows.append(('rate, by the median distance of stamps', f'{rate:.2f} Hz'))
        rows.append(('longest distance', f'{1e3 * times.interval_s.max():.0f} ms'))
        rows.append(('distances above one and a half medians', str(times.gaps)))
    if times.latency_s is not None:
        for name, share in (('median', 50), ('95 %', 95), ('99 %', 99), ('largest', 100)):
            value = 1e3 * np.percentile(times.latency_s, share)
            rows.append((f'latency from stamp to recording, {name}', f'{value:.0f} ms'))
    return (
        '<h2 id="timing">Latency and rate</h2>' + _table(('', ''), rows)
        + (f'<p>{escape(times.remark)}</p>' if times.remark else '')
        + _picture('Latency and rate', as_uri(timing_figure(times), points=len(times.time_s)), ''))


def _frames(results: Results, pictures: SampleFrames) -> str:
    start = int(results.stamps_ns[0])
    shown = ''.join(
        _picture('Sample frame', uri, f'{(stamp - start) * 1e-9:.2f} s')
        for stamp, uri in sorted(pictures.pictures.items()))
    return ('<h2 id="frames">Sample frames</h2>' + (
        f'<div class="frames">{shown}</div>' if shown
        else f'<p>None: {escape(pictures.remark or "no image has the stamp of a result")}.</p>'))


def _figure(title: str, uri: str, caption: str) -> str:
    name = escape(title.lower().replace(' ', '-').replace("'", ''))
    return f'<h2 id="{name}">{escape(title)}</h2>' + _picture(title, uri, caption)


def _picture(title: str, uri: str, caption: str) -> str:
    return (f'<figure><img alt="{escape(title)}" src="{uri}">'
            f'<figcaption>{escape(caption)}</figcaption></figure>')


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return '<tr>' + ''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells) + '</tr>'

    head = line(headings, 'th') if any(headings) else ''
    return f'<table>{head}{"".join(line(row, "td") for row in rows)}</table>'
