"""
Play a bundled scene of walking people through camera_node, pose_node and depth_node.

Each node is a process of its own, and so is the subscriber that prints the live table; they
talk over DDS on this machine only. The overlay as a video and a report land in out/demo.

    python demo/demo.py [--out FOLDER]
"""
import argparse
from importlib import import_module
from pathlib import Path
import sys

from processes import DemoError, hear_one_interrupt

from depth_person.interrupts import deferred_interrupts


def main():
    """Run the demo; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--out', type=Path, default=Path('out/demo'))
    out = parser.parse_args().out
    hear_one_interrupt()
    try:
        print('loading ROS', flush=True)
        with deferred_interrupts():
            scene = import_module('scene')
        out.mkdir(parents=True, exist_ok=True)
        overlays = scene.play(out)
        scene.write_results(overlays, out)
    except DemoError as failure:
        print(f'demo: {failure}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(f'see {out / "overlay.mp4"} and {out / "report.png"}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
