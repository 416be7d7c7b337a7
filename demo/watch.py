"""
Print who is how far away, live, and a summary on Ctrl-C.

It needs ROS 2 and NumPy only: what it knows of depth_person are the topics person_depth/people
and /diagnostics. Where the true positions are published on /person_truth, as the demo does, it
shows the errors, too.

    python demo/watch.py [--csv FILE]
"""
import argparse
from collections import Counter
import csv
from dataclasses import asdict, dataclass, fields
import math
from pathlib import Path
import signal
import sys
import threading

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import PointCloud2, PointField

FORMATS = {
    PointField.FLOAT32: '<f4', PointField.INT32: '<i4', PointField.UINT8: 'u1'}
#: A person whose direction is further than this from every true one, degrees, is nobody known.
SAME_DIRECTION_DEG = 4.0
PERIOD_S = 0.5
LINES = 8


@dataclass(frozen=True)
class Sample:
    """One person in one image; the truth is NaN where it is not known."""

    stamp_s: float
    track_id: int
    x: float
    y: float
    z: float
    range: float
    range_sigma: float
    truth_id: int = -1
    truth_x: float = math.nan
    truth_z: float = math.nan
    truth_range: float = math.nan

    @property
    def error(self):
        """Metres too far."""
        return self.range - self.truth_range


def points(cloud):
    """Return the points of a cloud as a structured array."""
    layout = np.dtype({
        'names': [field.name for field in cloud.fields],
        'formats': [FORMATS[field.datatype] for field in cloud.fields],
        'offsets': [field.offset for field in cloud.fields],
        'itemsize': cloud.point_step})
    return np.frombuffer(cloud.data, layout)


def positions(people):
    """Return where people are, (n, 3)."""
    return np.stack([people['x'], people['y'], people['z']], axis=-1).astype(float)


def distances(people, truth):
    """Return the metres (n, m) between people and true ones; infinite in other directions."""
    first, second = positions(people), positions(truth)
    cosines = first @ second.T / np.outer(
        np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1))
    apart = np.linalg.norm(first[:, None] - second[None], axis=2)
    return np.where(cosines < math.cos(math.radians(SAME_DIRECTION_DEG)), np.inf, apart)


def matches(people, truth):
    """Yield (person, true person or None), each true one once, the best matches first."""
    if len(truth) and len(people):
        apart = distances(people, truth)
        free_people, free_truth = set(range(len(people))), set(range(len(truth)))
        for flat in np.argsort(apart, axis=None):
            person, true = divmod(int(flat), len(truth))
            if apart[person, true] == np.inf:
                break
            if person in free_people and true in free_truth:
                free_people.remove(person)
                free_truth.remove(true)
                yield people[person], truth[true]
        people = people[sorted(free_people)]
    for person in people:
        yield person, None


class Watcher:
    """Collects samples, and shows the newest."""

    def __init__(self, node):
        self._truth = {}
        self._newest = []
        self._drawn_lines = 0
        self._shown_s = -math.inf
        self.samples = []
        self.counts = Counter()
        self.statuses = {}
        # The demo sends all of the truth ahead, which is why it is kept for late comers.
        kept = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(PointCloud2, '/person_truth', self._on_truth, kept)
        node.create_subscription(PointCloud2, 'person_depth/people', self._on_people, 10)
        node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def _on_truth(self, cloud):
        self._truth[stamp_s(cloud)] = points(cloud)
        self.counts['images with truth'] = len(self._truth)

    def _on_people(self, cloud):
        stamp = stamp_s(cloud)
        people = points(cloud)
        known = people[people['reason'] == 0]
        self.counts['images'] += 1
        self.counts['people'] += len(people)
        self.counts['people without range'] += len(people) - len(known)
        self._newest = [
            sample(stamp, person, true)
            for person, true in matches(known, self._truth.get(stamp, known[:0]))]
        self.samples += self._newest
        if not 0 <= stamp - self._shown_s < PERIOD_S:  # due, or a clock that jumped back
            self._shown_s = stamp
            self._show()

    def _on_diagnostics(self, array):
        for status in array.status:
            self.statuses[status.name] = status

    def _show(self):
        """Print the table anew, over the last one where the terminal can."""
        rows = [row(each) for each in sorted(self._newest, key=lambda each: each.track_id)]
        if sys.stdout.isatty():
            rows = (rows + [''] * LINES)[:LINES]
            up = f'\x1b[{self._drawn_lines}A' if self._drawn_lines else ''
            lines = ''.join(f'\x1b[2K{line}\n' for line in [HEADING, *rows])
            print(up + lines, end='', flush=True)
            self._drawn_lines = len(rows) + 1
        else:
            lines = [HEADING] if not self._drawn_lines else []
            print('\n'.join([*lines, *rows, '']), flush=True)
            self._drawn_lines = 1


