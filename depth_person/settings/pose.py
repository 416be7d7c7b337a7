"""The parameters of pose_node."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.pose.image_tensor import AUTO, PIXEL_ORDERS, PIXEL_VALUES
from depth_person.pose.options import PoseOptions
from depth_person.pose.runtime import PROVIDERS
from depth_person.pose.store import DEFAULT_MODEL, DEFAULT_REFINER
from depth_person.settings.node import NodeSettings
from depth_person.settings.parameter import parameter


@dataclass(frozen=True)
class PoseSettings(NodeSettings):
    """The parameters of pose_node."""

    model: str = parameter(
        DEFAULT_MODEL,
        'Pose network: a name that `depth_person models list` shows, or an ONNX file (MoveNet, '
        'RTMO, RTMPose, OpenPose, BlazePose).')
    input_size: int = parameter(
        512, 'Longer side of the image that the network sees, pixels: a multiple of 32.',
        minimum=128, maximum=2048)
    min_score: float = parameter(
        0.2, 'Keypoints that score less are missing.', minimum=0.01, maximum=0.99)
    max_people: int = parameter(
        20, 'So many are kept: the nearest, told by how large they look; the surest where there '
        'is no refiner.', minimum=1, maximum=100)
    refiner: str = parameter(
        DEFAULT_REFINER,
        'MoveNet for one person that marks everybody who is tracked on a crop, at every frame, '
        'while model only looks for new people; none lets model do it all. Other networks than '
        'movenet-multipose go without.')
    detection_budget: float = parameter(
        5.0, 'What looking for new people may cost a frame on average, milliseconds of two AVX2 '
        'cores; thrice this while nobody is tracked, and more at the first frame.',
        minimum=0.0, maximum=1000.0)
    threads: int = parameter(
        0, 'Threads that the network may use; 0 for one a core.', minimum=0, maximum=256)
    provider: str = parameter(
        'cpu', 'Execution provider of ONNX Runtime.', choices=tuple(PROVIDERS))
    provider_fallback: bool = parameter(
        True, 'Run on the CPU, with a warning in the diagnostics, where that provider is not '
        'there; otherwise the node does not start.')
    detector: str = parameter(
        DEFAULT_MODEL,
        'What finds the people for a network that marks one person on a crop (RTMPose, '
        'BlazePose): as model.')
    pixel_order: str = parameter(
        AUTO, 'Order in which a network from an ONNX file takes colours; auto for what its kind '
        'usually takes.', choices=(AUTO, *PIXEL_ORDERS))
    pixel_values: str = parameter(
        AUTO, 'Values in which it takes them: bytes 0 to 255, unit 0 to 1, centred -0.5 to 0.5, '
        'imagenet with mean and standard deviation.', choices=(AUTO, *PIXEL_VALUES))
    compressed: bool = parameter(
        False, 'Take image_raw/compressed (CompressedImage) instead of image_raw.')

    def pose_options(self) -> PoseOptions:
        """
        Return what the pose stage is told.

        :raises DepthPersonError: when a value is out of its range.
        """
        return PoseOptions(
            model=self.model, input_size=self.input_size, min_score=self.min_score,
            max_people=self.max_people, refiner=self.refiner,
            detection_budget=self.detection_budget, threads=self.threads, provider=self.provider,
            provider_fallback=self.provider_fallback, detector=self.detector,
            pixel_order=self.pixel_order, pixel_values=self.pixel_values)
