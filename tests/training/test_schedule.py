"""Order and learning rates as functions of the settings."""

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.training.schedule import LoopSettings


def test_an_epoch_has_every_sequence_once_and_an_order_of_its_own():
    settings = LoopSettings(learning_rate=1, epochs=2, sequences_per_step=3)
    assert settings.n_steps(8) == 6
    steps = [settings.sequences_of(step, 8) for step in range(6)]
    assert [len(step) for step in steps] == [3, 3, 2] * 2
    epochs = [[number for step in epoch for number in step] for epoch in (steps[:3], steps[3:])]
    assert [sorted(epoch) for epoch in epochs] == [list(range(8))] * 2
    assert epochs[0] != epochs[1]
    assert [settings.sequences_of(step, 8) for step in range(6)] == steps


def test_another_seed_is_another_order():
    orders = [
        LoopSettings(learning_rate=1, seed=seed, sequences_per_step=20).sequences_of(0, 20)
        for seed in (0, 1)
    ]
    assert orders[0] != orders[1]


def test_a_number_of_steps_takes_the_place_of_epochs():
    settings = LoopSettings(learning_rate=1, max_steps=7, sequences_per_step=4)
    assert settings.n_steps(8) == 7
    assert len(settings.sequences_of(6, 8)) == 4


# By hand from the published `linear_warmup_linear_decay`: (k + 1) / (warm + 1) while warming up,
# then down to 1 / rest.
PUBLISHED = {
    0.0: [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1],
    0.03: [1 / 2, 1.0, 8 / 9, 7 / 9, 6 / 9, 5 / 9, 4 / 9, 3 / 9, 2 / 9, 1 / 9],
    0.4: [0.2, 0.4, 0.6, 0.8, 1.0, 5 / 6, 4 / 6, 3 / 6, 2 / 6, 1 / 6],
    1.0: [step / 11 for step in range(1, 11)],
}


@pytest.mark.parametrize("warmup_ratio", PUBLISHED)
def test_the_learning_rate_is_that_of_the_published_schedule(warmup_ratio):
    settings = LoopSettings(learning_rate=0.5, warmup_ratio=warmup_ratio)
    rates = [settings.learning_rate_of(step, 10) for step in range(10)]
    assert rates == pytest.approx([0.5 * share for share in PUBLISHED[warmup_ratio]])


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
def test_values_out_of_range_are_refused(settings, message):
    with pytest.raises(UsageError, match=message):
        LoopSettings(**{"learning_rate": 1e-5, **settings})
