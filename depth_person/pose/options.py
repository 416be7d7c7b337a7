"""What the pose stage may be told."""
from __future__ import annotations

from dataclasses import dataclass, replace

from depth_person.errors import DepthPersonError
from depth_person.pose.image_tensor import AUTO, PIXEL_ORDERS, PIXEL_VALUES
from depth_person.pose.movenet import SIDE_STEP
from depth_person.pose.runtime import PROVIDERS, settle_provider
from depth_person.pose.store import DEFAULT_MODEL, DEFAULT_REFINER

#: The refiner of a pose stage whose network does all at every frame.
NO_REFINER = 'none'


@dataclass(frozen=True)
class PoseOptions:
    """
    What the pose stage may be told.

    :ivar model: a name of depth_person.pose.store.MODELS, or the path of an ONNX file.
    :ivar input_size: longer side of the image that the network sees, pixels; a multiple of 32.
        Networks for one person have a size of their own.
    :ivar refiner: a MoveNet for one person that marks everybody on a crop at every frame, as
        model, while the MoveNet for many people only looks for new ones; NO_REFINER for none.
    :ivar detection_budget: what these looks may cost a frame, ms by the model of
        depth_person.pose.looks; 0 for none but at the first frame.
    :ivar min_score: keypoints that score less are missing.
    :ivar max_people: so many are kept: the nearest, or the surest where there is no refiner.
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
    refiner: str = DEFAULT_REFINER
    detection_budget: float = 5.0
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
        if not 0.0 <= self.detection_budget <= 1000.0:
            raise DepthPersonError(
                f'detection_budget {self.detection_budget:g} is not from 0 to 1000 ms')
        if self.threads < 0:
            raise DepthPersonError(f'threads {self.threads} is negative; 0 means one a core')
        for name, known in (
                ('provider', tuple(PROVIDERS)), ('pixel_order', (AUTO, *PIXEL_ORDERS)),
                ('pixel_values', (AUTO, *PIXEL_VALUES))):
            value = getattr(self, name)
            if value not in known:
                raise DepthPersonError(f'unknown {name} {value!r}; choose {", ".join(known)}')


def settled(options: PoseOptions) -> tuple[PoseOptions, str]:
    """
    Return options whose provider can be used here, and a warning where it is another one.

    :raises DepthPersonError: when the provider is not there, and the CPU may not stand in.
    """
    provider, warning = settle_provider(options.provider, fallback=options.provider_fallback)
    return replace(options, provider=provider), warning
