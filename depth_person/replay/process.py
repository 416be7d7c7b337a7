"""Runs the pipeline over the images of bags, and writes what it finds beside the other topics."""
from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Qos

from depth_person.camera.bag_topics import COMPRESSED_IMAGE, IMAGE
from depth_person.camera.frame import Frame
from depth_person.distance.tracked import TrackedPeople
from depth_person.errors import DepthPersonError
from depth_person.mounting.camera_state import CameraState
from depth_person.pipeline import Pipeline
from depth_person.pose.people import People
from depth_person.replay.ahead import ahead, short_turns
from depth_person.replay.bags import BagWriter
from depth_person.replay.input_bags import InputBags
from depth_person.replay.steps import Step, StepReader
from depth_person.replay.surroundings import Surroundings

#: Frames that wait between two stages.
_DEPTH = 4

#: A step and the people in its frame; None where there is none, or it cannot be looked at.
Found = tuple[Step, People | None]


@dataclass(frozen=True)
class ResultTopic:
    """A topic of results: its type, and the profiles that its publishers offer."""

    msgtype: str
    qos: tuple[Qos, ...] = ()


class Codec(Protocol):
    """
    Turns results into serialised messages.

    :ivar topics: of the results, by name.
    """

    topics: dict[str, ResultTopic]

    def encode(
        self, frame: Frame, people: People, tracked: TrackedPeople, camera: CameraState,
    ) -> Iterable[tuple[str, bytes]]:
        """Yield topic and message of everything that a frame gives."""
        ...


