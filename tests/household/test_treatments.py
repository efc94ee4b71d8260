"""What is washed, heated and cooled, on views by hand."""

import pytest

from infthor_eval.household.treatments import Treatments
from tests.plans.building import (
    APPLE,
    BASIN,
    BATH_FAUCET,
    BATHTUB,
    CUP,
    FAUCET,
    FRIDGE,
    MICROWAVE,
    MUG,
    PLATE,
    kitchen,
)

NONE = Treatments()
IN_BOTH, ON_A_PLATE = kitchen({MUG: BASIN, CUP: BATHTUB}), kitchen({PLATE: FRIDGE, APPLE: PLATE})


@pytest.mark.parametrize(
    ("action", "object_id", "view", "expected"),
    [
        ("ToggleObjectOn", FAUCET, IN_BOTH, Treatments(clean=frozenset({MUG}))),
        ("ToggleObjectOn", BATH_FAUCET, IN_BOTH, Treatments(clean=frozenset({CUP}))),
        ("ToggleObjectOn", FAUCET, kitchen(without=[BASIN, BATHTUB]), NONE),
        ("ToggleObjectOff", FAUCET, kitchen({MUG: BASIN}), NONE),
        ("ToggleObjectOn", FAUCET, kitchen({MUG: BASIN}, refused=True), NONE),
        ("ToggleObjectOn", MICROWAVE, kitchen({MUG: MICROWAVE}), Treatments(hot=frozenset({MUG}))),
        ("CloseObject", MICROWAVE, kitchen({MUG: MICROWAVE}), NONE),
        ("CloseObject", FRIDGE, kitchen({MUG: FRIDGE}), Treatments(cold=frozenset({MUG}))),
        ("OpenObject", FRIDGE, kitchen({MUG: FRIDGE}), NONE),
        # What is on a plate is treated with it.
        ("CloseObject", FRIDGE, ON_A_PLATE, Treatments(cold=frozenset({PLATE, APPLE}))),
        ("MoveAhead", None, kitchen({MUG: FRIDGE}), NONE),
        ("CloseObject", "Fridge|nowhere", kitchen({MUG: FRIDGE}), NONE),
    ],
)
def test_an_action_treats(action, object_id, view, expected):
    assert NONE.after(action, object_id, view) == expected


def test_treatments_add_up():
    hot = NONE.after("ToggleObjectOn", MICROWAVE, kitchen({MUG: MICROWAVE}))
    both = hot.after("CloseObject", FRIDGE, kitchen({MUG: FRIDGE}))
    assert both == Treatments(hot=frozenset({MUG}), cold=frozenset({MUG}))
