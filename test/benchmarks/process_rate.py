"""
Compare the rate of `depth_person process` with that of its slowest stage alone.

    python test/benchmarks/process_rate.py demo/walk --repeat 5

Reading with decoding, the network, and measuring with writing are each run over all frames by
themselves, then all of them together, in turns; the rates are those of the median run.
"""
import argparse
from collections.abc import Callable
from pathlib import Path
import statistics
from tempfile import TemporaryDirectory
import time

from depth_person.camera.bag_topics import choose_image_topic, choose_info_topic
from depth_person.nodes.result_codec import ResultCodec
from depth_person.pipeline import Pipeline
from depth_person.replay.bags import BagWriter
from depth_person.replay.input_bags import InputBags
from depth_person.replay.process import Job, Processor
from depth_person.replay.steps import Step, StepReader
from depth_person.replay.surroundings import Surroundings
from depth_person.replay.unfinished import RecordedPeople
from depth_person.settings.depth import DepthSettings
from depth_person.settings.pose import PoseSettings

DEPTH = DepthSettings()


def make_job(bags: InputBags) -> Job:
    """Return what process does with a bag of one camera."""
    image = choose_image_topic(bags.topics, None, where=bags.description, option='(none)')
    info = choose_info_topic(bags.topics, None, image_topic=image, where=bags.description)
    return Job(image, info)


def read(bag: Path) -> list[Step]:
    """Read and decode everything."""
    with InputBags([bag]) as bags:
        job = make_job(bags)
        return list(StepReader(
            bags, image_topic=job.image_topic, info_topic=job.info_topic).steps())


class Alone:
    """The stages one by one, over the frames of a bag that has been read."""

    def __init__(self, bag: Path, pipeline: Pipeline) -> None:
        self._bag = bag
        self._pipeline = pipeline
        self._steps = read(bag)
        self.frames = sum(step.frame is not None for step in self._steps)
        self.find()

    def read(self) -> None:
        """Read and decode."""
        read(self._bag)

    def find(self) -> None:
        """Run the network."""
        self._people = [
            None if step.frame is None else self._pipeline.find(step.frame)
            for step in self._steps]

    def write(self) -> None:
        """Measure, encode and write."""
        with InputBags([self._bag]) as bags, TemporaryDirectory() as folder, \
                BagWriter(Path(folder, 'out')) as writer:
            processor = make_processor(bags, self._pipeline)
            processor.write(writer, zip(self._steps, self._people, strict=True))


def make_processor(bags: InputBags, pipeline: Pipeline) -> Processor:
    """Return a run over a bag that starts from nothing."""
    return Processor(
        bags, make_job(bags), pipeline=pipeline, codec=ResultCodec(DEPTH),
        surroundings=Surroundings(bags, DEPTH), recollection=RecordedPeople(None, ''))


def together(bag: Path, pipeline: Pipeline) -> None:
    """Process the bag as the command does."""
    with InputBags([bag]) as bags, TemporaryDirectory() as folder, \
            BagWriter(Path(folder, 'out')) as writer:
        make_processor(bags, pipeline).run(writer)


def seconds(action: Callable[[], None]) -> float:
    """Return how long an action takes."""
    started = time.perf_counter()
    action()
    return time.perf_counter() - started


def main() -> None:
    """Print frames a second of each stage and of all, and the ratio."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path)
    parser.add_argument('--repeat', type=int, default=5)
    parser.add_argument(
        '--threads', type=int, default=PoseSettings().threads, help='of the networks; 0 for all')
    args = parser.parse_args()
    pipeline = Pipeline(
        PoseSettings(threads=args.threads).pose_options(), DEPTH.distance_options())
    alone = Alone(args.bag, pipeline)
    actions = {
        'reading and decoding': alone.read, 'network': alone.find,
        'measuring and writing': alone.write,
        'all together': lambda: together(args.bag, pipeline)}
    times: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(args.repeat):
        for name, action in actions.items():
            times[name].append(seconds(action))
    frames = alone.frames
    rates = {name: frames / statistics.median(spent) for name, spent in times.items()}
    for name, rate in rates.items():
        print(f'{name:>22} {rate:7.1f} frames/s')
    overlapped = rates.pop('all together')
    print(f'together {overlapped / min(rates.values()):.2f} of the slowest alone')


if __name__ == '__main__':
    main()
