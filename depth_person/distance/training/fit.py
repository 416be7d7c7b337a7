"""Fits the lifter's network and writes it as ONNX with its metrics."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
import onnx
import torch
from torch import nn, Tensor
from torch.utils.data import DataLoader, IterableDataset

from depth_person.distance.lifter import Lifted, Lifter, LifterInputs
from depth_person.distance.training.metrics import report, temperature
from depth_person.distance.training.network import LifterNetwork
from depth_person.distance.training.population import Population, sample_population
from depth_person.distance.training.views import Examples, make_examples

#: Examples that judge, and as many that set the temperature.
_HELD_OUT = 20000
#: Part of the training that looks at mirror images too.
_SYMMETRIC = 0.3
#: Weights of the auxiliary losses: neck and yaw.
_NECK_WEIGHT, _YAW_WEIGHT = 20.0, 0.3
#: Largest difference that ONNX Runtime may have from torch.
_SAME = 1e-4


@dataclass(frozen=True)
class FitOptions:
    """
    What a training run may be told.

    :ivar bodies: people to sample; a tenth as many again are held out.
    :ivar epochs: how often each body is seen, each time in another view.
    :ivar batch: examples a step.
    :ivar width: of the hidden layers.
    :ivar children: part of the bodies that are children.
    """

    bodies: int = 30000
    epochs: int = 800
    seed: int = 1
    batch: int = 1024
    width: int = 256
    learning_rate: float = 2e-3
    children: float = 0.25


class _Views(IterableDataset):
    """Endless batches of random views, made in a process beside the training."""

    def __init__(self, people: Population, options: FitOptions) -> None:
        self._people, self._options = people, options

    def __iter__(self) -> Iterator[tuple[dict[str, NDArray[np.float32]], ...]]:
        rng = np.random.default_rng([self._options.seed, 2])
        while True:
            examples = make_examples(rng, self._people, self._options.batch)
            yield examples.inputs.as_feed(), {
                name: getattr(examples, name).astype(np.float32)
                for name in ('log_correction', 'neck', 'yaw')}


def fit(
    options: FitOptions, folder: Path, *, progress: Callable[..., Any],
) -> dict[str, Any]:
    """
    Train the lifter and write skeleton.onnx and skeleton.json into a folder.

    :param progress: like tqdm: takes an iterable and desc.
    :returns: what skeleton.json holds.
    :raises DepthPersonError: when anny is missing.
    """
    torch.manual_seed(options.seed)
    people = sample_population(
        options.seed, options.bodies, children=options.children, progress=progress)
    others = sample_population(
        options.seed + 1000, max(options.bodies // 10, 100), children=options.children,
        progress=progress)
    rng = np.random.default_rng([options.seed, 1])
    calibration, judging = (make_examples(rng, others, _HELD_OUT) for _ in range(2))
    network = LifterNetwork(options.width)
    _train(network, people, options, progress)
    network.temperature.fill_(temperature(calibration, _run(network, calibration.inputs)))
    folder.mkdir(parents=True, exist_ok=True)
    _export(network, judging, folder / 'skeleton.onnx')
    summary = {
        'options': asdict(options),
        'versions': {name: version(name) for name in ('anny', 'numpy', 'torch')},
        'temperature': round(float(network.temperature), 4),
        'held_out': report(judging, _run(network, judging.inputs)),
    }
    text = json.dumps(summary, indent=2) + '\n'
    (folder / 'skeleton.json').write_text(text, encoding='utf-8')
    return summary


def _train(
    network: LifterNetwork, people: Population, options: FitOptions,
    progress: Callable[..., Any],
) -> None:
    steps = max(options.bodies // options.batch, 1)
    total = steps * options.epochs
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=options.learning_rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, options.learning_rate, total_steps=total, pct_start=0.1)
    batches = iter(DataLoader(
        _Views(people, options), batch_size=None, num_workers=1, prefetch_factor=4))
    epochs = progress(range(options.epochs), desc='epochs')
    for epoch in epochs:
        network.symmetric = epoch >= (1 - _SYMMETRIC) * options.epochs
        losses = []
        for _ in range(steps):
            inputs, truth = next(batches)
            optimizer.zero_grad()
            loss = _loss(network(**inputs), **truth)
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimizer.step()
            schedule.step()
            losses.append(float(loss.detach()))
        epochs.set_postfix(loss=f'{np.mean(losses):.3f}')
    network.symmetric = True
    network.eval()


def _loss(
    told: tuple[Tensor, ...], log_correction: Tensor, neck: Tensor, yaw: Tensor,
) -> Tensor:
    """Return the negative log-likelihood of range, with the neck's and the yaw's errors."""
    mean, sigma, told_neck, told_yaw = told
    # Beyond six sigmas an example is a stray one and pulls no harder.
    off = ((log_correction - mean) / sigma).clamp(-6, 6)
    likelihood = (0.5 * off ** 2 + torch.log(sigma)).mean()
    direction = torch.stack([torch.cos(yaw), torch.sin(yaw)], dim=1)
    return (likelihood
            + _NECK_WEIGHT * nn.functional.smooth_l1_loss(told_neck, neck, beta=0.05)
            + _YAW_WEIGHT * ((told_yaw - direction) ** 2).mean())


def _run(network: LifterNetwork, inputs: LifterInputs) -> Lifted:
    with torch.no_grad():
        told = network(**{name: torch.from_numpy(value)
                          for name, value in inputs.as_feed().items()})
    return Lifted(*(value.double().numpy() for value in told))


def _export(network: LifterNetwork, examples: Examples, path: Path) -> None:
    """Write the network, and make sure that ONNX Runtime and torch agree."""
    names = [field.name for field in fields(LifterInputs)]
    outputs = [field.name for field in fields(Lifted)]
    few = examples.inputs.take(np.arange(len(examples.range)) < 8)
    torch.onnx.export(
        network, tuple(map(torch.from_numpy, few.as_feed().values())), str(path),
        input_names=names, output_names=outputs, opset_version=17, dynamo=False,
        dynamic_axes={name: {0: 'n'} for name in (*names, *outputs)})
    onnx.checker.check_model(str(path), full_check=True)
    ours, theirs = Lifter(path).lift(examples.inputs), _run(network, examples.inputs)
    for name in outputs:
        off = np.abs(getattr(ours, name) - getattr(theirs, name)).max()
        if off > _SAME:
            raise AssertionError(f'{name} differs by {off:g} between ONNX Runtime and torch')
