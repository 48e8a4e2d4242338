"""Trains a copy of a model to give for spoilt pictures what the model itself gives for them as they were."""

import copy
import math
import time
from collections.abc import Callable
from typing import Final

import numpy as np
import torch
from network import Network

_RATE: Final = 3e-4
"""Largest step, relative to the root mean square of the weights of a layer; with 2e-3, the loss grows."""
_WARM_UP: Final = 60


def distilled(
    content: bytes,
    loss_of: Callable[[Network, Network], torch.Tensor],
    minutes: float,
    start: bytes | None = None,
) -> bytes:
    """Return the model file ``content`` after training its weights for so long.

    Args:
        content: The model file, which is the teacher.
        loss_of: Called with teacher and learner for each step; returns the loss of a batch of pictures.
        minutes: Time to train; the steps become smaller towards its end.
        start: The model file which is the first state of the learner; without it, ``content``.
    """
    teacher, learner = Network(content).eval().requires_grad_(False), Network(start or content)
    mean = copy.deepcopy(learner).requires_grad_(False)
    layers = [
        {"params": [each], "size": max(1e-4, float(each.detach().square().mean().sqrt()))}
        for each in learner.parameters()
    ]
    optimiser = torch.optim.Adam(layers, lr=_RATE, betas=(0.9, 0.99))
    began, step, losses = time.monotonic(), 0, []
    while (done := (time.monotonic() - began) / (60 * minutes)) < 1:
        rate = _RATE * min(1, step / _WARM_UP) * max(0.02, 0.5 * (1 + math.cos(math.pi * done)))
        for layer in optimiser.param_groups:
            layer["lr"] = rate * layer["size"]
        loss = loss_of(teacher, learner)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(learner.parameters(), 10.0)
        optimiser.step()
        step += 1
        with torch.no_grad():
            for averaged, each in zip(mean.parameters(), learner.parameters(), strict=True):
                averaged.lerp_(each, max(0.005, 1 / (step + 9)))
        losses.append(float(loss.detach()))
        if step % 25 == 0:
            print(f"step {step}, {done:.0%}: loss {np.mean(losses[-25:]):.3f}", flush=True)
    return bytes(mean.file())


def tensor(pictures: list[np.ndarray]) -> torch.Tensor:
    """Return (side, side, 3) BGR pictures, 0 to 255, as a network's input: (n, 3, side, side) RGB, 0 to 1."""
    rgb = np.stack(pictures)[..., ::-1] / np.float32(255)
    return torch.tensor(rgb.copy()).permute(0, 3, 1, 2).contiguous(memory_format=torch.channels_last)
