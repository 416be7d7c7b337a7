"""What the pose stage may be told."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.errors import DepthPersonError
from depth_person.pose.movenet import SIDE_STEP
from depth_person.pose.runtime import PROVIDERS
from depth_person.pose.store import DEFAULT_MODEL


@dataclass(frozen=True)
class PoseOptions:
    """
    What the pose stage may be told.

    :ivar model: a name of depth_person.pose.store.MODELS, or the path of an ONNX file.
    :ivar input_size: longer side of the image that the network sees, pixels; a multiple of 32.
        Networks for one person have a size of their own.
    :ivar min_score: keypoints that score less are missing.
    :ivar max_people: the surest so many are kept.
    :ivar threads: that the network may use; 0 for one a core.
    :ivar provider: of depth_person.pose.runtime.PROVIDERS.
    :raises DepthPersonError: when a value is out of its range.
    """

    model: str = DEFAULT_MODEL
    input_size: int = 512
    min_score: float = 0.2
    max_people: int = 20
    threads: int = 0
    provider: str = 'cpu'

    def __post_init__(self) -> None:
        if self.input_size % SIDE_STEP or not 128 <= self.input_size <= 2048:
            raise DepthPersonError(
                f'input_size {self.input_size} is not a multiple of {SIDE_STEP} '
                'from 128 to 2048')
        if not 0.0 < self.min_score < 1.0:
            raise DepthPersonError(f'min_score {self.min_score:g} is not between 0 and 1')
        if not 1 <= self.max_people <= 100:
            raise DepthPersonError(f'max_people {self.max_people} is not from 1 to 100')
        if self.threads < 0:
            raise DepthPersonError(f'threads {self.threads} is negative; 0 means one a core')
        if self.provider not in PROVIDERS:
            raise DepthPersonError(
                f'unknown provider {self.provider!r}; choose {", ".join(PROVIDERS)}')
