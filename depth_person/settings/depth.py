"""The parameters of depth_node."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.autopilot.choice import checked_choice
from depth_person.distance.conventions import CONVENTIONS
from depth_person.distance.estimator import Body
from depth_person.distance.estimators import ESTIMATORS
from depth_person.distance.following import FilterOptions
from depth_person.distance.shoulder import ShoulderEstimator
from depth_person.distance.stage import DistanceOptions
from depth_person.settings.inputs import InputSettings
from depth_person.settings.node import NodeSettings
from depth_person.settings.parameter import parameter
from depth_person.settings.vehicle import ScanSettings


@dataclass(frozen=True)
class DepthSettings(ScanSettings, InputSettings, NodeSettings):
    """
    The parameters of depth_node.

    :raises DepthPersonError: when values do not go together.
    """

    estimator: str = parameter(
        'skeleton', 'How a range is computed.', choices=ESTIMATORS, read_only=False)
    convention: str = parameter(
        'movenet_crops', 'Where the pose network marks keypoints: `movenet_crops` for MoveNet '
        'with a refiner, `openpose` for networks with part-affinity fields, `coco` for one that '
        'nobody has measured.',
        choices=tuple(CONVENTIONS))
    shoulder_width: float = parameter(
        0.35, 'Between the shoulder keypoints, metres; `skeleton` takes it only where '
        'shoulder_width_sigma is given.', minimum=0.1, maximum=1.0, read_only=False)
    shoulder_width_sigma: float = parameter(
        0.0, 'Standard deviation of shoulder_width over it, such as 0.02 for people who were '
        'measured; 0 for the spread of the population.', minimum=0.0, maximum=0.5,
        read_only=False)
    stature: float = parameter(
        0.0, 'Of the people in view, metres; 0 where it is not known.', minimum=0.0, maximum=2.6,
        read_only=False)
    children: bool = parameter(
        False, 'Whether people may be children; otherwise they are taken for adults.',
        read_only=False)
    filter: bool = parameter(
        True, 'Whether people are followed through time; otherwise each image is measured by '
        'itself, nobody is predicted, and there are no velocities.', read_only=False)
    prediction_time: float = parameter(
        1.0, 'How long people are predicted who are hidden, seconds; then they are gone.',
        minimum=0.0, maximum=10.0, read_only=False)
    person_acceleration: float = parameter(
        0.6, 'By how much people change their velocity, m/s^2 by the root of a second: less is '
        'smoother, more follows sooner.', minimum=0.01, maximum=10.0, read_only=False)
    camera_acceleration: float = parameter(
        0.3, 'The same of the camera, where its pose is not known; 0 for one that stands still.',
        minimum=0.0, maximum=20.0, read_only=False)
    max_range: float = parameter(
        100.0, 'Who is further away than this has no range, metres.', minimum=1.0,
        maximum=1000.0, read_only=False)
    target: str = parameter(
        'nearest', 'Who is person_depth/target: `nearest`, `center` (nearest to the middle of the '
        'image), a track id, or empty for nobody.', read_only=False)
    max_age: float = parameter(
        0.4, 'What is older than this when it is about to be published, seconds from the stamp of '
        'its image, is dropped; 0 for no limit. Where the clock cannot be that of the stamps '
        '(more than a minute apart, or behind them), only what goes to autopilots is dropped.',
        minimum=0.0, maximum=60.0, read_only=False)
    compressed: bool = parameter(
        False, 'Take image_raw/compressed (CompressedImage) for the overlay instead of '
        'image_raw.')
    jpeg_quality: int = parameter(
        90, 'Quality of person_depth/image/compressed.', minimum=1, maximum=100,
        read_only=False)

    def __post_init__(self) -> None:
        self.distance_options()
        self.scan_options()
        checked_choice(self.target)

    def distance_options(self) -> DistanceOptions:
        """Return what the distance stage is told."""
        return DistanceOptions(
            estimator=self.estimator, body=self.body(), max_range=self.max_range,
            filter=self.filter_options() if self.filter else None)

    def filter_options(self) -> FilterOptions:
        """Return what the filter over time is told."""
        return FilterOptions(
            prediction_time=self.prediction_time, person_acceleration=self.person_acceleration,
            camera_acceleration=self.camera_acceleration)

    def body(self) -> Body:
        """Return what is said of the people in view."""
        measured = self.shoulder_width_sigma > 0
        # The shoulder method cannot go without a width; the others know the population's.
        given = measured or self.estimator == ShoulderEstimator.name
        spread = {'shoulder_width_sigma': self.shoulder_width_sigma} if measured else {}
        return Body(
            shoulder_width=self.shoulder_width if given else None,
            stature=self.stature or None, children=self.children, **spread)
