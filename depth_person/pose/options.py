"""What the pose stage may be told."""
from __future__ import annotations

from dataclasses import dataclass

from depth_person.errors import DepthPersonError
from depth_person.pose.image_tensor import AUTO, PIXEL_ORDERS, PIXEL_VALUES
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
    :ivar provider_fallback: whether the CPU stands in for a provider that is not there.
    :ivar detector: finds the people for a network that marks one person on a crop: as model.
    :ivar pixel_order: in which a network from a file takes colours: of PIXEL_ORDERS, or AUTO.
    :ivar pixel_values: in which it takes them: a name of PIXEL_VALUES, or AUTO.
    :raises DepthPersonError: when a value is out of its range.
    """

    model: str = DEFAULT_MODEL
    input_size: int = 512
    min_score: float = 0.2
    max_people: int = 20
    threads: int = 0
    provider: str = 'cpu'
    provider_fallback: bool = True
    detector: str = DEFAULT_MODEL
    pixel_order: str = AUTO
    pixel_values: str = AUTO

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
        for name, known in (
                ('provider', tuple(PROVIDERS)), ('pixel_order', (AUTO, *PIXEL_ORDERS)),
                ('pixel_values', (AUTO, *PIXEL_VALUES))):
            value = getattr(self, name)
            if value not in known:
                raise DepthPersonError(f'unknown {name} {value!r}; choose {", ".join(known)}')
