"""The regression bags, what is done with each, and what must come of it."""
from __future__ import annotations

from dataclasses import dataclass, field, replace
import math
from pathlib import Path
from typing import Any

import numpy as np

from depth_person.camera.bag import BagReader
from depth_person.camera.bag_source import BagSource
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.message_fields import calibration, stamp_ns
from depth_person.distance.attitude import level_gravity
from depth_person.distance.estimator import Mounting
from depth_person.distance.stage import DistanceStage
from depth_person.distance.tracked import TrackedPeople
from depth_person.pose.people import People
from depth_person.pose.pipeline import PoseEstimator, PoseOptions
from depth_person.replay.clouds import cloud_points
from depth_person.replay.compare import Tolerances
from depth_person.replay.results import gather, PersonRows, Results
from depth_person.settings.depth import DepthSettings

HERE = Path(__file__).parent
BAGS = HERE / 'bags'
GOLDEN = HERE / 'golden'
KEYPOINTS = '/person_keypoints'
#: How the drone's camera is mounted: metres above the ground, and degrees down.
DRONE_HEIGHT, DRONE_PITCH_DEG = 8.0, 35.0

#: Of what a network finds in images: versions of its runtime differ a little, and now and then
#: one finds a person in a frame whom another does not.
IMAGES = Tolerances(range=0.03, position=0.05, sigma=0.3, allow=0.15)
#: While one passes before the other, whose a keypoint is hangs on less than versions of OpenCV
#: differ by. Their ids must stay all the same.
OVERLAPPING = replace(IMAGES, allow=0.3)
#: Of what is computed from recorded keypoints.
NUMBERS = Tolerances(range=0.01, position=0.01, sigma=0.1)


@dataclass(frozen=True)
class Case:
    """
    A bag, and the parameters of depth_node that it is measured with.

    :ivar tolerances: of its golden values.
    """

    bag: str
    parameters: dict[str, Any] = field(default_factory=dict)
    tolerances: Tolerances = IMAGES

    @property
    def path(self) -> Path:
        """Where the bag is."""
        return BAGS / self.bag

    @property
    def settings(self) -> DepthSettings:
        """The settings of depth_node."""
        return DepthSettings(**self.parameters)

    @property
    def mounting(self) -> Mounting:
        """What the settings say of the camera's attitude and height."""
        settings = self.settings
        if settings.attitude != 'fixed':
            return Mounting()
        return Mounting(
            gravity=level_gravity(
                pitch_down=math.radians(settings.camera_pitch),
                roll_cw=math.radians(settings.camera_roll)),
            gravity_sigma=math.radians(settings.attitude_sigma),
            height=settings.camera_height or None, height_sigma=settings.camera_height_sigma)


CASES = {
    'walker': Case('walker'),
    'walker_shoulders': Case('walker', {'estimator': 'shoulder', 'shoulder_width': 0.33}),
    'crossing': Case('crossing', tolerances=OVERLAPPING),
    'half_hidden': Case('half_hidden'),
    'turned': Case('turned'),
    'measured_neck': Case('measured_neck', {
        'estimator': 'shoulder', 'convention': 'mesh'}, NUMBERS),
    'far': Case('far'),
    'drone': Case('drone', {
        'convention': 'mesh', 'attitude': 'fixed', 'camera_pitch': DRONE_PITCH_DEG,
        'camera_height': DRONE_HEIGHT}, NUMBERS),
    'nobody': Case('nobody'),
    'distorted': Case('distorted'),
}


@dataclass(frozen=True, eq=False)
class Sighting:
    """Who was seen in one frame."""

    stamp_ns: int
    intrinsics: Intrinsics | None
    people: People


def sightings(case: Case) -> list[Sighting]:
    """Return the people of each frame: recorded, or as the network finds them in the images."""
    with BagReader(case.path) as bag:
        if KEYPOINTS in bag.topics:
            return _recorded(bag, case.settings.convention)
    pose = PoseEstimator(PoseOptions())
    with BagSource(case.path, frame_id='camera') as source:
        return [Sighting(frame.stamp_ns, frame.intrinsics, pose.estimate(frame))
                for frame in iter(source.read, None)]


def _recorded(bag: BagReader, convention: str) -> list[Sighting]:
    found: list[Sighting] = []
    intrinsics = None
    for topic, _, message in bag.messages(['/camera_info', KEYPOINTS]):
        if topic != KEYPOINTS:
            intrinsics = calibration(message)
            continue
        points = cloud_points(message)
        keypoints = np.stack([points[name] for name in ('u', 'v', 'score')], axis=-1)
        people = People(
            keypoints, np.ascontiguousarray(points['track_id'][:, 0]), neck_measured=True,
            convention=convention)
        found.append(Sighting(stamp_ns(message.header), intrinsics, people))
    return found


def measure(case: Case, seen: list[Sighting]) -> Results:
    """Return what the distance stage makes of the sightings."""
    stage = DistanceStage(case.settings.distance_options())
    return gather(case.bag, {
        each.stamp_ns: (each.stamp_ns, _rows(stage.measure(
            each.people, each.intrinsics, case.mounting, stamp_ns=each.stamp_ns)))
        for each in seen})


def _rows(tracked: TrackedPeople) -> PersonRows:
    distances, measured = tracked.distances, tracked.measured
    return PersonRows(
        frame=np.zeros(len(tracked), np.intp),
        track_id=tracked.people.track_ids.astype(np.int64), position=distances.position,
        range=distances.range, range_sigma=distances.range_sigma, range_measured=measured.range,
        range_sigma_measured=measured.range_sigma, predicted=tracked.predicted)
