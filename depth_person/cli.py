"""The depth_person command: one verb a task."""
from __future__ import annotations

import argparse
from collections.abc import Sequence
from importlib import import_module
import os
import sys

from depth_person import __version__
from depth_person.errors import DepthPersonError
from depth_person.interrupts import deferred_interrupts

#: Verb -> what the list of verbs says of it. Each is a module of depth_person.verbs that has
#: add_arguments(parser) and main(args) -> exit code.
VERBS = {
    'run': 'run camera, pose and depth in one process',
    'models': 'install and list pose networks',
    'process': 'run the pipeline over bags and write bags with the results',
    'play': 'publish the topics of a bag in their time',
    'record': 'record the topics that a report of a fault needs',
    'evaluate': 'measure errors on a folder of frames with known distances',
    'compare': 'say what moved between two bags of results',
    'report': 'write a page about a bag of results',
    'calibrate': 'find the intrinsics of a camera, or the size of a person',
    'train': 'repeat the training of the networks that the package ships',
    'validate': 'compare predicted distances in a table with the actual ones',
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    argv = sys.argv[1:] if argv is None else list(argv)
    chosen = next((word for word in argv if not word.startswith('-')), None)
    try:
        return _run(argv, chosen)
    except DepthPersonError as error:
        print(f'depth_person {chosen}: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader, such as head, has left
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _run(argv: Sequence[str], chosen: str | None) -> int:
    parser = argparse.ArgumentParser(prog='depth_person', description=__doc__)
    parser.add_argument('--version', action='version', version=__version__)
    verbs = parser.add_subparsers(dest='verb', required=True, metavar='VERB')
    for verb, summary in VERBS.items():
        verb_parser = verbs.add_parser(verb, help=summary, description=summary)
        if verb == chosen:  # the others stay unimported: each brings its own heavy libraries
            with deferred_interrupts():
                module = import_module(f'depth_person.verbs.{verb}')
            module.add_arguments(verb_parser)
    args = parser.parse_args(argv)
    return module.main(args)