class Recollection(Protocol):
    """Knows the people that were found before, frame by frame."""

    def people(self, frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """Return (n, 18, 3) keypoints and (n,) track ids of the next frame; None if not known."""
        ...


@dataclass(frozen=True)
class Job:
    """
    What is to be done with bags.

    :ivar image_topic: whose images are looked at.
    :ivar info_topic: of their CameraInfo; None takes them as uncalibrated.
    :ivar copy_images: whether the images are copied, too.
    """

    image_topic: str
    info_topic: str | None
    copy_images: bool = True


@dataclass
class Outcome:
    """
    What has been done.

    :ivar faults: what could not be read or used, a line each.
    :ivar notes: what the user should know besides.
    :ivar finished: whether the end of the bags was reached.
    """

    frames: int = 0
    people: int = 0
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    finished: bool = True


class Processor:
    """
    One run over some bags; reading, finding people, and the rest work at the same time.

    :param recollection: gives people in place of the network as long as it knows them.
    """

    def __init__(
        self, bags: InputBags, job: Job, *, pipeline: Pipeline, codec: Codec,
        surroundings: Surroundings, recollection: Recollection,
    ) -> None:
        self._bags = bags
        self._job = job
        self._pipeline = pipeline
        self._codec = codec
        self._surroundings = surroundings
        self._recollection = recollection
        self._reader = StepReader(
            bags, image_topic=job.image_topic, info_topic=job.info_topic)
        self._outcome = Outcome()
        self._unseen: Counter[str] = Counter()

    def run(
        self, writer: BagWriter, *, on_frame: Callable[[], None] = lambda: None,
        stopping: Callable[[], bool] = lambda: False,
    ) -> Outcome:
        """
        Write the results of every frame; return what came of it.

        :param on_frame: called after each frame.
        :param stopping: asked after each frame whether to leave the rest.
        """
        with short_turns(), closing(ahead(self._reader.steps(), depth=_DEPTH)) as steps, \
                closing(ahead(self._find(steps), depth=_DEPTH)) as found:
            return self.write(writer, found, on_frame=on_frame, stopping=stopping)

    def write(
        self, writer: BagWriter, found: Iterable[Found], *,
        on_frame: Callable[[], None] = lambda: None,
        stopping: Callable[[], bool] = lambda: False,
    ) -> Outcome:
        """Measure the people found in each step, and write the results; return what came of it."""
        copied = self._add_topics(writer)
        waiting: Found | None = None
        for step, people in found:
            for message in step.others:  # what comes after an image tells of it, too
                self._surroundings.take(message)
            if waiting is not None:
                self._write_step(writer, copied, *waiting)
                on_frame()
            waiting = step, people
            if stopping():
                self._outcome.finished = False
                break
        if waiting is not None:
            self._write_step(writer, copied, *waiting)
        self._report()
        return self._outcome

    def _add_topics(self, writer: BagWriter) -> frozenset[str]:
        """Add all topics to the written bag; return the names of those that are copied."""
        copied = set()
        for name, topic in self._bags.topics.items():
            if name in self._codec.topics:
                self._outcome.notes.append(f'{name} of {self._bags.description} is replaced')
                continue
            if not self._job.copy_images and topic.msgtype in (IMAGE, COMPRESSED_IMAGE):
                continue
            try:
                definition, digest = self._bags.definition(name)
            except DepthPersonError as error:
                self._outcome.faults.append(f'{error}; it is left out')
                continue
            writer.add_defined_topic(
                name, topic.msgtype, definition=definition, digest=digest, qos=topic.qos)
            copied.add(name)
        for name, result in self._codec.topics.items():
            writer.add_topic(name, result.msgtype, qos=result.qos)
        return frozenset(copied)

    def _find(self, steps: Iterable[Step]) -> Generator[Found, None, None]:
        """Yield the steps with the people of their frames."""
        for step in steps:
            people = None
            if step.frame is not None:
                known = self._recollection.people(step.frame)
                people = (self._see(step.frame) if known is None
                          else self._pipeline.recall(step.frame, *known))
            yield step, people

    def _see(self, frame: Frame) -> People | None:
        try:
            return self._pipeline.find(frame)
        except DepthPersonError as error:
            self._unseen[str(error)] += 1
            return None

    def _write_step(
        self, writer: BagWriter, copied: frozenset[str], step: Step, people: People | None,
    ) -> None:
        records = [
            (message.topic, message.time_ns, message.data)
            for message in (*step.others, step.image)
            if message is not None and message.topic in copied]
        if step.image is not None and step.frame is not None and people is not None:
            records += [
                (topic, step.image.time_ns, data)
                for topic, data in self._results(step.frame, people)]
            self._outcome.frames += 1
        writer.write_all_raw(records)

    def _results(self, frame: Frame, people: People) -> Iterable[tuple[str, bytes]]:
        camera = self._surroundings.at(frame.stamp_ns, frame.frame_id)
        tracked = self._pipeline.measure(
            frame, people, camera.mounting, camera_pose=camera.pose)
        self._outcome.people += len(people)
        return self._codec.encode(frame, people, tracked, camera)

    def _report(self) -> None:
        """Put everything that was amiss into the outcome."""
        oddities, outcome = self._reader.oddities, self._outcome
        outcome.notes += self._surroundings.report.remarks
        outcome.faults += [*self._bags.faults, *self._surroundings.report.faults]
        outcome.faults += [
            f'{count} messages on {topic} cannot be decoded'
            for topic, count in self._bags.undecodable.items()]
        outcome.faults += _counted({
            f'images cannot be decoded, such as one because {oddities.first_undecodable}':
                oddities.undecodable,
            **{f'frames could not be looked at: {error}': count
               for error, count in self._unseen.items()},
            'CameraInfo messages cannot be used, or are of another resolution than the images':
                self._reader.bad_camera_infos,
            'frames are uncalibrated, so their people have no distance': oddities.uncalibrated,
            'frames have a stamp of zero; the time of recording stands for it':
                oddities.unstamped,
            'frames have a stamp before that of the frame before; nobody is followed across it':
                oddities.disordered,
            'frames have the stamp of an earlier frame; report leaves their people out':
                oddities.repeated,
        })


def _counted(counts: dict[str, int]) -> Iterator[str]:
    for sentence, count in counts.items():
        if count:
            yield f'{count} {sentence}'
