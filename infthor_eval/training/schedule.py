"""Sequences and learning rate of each training step, as pure functions of the settings."""

import math
from dataclasses import dataclass

import torch

from infthor_eval.errors import UsageError
from infthor_eval.storage.digests import seed_of


def linear_share(step: int, n_steps: int, warmup_ratio: float) -> float:
    """Return a step's share of the highest learning rate, by the published linear schedule.

    Steps count from 0. The first step of a warm-up has a part of the rate already, unlike in
    transformers' schedule.
    """
    n_warm = math.ceil(warmup_ratio * n_steps)
    if step < n_warm:
        return (step + 1) / (n_warm + 1)
    return (n_steps - step) / max(1, n_steps - n_warm)


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """Settings of a training run, with the defaults of the published trainer.

    Attributes:
        learning_rate: highest learning rate, reached linearly at the end of the warm-up; it then
            falls linearly to 0.
        betas: betas of AdamW.
        weight_decay: weight decay of AdamW, for all trained weights, biases and norms too.
        clip: largest norm of a step's gradient.
        warmup_ratio: share of the steps in which the learning rate rises.
        epochs: number of epochs.
        max_steps: number of steps instead of epochs, or None.
        sequences_per_step: sequences of a step, of all processes together; the last step of an
            epoch may have fewer.
        seed: seed of the order of the sequences and of dropout.
        save_every: steps between states; None for one at the end only.
    """

    learning_rate: float
    betas: tuple[float, float] = (0.9, 0.95)
    weight_decay: float = 0.1
    clip: float = 1.0
    warmup_ratio: float = 0.03
    epochs: int = 3
    max_steps: int | None = None
    sequences_per_step: int = 8
    seed: int = 0
    save_every: int | None = None

    def __post_init__(self) -> None:
        for name in (
            "learning_rate",
            "clip",
            "epochs",
            "max_steps",
            "sequences_per_step",
            "save_every",
        ):
            value = getattr(self, name)
            if value is not None and not (value > 0 and math.isfinite(value)):
                raise UsageError(f"{name}={value} is not a number above 0")
        if not all(0 <= beta < 1 for beta in self.betas):
            raise UsageError(
                f"betas={self.betas[0]},{self.betas[1]} are not at least 0 and below 1"
            )
        if not 0 <= self.warmup_ratio <= 1:
            raise UsageError(f"warmup_ratio={self.warmup_ratio} is not between 0 and 1")
        if not (self.weight_decay >= 0 and math.isfinite(self.weight_decay)):
            raise UsageError(f"weight_decay={self.weight_decay} is not 0 or more")

    def n_steps(self, n_sequences: int) -> int:
        """Return the number of steps of a run."""
        return (
            self.epochs * self._epoch_steps(n_sequences)
            if self.max_steps is None
            else self.max_steps
        )

    def sequences_of(self, step: int, n_sequences: int) -> list[int]:
        """Return the numbers of a step's sequences; steps count from 0. Each epoch has its own
        random order."""
        epoch, at = divmod(step, self._epoch_steps(n_sequences))
        generator = torch.Generator().manual_seed(seed_of(f"{self.seed} epoch {epoch}") % 2**63)
        order: list[int] = torch.randperm(n_sequences, generator=generator).tolist()
        return order[at * self.sequences_per_step : (at + 1) * self.sequences_per_step]

    def learning_rate_of(self, step: int, n_steps: int) -> float:
        """Return the learning rate of a step."""
        return self.learning_rate * linear_share(step, n_steps, self.warmup_ratio)

    def _epoch_steps(self, n_sequences: int) -> int:
        return math.ceil(n_sequences / self.sequences_per_step)
