"""The lifter's network; needs torch, so only training imports it."""
from __future__ import annotations

import torch
from torch import nn, Tensor

from depth_person.distance.canonical import MIRRORED
from depth_person.distance.conventions import N_FIGURES
from depth_person.pose.skeleton import N_KEYPOINTS

#: Cues that are fused by their variances.
N_CUES = 6
#: Nearness, the convention's figures, stature (3), shoulder width (3), children.
N_CONTEXT = 1 + N_FIGURES + 7
#: Largest distance of a cue's log-range from their common middle. Two cues are then at most 1/2
#: apart, so whatever noise takes from one cue's weight raises sigma more than it moves the range.
REACH = 0.25

_FEATURES = 3 * N_KEYPOINTS + 4 + N_CONTEXT
_HEADS = (1, N_CUES, N_CUES, N_CUES * N_KEYPOINTS, 2, 2)


class LifterNetwork(nn.Module):
    """
    Cues of range from a canonical skeleton, fused by their variances.

    A perceptron that is not told the keypoints' noise gives, for each cue j, a log-range m_j, a
    spread a_j that the body alone causes, and for each keypoint i how much its noise n_i costs
    the cue, b_ji. The cue's variance is a_j^2 + sum_i (b_ji n_i)^2, the cues are fused as if
    independent, and training makes the fused variance true. So sigma, in metres too, grows with
    every n_i for certain. A person and its mirror image are both looked at, and their cues
    averaged, so that mirroring changes nothing.

    :ivar symmetric: look at the mirror image too; training starts without, in half the time.
    :ivar temperature: what sigma is multiplied with to be true on held-out bodies.
    """

    mirrored: Tensor
    flip: Tensor
    temperature: Tensor

    def __init__(self, width: int) -> None:
        super().__init__()
        self.trunk = nn.Sequential(
            nn.Linear(_FEATURES, width), nn.SiLU(), nn.Linear(width, width), nn.SiLU(),
            nn.Linear(width, width), nn.SiLU(), nn.Linear(width, sum(_HEADS)))
        self.register_buffer('mirrored', torch.as_tensor(MIRRORED), persistent=False)
        self.register_buffer('flip', torch.tensor([-1.0, 1.0]), persistent=False)
        self.register_buffer('temperature', torch.ones(()))
        self.symmetric = True

    def forward(
        self, points: Tensor, known: Tensor, noise: Tensor, gravity: Tensor, context: Tensor,
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return log_correction (n,), log_sigma (n,), neck (n, 2) and yaw (n, 2)."""
        heads = self._heads(points, known, gravity, context)
        if self.symmetric:
            heads = self._with_mirror_image(heads, points, known, gravity, context)
        middle, offset, own, cost, neck, yaw = heads
        variance = own ** 2 + (cost ** 2 * (known * noise)[:, None] ** 2).sum(2)
        weight = 1 / variance
        total = weight.sum(1)
        log_correction = middle[:, 0] + (weight * offset).sum(1) / total
        return log_correction, self.temperature * total ** -0.5, neck, yaw

    def _with_mirror_image(
        self, heads: tuple[Tensor, ...], points: Tensor, known: Tensor, gravity: Tensor,
        context: Tensor,
    ) -> tuple[Tensor, ...]:
        across = torch.cat([gravity[:, :1] * -1, gravity[:, 1:]], dim=1)
        middle, offset, own, cost, neck, yaw = self._heads(
            (points * self.flip)[:, self.mirrored], known[:, self.mirrored], across, context)
        image = (middle, offset, own, cost[:, :, self.mirrored], neck * self.flip,
                 yaw * -self.flip)
        return tuple((a + b) / 2 for a, b in zip(heads, image, strict=True))

    def _heads(
        self, points: Tensor, known: Tensor, gravity: Tensor, context: Tensor,
    ) -> tuple[Tensor, ...]:
        seen = points * known[..., None]
        features = torch.cat([seen.flatten(1), known, gravity, context], dim=1)
        middle, offset, own, cost, neck, yaw = self.trunk(features).split(_HEADS, dim=1)
        return (
            middle, REACH * torch.tanh(offset), nn.functional.softplus(own - 1) + 0.01,
            nn.functional.softplus(cost.unflatten(1, (N_CUES, N_KEYPOINTS)) - 1), neck, yaw)
