"""The parameters of every node: what nodes declare, check and read, and the README lists."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
import difflib
import math
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depth_person.camera.deblur import motion_kernel
from depth_person.distance.conventions import CONVENTIONS
from depth_person.distance.estimator import Body
from depth_person.distance.estimators import ESTIMATORS
from depth_person.distance.shoulder import ShoulderEstimator
from depth_person.errors import DepthPersonError

#: What a parameter of this package can hold.
ParameterValue = bool | int | float | str

_Value = TypeVar('_Value', bound=ParameterValue)
_TYPE_NAMES = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}
#: Names that ROS 2 itself declares on every node.
_FOREIGN = ('use_sim_time', 'start_type_description_service')


@dataclass(frozen=True)
class ParameterSpec:
    """
    One parameter; the default decides its type.

    :ivar minimum: the lowest value allowed, for numbers.
    :ivar maximum: the highest value allowed, for numbers.
    :ivar choices: the only texts allowed; empty for any.
    :ivar read_only: whether it can only be given at the start.
    """

    name: str
    default: ParameterValue
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()
    read_only: bool = True

    @property
    def type_name(self) -> str:
        """The type's name in ROS 2."""
        return _TYPE_NAMES[type(self.default)]

    def checked(self, value: object) -> ParameterValue:
        """
        Return the value, an integer given for a double made one.

        :raises DepthPersonError: when it is of another type or out of range; says why.
        """
        kind = type(self.default)
        if kind is float and type(value) is int:
            value = float(value)
        if type(value) is not kind:
            raise DepthPersonError(f'{self.name} takes a {self.type_name}, not {value!r}')
        assert isinstance(value, (bool, int, float, str))
        if not isinstance(value, str) and not self.minimum <= value <= self.maximum:
            raise DepthPersonError(
                f'{self.name} = {value:g} is out of range: {self.minimum:g} to {self.maximum:g}')
        if self.choices and value not in self.choices:
            raise DepthPersonError(
                f'{self.name} = {value!r} is not one of {", ".join(self.choices)}')
        return value


def parameter(
    default: _Value, description: str, *, minimum: float = -math.inf, maximum: float = math.inf,
    choices: tuple[str, ...] = (), read_only: bool = True,
) -> _Value:
    """Return the field of a dataclass that is the parameter of the same name."""
    return field(default=default, metadata={
        'description': description, 'minimum': minimum, 'maximum': maximum, 'choices': choices,
        'read_only': read_only})


def specs(settings: type) -> tuple[ParameterSpec, ...]:
    """Return the parameters that a dataclass of them holds, in order."""
    return tuple(
        ParameterSpec(each.name, getattr(settings, each.name), **each.metadata)
        for each in fields(settings))


@dataclass(frozen=True)
class CameraSettings:
    """
    The parameters of camera_node.

    :raises DepthPersonError: when values do not go together.
    """

    source: str = parameter(
        '', 'Where frames come from: a video file, a folder of images, a device such as '
        '/dev/video0, a stream URL (rtsp://, udp://), or a bag.')
    camera_info_url: str = parameter(
        '', 'Calibration file in the YAML of camera_calibration: a path, file:// or package://. '
        'Comes before horizontal_fov and before what a bag says.')
    horizontal_fov: float = parameter(
        0.0, 'Horizontal field of view in degrees, for a camera that was never calibrated; '
        '0 where it is not known.', minimum=0.0, maximum=179.0)
    fps: float = parameter(
        0.0, "Frames a second of a folder, or asked of a camera; 0 for the source's own.",
        minimum=0.0, maximum=1000.0)
    loop: bool = parameter(False, 'Start a file, folder or bag again when it ends.')
    frame_id: str = parameter(
        'camera_optical_frame',
        'Name of the optical frame (z forward, x right, y down); bags keep their own.')
    image_topic: str = parameter(
        '', 'Image topic of a bag that has several; empty for the only one.')
    timeout: float = parameter(
        2.0, 'A device or stream that sends no frame for so many seconds is opened again.',
        minimum=0.1, maximum=60.0)
    motion_blur: float = parameter(
        0.0, 'Length of a known motion blur that is undone by a Wiener filter, pixels; 0 for '
        'none. A wrong length or angle does more harm than the blur.', minimum=0.0,
        maximum=100.0)
    motion_blur_angle: float = parameter(
        0.0, 'Direction of that motion, degrees clockwise from the right.', minimum=-180.0,
        maximum=180.0)
    publish_clock: bool = parameter(
        False, 'Publish /clock from the stamps of a file, folder or bag, for nodes that run '
        'with use_sim_time.')
    wait_for_subscribers: bool = parameter(
        False, 'Send the first frame only when someone subscribes, and for two seconds nobody '
        'else has come: so that no subscriber misses the beginning of a recording.')
    jpeg_quality: int = parameter(
        90, 'Quality of image_raw/compressed.', minimum=1, maximum=100, read_only=False)

    def __post_init__(self) -> None:
        self.blur_kernel()

    def blur_kernel(self) -> NDArray[np.float64] | None:
        """Return the kernel of the motion blur to undo; None for none."""
        if not self.motion_blur:
            return None
        return motion_kernel(self.motion_blur, self.motion_blur_angle)


