"""The steps of a stage of the small model's training."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.nn import Parameter

from infthor_eval.training.checkpoints import Checkpoints

_WARM_UP = 50  # steps
_LOWEST = 0.03  # final learning rate as a share of the highest
_CLIP = 1.0
_BETAS = (0.9, 0.98)
_STEPS_PER_STATE = 100  # a state is written, from which a stopped training continues


def adamw(
    trained: Iterable[tuple[Sequence[Parameter], float]], weight_decay: float
) -> torch.optim.AdamW:
    """Return the optimizer of what Muon does not train, and of its highest learning rates."""
    groups = [
        {**group, "lr": lr}
        for parameters, lr in trained
        for group in _decay_groups(parameters, weight_decay)
    ]
    return torch.optim.AdamW(groups, betas=_BETAS)


def _decay_groups(parameters: Sequence[Parameter], weight_decay: float) -> list[dict[str, Any]]:
    """Return parameter groups of an optimizer: matrices decay, biases and norms do not."""
    groups = [
        {
            "params": [parameter for parameter in parameters if parameter.ndim > 1],
            "weight_decay": weight_decay,
        },
        {
            "params": [parameter for parameter in parameters if parameter.ndim <= 1],
            "weight_decay": 0.0,
        },
    ]
    return [group for group in groups if group["params"]]


@dataclass(frozen=True)
class NanoProgress:
    """A finished step.

    Attributes:
        stage: "vision" or "reading".
        step: number of the step in the stage, from 1.
        n_steps: steps of the stage.
        loss: loss in nats: in the first stage of units and names of patches, in the second the sum
            of the losses per token of answers, of actions, and of weighted synthetic plans.
    """

    stage: str
    step: int
    n_steps: int
    loss: float


@dataclass(frozen=True)
class Stage:
    """A stage of the training.

    Attributes:
        name: name of the stage.
        n_steps: number of its steps.
        network: what is trained.
        optimizers: optimizers, with the highest learning rate in each of their groups.
        compute: adds the gradients of a step, given its number, and returns its loss.
    """

    name: str
    n_steps: int
    network: torch.nn.Module
    optimizers: Sequence[torch.optim.Optimizer]
    compute: Callable[[int], Tensor]


def run_stage(
    stage: Stage, checkpoints: Checkpoints, on_step: Callable[[NanoProgress], None]
) -> None:
    """Run the steps of a stage that its last state has not, with a linear warm-up and a cosine
    decay of the learning rates.
    """
    highest = [group["lr"] for group in _groups(stage)]
    first = checkpoints.restore(stage.network, *stage.optimizers)
    # Only now, as an optimizer that is restored has other groups, with the state's learning rates.
    groups = _groups(stage)
    trained = [parameter for group in groups for parameter in group["params"]]
    stage.network.train()
    for number in range(first, stage.n_steps):
        warm_up = min(1.0, (number + 1) / _WARM_UP)
        decay = 0.5 * (1 + math.cos(math.pi * number / stage.n_steps))
        for group, lr in zip(groups, highest, strict=True):
            group["lr"] = lr * warm_up * (_LOWEST + (1 - _LOWEST) * decay)
        stage.network.zero_grad()
        loss = stage.compute(number)
        torch.nn.utils.clip_grad_norm_(trained, _CLIP)
        for optimizer in stage.optimizers:
            optimizer.step()
        n_done = number + 1
        if n_done % _STEPS_PER_STATE == 0 or n_done == stage.n_steps:
            checkpoints.save(n_done, stage.network, *stage.optimizers)
        on_step(NanoProgress(stage.name, n_done, stage.n_steps, loss.item()))
    stage.network.eval()


def _groups(stage: Stage) -> list[dict[str, Any]]:
    return [group for optimizer in stage.optimizers for group in optimizer.param_groups]