HEADING = '  stamp  track   range   sigma   truth   error'


def row(each):
    """Return the table's row of a sample."""
    truth = error = '-'
    if each.truth_id >= 0:
        truth, error = f'{each.truth_range:.2f} m', f'{each.error:+.2f} m'
    return (f'{each.stamp_s % 1000:7.2f}  {"#" + str(each.track_id):>5}  {each.range:6.2f} m'
            f'{each.range_sigma:6.2f} m {truth:>8}{error:>8}')


def sample(stamp, person, true):
    """Return the sample of a person and who they truly are, if that is known."""
    measured = {name: float(person[name]) for name in ('x', 'y', 'z', 'range', 'range_sigma')}
    known = {} if true is None else {
        'truth_id': int(true['track_id']), 'truth_x': float(true['x']),
        'truth_z': float(true['z']), 'truth_range': float(true['range'])}
    return Sample(stamp_s=stamp, track_id=int(person['track_id']), **measured, **known)


def stamp_s(message):
    """Return the stamp of a message in seconds."""
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def summary(samples, counts):
    """Yield the lines of the summary."""
    sent = counts['images with truth']
    yield (f'{counts["images"]} {f"of {sent} " if sent else ""}images, {counts["people"]} people '
           f'in them, {counts["people without range"]} of these without a range')
    if any(each.truth_id >= 0 for each in samples):
        yield 'person  images  tracks  median error  relative  in 1 sigma  in 2 sigma'
    for person in sorted({each.truth_id for each in samples} - {-1}):
        own = [each for each in samples if each.truth_id == person]
        errors = np.array([each.error for each in own])
        truth = np.array([each.truth_range for each in own])
        sigmas = np.abs(errors) / [each.range_sigma for each in own]
        yield (f'{person:6}  {len(own):6}  {len({each.track_id for each in own}):6}  '
               f'{np.median(abs(errors)):10.2f} m  {np.median(abs(errors) / truth):8.1%}  '
               f'{(sigmas <= 1).mean():10.0%}  {(sigmas <= 2).mean():10.0%}')


def state(status):
    """Return a line on what a node said last of itself."""
    wanted = ('rate', 'latency median', 'latency p99', 'inference median', 'dropped frames')
    figures = {value.key: value.value for value in status.values}
    shown = ', '.join(f'{key} {figures[key]}' for key in wanted if key in figures)
    return f'{status.name}: {status.message}; {shown}'


def write_csv(path, samples):
    """Write the samples, a line each."""
    with path.open('w', newline='') as stream:
        writer = csv.DictWriter(stream, [field.name for field in fields(Sample)])
        writer.writeheader()
        writer.writerows(asdict(each) for each in samples)


def main():
    """Watch until Ctrl-C or SIGTERM; return the exit code, 1 when nothing came."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--csv', type=Path, help='write every sample to this file')
    args, ros_args = parser.parse_known_args()
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    rclpy.init(args=ros_args, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('watch')
    watcher = Watcher(node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(timeout_sec=0.2)  # signals are seen in between
    node.destroy_node()
    rclpy.try_shutdown()
    print()
    for line in summary(watcher.samples, watcher.counts):
        print(line)
    for _, status in sorted(watcher.statuses.items()):
        print(state(status))
    if args.csv:
        write_csv(args.csv, watcher.samples)
    return 0 if watcher.counts['images'] else 1


if __name__ == '__main__':
    sys.exit(main())
