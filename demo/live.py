"""
Measure people in a live source, or in a file, until Ctrl-C or its end.

    python demo/live.py --params FILE --source SOURCE [options of `depth_person run`]

Runs `depth_person run` with what it is given, and the watcher beside it. Unless the environment
says otherwise, no other machine sees the topics.
"""
import os
import sys
import time

from processes import BIN, DemoError, hear_one_interrupt, HERE, Processes


def main():
    """Run until Ctrl-C; return the exit code."""
    hear_one_interrupt()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    try:
        with Processes() as processes:
            processes.start('watch', sys.executable, HERE / 'watch.py')
            processes.start('run', BIN / 'depth_person', 'run', *sys.argv[1:])
            while not processes.check(may_end=('run',)):
                time.sleep(0.2)
    except DemoError as failure:
        print(f'live: {failure}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == '__main__':
    sys.exit(main())