@dataclass(frozen=True)
class PoseSettings:
    """The parameters of pose_node."""

    model: str = parameter(
        'movenet-multipose',
        'Pose network: a name that `depth_person models list` shows, or an ONNX file.')
    input_size: int = parameter(
        512, 'Longer side of the image that the network sees, pixels: a multiple of 32.',
        minimum=128, maximum=2048)
    min_score: float = parameter(
        0.2, 'Keypoints that score less are missing.', minimum=0.01, maximum=0.99)
    max_people: int = parameter(20, 'The surest so many are kept.', minimum=1, maximum=100)
    threads: int = parameter(
        0, 'Threads that the network may use; 0 for one a core.', minimum=0, maximum=256)
    provider: str = parameter(
        'cpu', 'Execution provider of ONNX Runtime.',
        choices=('cpu', 'cuda', 'tensorrt', 'openvino'))
    compressed: bool = parameter(
        False, 'Take image_raw/compressed (CompressedImage) instead of image_raw.')


@dataclass(frozen=True)
class DepthSettings:
    """
    The parameters of depth_node.

    :raises DepthPersonError: when values do not go together.
    """

    estimator: str = parameter(
        'skeleton', 'How a range is computed.', choices=ESTIMATORS, read_only=False)
    convention: str = parameter(
        'movenet', 'Where the pose network marks keypoints; `coco` for one that nobody has '
        'measured.', choices=tuple(CONVENTIONS))
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
    attitude: str = parameter(
        'unknown', "Where the camera's attitude comes from: `fixed`, the parameters alone; "
        '`imu`, the topic imu and how the camera is mounted on that body.',
        choices=('unknown', 'fixed', 'imu'))
    camera_pitch: float = parameter(
        0.0, "How far the camera looks down, degrees from level or from the body's forward.",
        minimum=-90.0, maximum=90.0, read_only=False)
    camera_roll: float = parameter(
        0.0, 'How far the camera is rolled clockwise, seen from behind, degrees.',
        minimum=-180.0, maximum=180.0, read_only=False)
    attitude_sigma: float = parameter(
        1.0, 'Standard deviation of the attitude, degrees.', minimum=0.01, maximum=30.0,
        read_only=False)
    camera_height: float = parameter(
        0.0, 'Of the camera above the ground that people stand on, metres; 0 where it is not '
        'known. With the attitude known, feet then tell distances, too.', minimum=0.0,
        maximum=500.0, read_only=False)
    camera_height_sigma: float = parameter(
        0.1, 'Standard deviation of the height, metres.', minimum=0.001, maximum=50.0,
        read_only=False)
    max_range: float = parameter(
        100.0, 'Who is further away than this has no range, metres.', minimum=1.0,
        maximum=1000.0, read_only=False)
    compressed: bool = parameter(
        False, 'Take image_raw/compressed (CompressedImage) for the overlay instead of '
        'image_raw.')
    jpeg_quality: int = parameter(
        90, 'Quality of person_depth/image/compressed.', minimum=1, maximum=100,
        read_only=False)

    def __post_init__(self) -> None:
        self.body()

    def body(self) -> Body:
        """Return what is said of the people in view."""
        measured = self.shoulder_width_sigma > 0
        # The shoulder method cannot go without a width; the others know the population's.
        given = measured or self.estimator == ShoulderEstimator.name
        spread = {'shoulder_width_sigma': self.shoulder_width_sigma} if measured else {}
        return Body(
            shoulder_width=self.shoulder_width if given else None,
            stature=self.stature or None, children=self.children, **spread)


#: Node name -> its parameters, in the order in which the README lists them.
PARAMETERS: Mapping[str, tuple[ParameterSpec, ...]] = MappingProxyType({
    'camera_node': specs(CameraSettings),
    'pose_node': specs(PoseSettings),
    'depth_node': specs(DepthSettings),
})


def unknown_parameter(given: str, own: tuple[ParameterSpec, ...]) -> str:
    """
    Return what is wrong with the name of a parameter given to a node; nothing if it is fine.

    A file may give one parameter to all nodes (`/**:`), so what any node knows is let through.
    """
    known = {spec.name for table in PARAMETERS.values() for spec in table}
    if given in known or given in _FOREIGN or given.startswith('qos_overrides.'):
        return ''
    names = [spec.name for spec in own]
    close = difflib.get_close_matches(given, names, n=1)
    meant = f'did you mean {close[0]}?' if close else f'it takes {", ".join(names)}'
    return f'there is no parameter {given!r}; {meant}'
