"""
The tables of msg_docs/accuracy.md, from what `depth_person evaluate` measured.

    depth_person evaluate DATA/synthetic/dev --keypoints truth --noise 1 --json OUT
    python test/benchmarks/accuracy_tables.py OUT

Groups are made by what a data set says of its people: rendered ones by scenario, distance and
yaw, others by distance or scenario.
"""
from __future__ import annotations

import argparse
from collections.abc import Iterable
from itertools import pairwise
import json
from pathlib import Path
from typing import Any

import numpy as np

Sample = dict[str, Any]

#: Scenarios of rendered people of whom nothing is hidden.
OPEN = ('distance', 'yaw', 'multi', 'tilt', 'distort', 'pose')
COLUMNS = ('n', 'with a range', 'median relative', 'mean error m', 'bias', '1 sigma', '2 sigma')
#: Edges of the groups by distance of recorded walkers, metres.
EDGES = (0, 8, 12, 18, 30, 70)


def rendered(samples: list[Sample]) -> dict[str, list[Sample]]:
    """Return the groups of rendered adults at 2.5 to 21 m."""
    adults = [s for s in samples if s['kind'] != 'child' and 2.5 <= s['range_true'] <= 21]
    stills = [s for s in adults if s['scenario'] != 'walk']
    seen_whole = [s for s in adults if s['scenario'] in OPEN]

    def of(scenario: str) -> list[Sample]:
        return [s for s in adults if s['scenario'] == scenario]

    return {
        'standing, facing (30 degrees)': [
            s for s in seen_whole if abs(s['yaw_deg']) <= 30 and s['scenario'] != 'pose'],
        'all yaws and poses': seen_whole, 'tilted camera or slope': of('tilt'),
        "drone's view": of('drone'), 'upper body only': of('occl_lower'),
        'one side hidden': of('occl_side'), 'head only': of('head_only'),
        'nearer than 8 m': [s for s in stills if s['range_true'] < 8],
        '8 m and farther': [s for s in stills if s['range_true'] >= 8],
        'front (45 degrees)': [s for s in stills if abs(s['yaw_deg']) <= 45],
        'side': [s for s in stills if 45 < abs(s['yaw_deg']) < 135],
        'back': [s for s in stills if abs(s['yaw_deg']) >= 135],
        'walking sequence': of('walk'),
    }


def groups(samples: list[Sample]) -> dict[str, list[Sample]]:
    """Return the groups that the data set allows."""
    scenarios = sorted({s['scenario'] for s in samples})
    if set(OPEN) & set(scenarios):
        return rendered(samples)
    if scenarios == ['recorded']:
        return {'all': samples, **{
            f'{low} to {high} m': [s for s in samples if low <= s['range_true'] < high]
            for low, high in pairwise(EDGES)}}
    return {'all': samples, **{
        name: [s for s in samples if s['scenario'] == name] for name in scenarios}}


def cells(samples: list[Sample]) -> Iterable[str]:
    """Yield the cells of one row."""
    measured = [s for s in samples if s['range'] is not None]
    yield str(len(samples))
    yield str(len(measured))
    if not measured:
        yield from '-' * 5
        return
    error, truth, sigma = np.array([
        (s['range'] - s['range_neck'], s['range_neck'], s['range_sigma']) for s in measured]).T
    yield f'{np.median(np.abs(error) / truth):.1%}'.replace('%', ' %')
    yield f'{np.abs(error).mean():.2f}'
    yield f'{np.mean(error / truth):+.1%}'.replace('%', ' %')
    for sigmas in (1, 2):
        yield f'{np.mean(np.abs(error) < sigmas * sigma):.0%}'.replace('%', ' %')


def table(path: Path) -> str:
    """Return the table of one result of evaluate, in Markdown."""
    samples = [s for s in json.loads(path.read_text())['samples'] if s['person'] is not None]
    rows = [['', *COLUMNS], ['---'] * (len(COLUMNS) + 1)]
    rows += [[name, *cells(group)] for name, group in groups(samples).items()]
    return ''.join('| ' + ' | '.join(row) + ' |\n' for row in rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('json', type=Path, nargs='+', help='what evaluate --json wrote')
    for path in parser.parse_args().json:
        print(f'### {path.stem}\n\n{table(path)}')


if __name__ == '__main__':
    main()
