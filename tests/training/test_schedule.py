"""Order and learning rates as functions of the settings."""

import math

import pytest
import torch
from transformers import get_linear_schedule_with_warmup

from infthor_eval.errors import UsageError
from infthor_eval.training.schedule import LoopSettings


def test_an_epoch_has_every_sequence_once_and_an_order_of_its_own() -> None:
    settings = LoopSettings(learning_rate=1, epochs=2, sequences_per_step=3)
    assert settings.n_steps(8) == 6
    steps = [settings.sequences_of(step, 8) for step in range(6)]
    assert [len(step) for step in steps] == [3, 3, 2] * 2
    epochs = [[number for step in epoch for number in step] for epoch in (steps[:3], steps[3:])]
    assert [sorted(epoch) for epoch in epochs] == [list(range(8))] * 2
    assert epochs[0] != epochs[1]
    assert [settings.sequences_of(step, 8) for step in range(6)] == steps


def test_another_seed_is_another_order() -> None:
    orders = [LoopSettings(learning_rate=1, seed=seed, sequences_per_step=20).sequences_of(0, 20) for seed in (0, 1)]
    assert orders[0] != orders[1]


def test_a_number_of_steps_takes_the_place_of_epochs() -> None:
    settings = LoopSettings(learning_rate=1, max_steps=7, sequences_per_step=4)
    assert settings.n_steps(8) == 7
    assert len(settings.sequences_of(6, 8)) == 4


@pytest.mark.parametrize("warmup_ratio", [0.0, 0.03, 0.25, 1.0])
def test_the_learning_rate_is_that_of_transformers_linear_schedule(warmup_ratio: float) -> None:
    settings = LoopSettings(learning_rate=0.5, warmup_ratio=warmup_ratio)
    n_steps = 20
    optimizer = torch.optim.SGD([torch.nn.Parameter(torch.zeros(1))], lr=0.5)
    schedule = get_linear_schedule_with_warmup(optimizer, math.ceil(warmup_ratio * n_steps), n_steps)
    for step in range(n_steps):
        assert settings.learning_rate_of(step, n_steps) == pytest.approx(schedule.get_last_lr()[0])
        optimizer.step()
        schedule.step()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"learning_rate": 0}, "learning_rate=0 is not a number above 0"),
        ({"learning_rate": float("nan")}, "learning_rate=nan"),
        ({"betas": (0.9, 1.0)}, "betas=0.9,1.0 are not"),
        ({"warmup_ratio": 1.5}, "warmup_ratio=1.5 is not between 0 and 1"),
        ({"weight_decay": -1}, "weight_decay=-1 is not 0 or more"),
        ({"max_steps": 0}, "max_steps=0"),
        ({"sequences_per_step": 0}, "sequences_per_step=0"),
    ],
)
def test_values_out_of_range_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        LoopSettings(**{"learning_rate": 1e-5, **settings})
