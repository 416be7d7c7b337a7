#!/usr/bin/env python3
"""
Replays the regression bags and shows what moved; then makes that the golden values.

    python test/regression/update.py [--check] [NAME ...]

With --check nothing is written. The tolerances are those of regression_cases.py. Exit code 1
when something moved beyond them, or, with --check, has no golden values.
"""
from __future__ import annotations

import argparse
from pathlib import Path
import sys
import tempfile

from regression_cases import CASES, GOLDEN, measure, sightings

from depth_person.cli import main as depth_person
from depth_person.errors import DepthPersonError
from depth_person.replay.golden import write_golden


def update(name: str, *, check: bool) -> bool:
    """Show what moved in a case, and write its golden values; return whether it is the same."""
    case, golden = CASES[name], GOLDEN / f'{name}.json'
    print(f'== {name}', flush=True)
    results = measure(case, sightings(case))
    code = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'now.json'
        write_golden(path, results, case.tolerances)
        if golden.exists():
            code = depth_person(['compare', str(golden), str(path)])
        else:
            print('has no golden values yet')
            code = int(check)
        if not check:
            golden.parent.mkdir(exist_ok=True)
            golden.write_text(path.read_text(encoding='utf-8'), encoding='utf-8')
    return code == 0


def main() -> int:
    """Update the golden values; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(CASES))
    parser.add_argument('--check', action='store_true', help='write nothing')
    args = parser.parse_args()
    unknown = set(args.names) - CASES.keys()
    if unknown:
        parser.error(f'no case is called {", ".join(sorted(unknown))}')
    try:
        same = [update(name, check=args.check) for name in args.names or CASES]
    except DepthPersonError as error:
        print(f'update: {error}', file=sys.stderr)
        return 1
    return 0 if all(same) else 1


if __name__ == '__main__':
    sys.exit(main())
