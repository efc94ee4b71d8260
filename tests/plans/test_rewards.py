"""Rewards of handling things, and their rules. Each table has the action, the world after it, and
what it gives."""

import msgspec
import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import PlanReward, StepReward
from infthor_eval.plans.targets import PlanTarget

from .building import (
    APPLE,
    BASIN,
    CORRIDOR,
    CUP,
    DRAWER,
    FAUCET,
    FRIDGE,
    LAMP,
    MICROWAVE,
    MUG,
    OTHER_TABLE,
    PLATE,
    SLICE_1,
    SLICE_2,
    TABLE,
    TOILET,
    kitchen,
)
from .rewarding import (
    CLEAN,
    COOL,
    DEFAULT,
    DONE,
    ELSEWHERE,
    FAILED,
    GOES_ON,
    HEAT,
    HOLDING,
    IN_FRIDGE,
    IN_SINK,
    ON_THE_LID,
    OPEN_FRIDGE,
    PICKUP,
    PUT,
    STOW,
    STOWED,
    WASHED,
    run,
)

PICKUPS = [
    ("asked", PICKUP, kitchen(), [("PickupObject", MUG, HOLDING)], [(2.0, DONE)]),
    ("another", PICKUP, kitchen(), [("PickupObject", CUP, kitchen(held=CUP))], [(0.0, GOES_ON)]),
    (
        "out of a drawer",
        PICKUP,
        kitchen({MUG: DRAWER}),
        [
            ("OpenObject", DRAWER, kitchen({MUG: DRAWER}, opened=[DRAWER])),
            ("PickupObject", MUG, kitchen(held=MUG, opened=[DRAWER])),
        ],
        [(0.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "any slice",
        PlanTarget(PlanKind.PICKUP, SLICE_1),
        kitchen(),
        [("PickupObject", SLICE_2, kitchen(held=SLICE_2))],
        [(2.0, DONE)],
    ),
    (
        "the whole, which has the slice's name",
        PlanTarget(PlanKind.PICKUP, SLICE_1),
        kitchen(),
        [("PickupObject", APPLE, kitchen(held=APPLE))],
        [(2.0, DONE)],
    ),
    (
        "no use, then refused",
        PICKUP,
        kitchen(),
        [("MoveAhead", None, kitchen(at=(0, 1))), ("PickupObject", MUG, kitchen(refused=True))],
        [(0.0, GOES_ON), (0.0, FAILED)],
    ),
    (
        "refused and of no use",
        PICKUP,
        kitchen(),
        [("MoveAhead", None, kitchen(refused=True))],
        [(0.0, FAILED)],
    ),
]

OTHERS = [
    (
        "open",
        PlanTarget(PlanKind.OPEN, DRAWER),
        kitchen(),
        [
            ("OpenObject", FRIDGE, kitchen(opened=[FRIDGE])),
            ("CloseObject", FRIDGE, kitchen()),
            ("OpenObject", DRAWER, kitchen(opened=[DRAWER])),
        ],
        [(0.0, GOES_ON), (0.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "close",
        PlanTarget(PlanKind.CLOSE, DRAWER),
        kitchen(opened=[DRAWER, FRIDGE]),
        [("CloseObject", FRIDGE, kitchen(opened=[DRAWER])), ("CloseObject", DRAWER, kitchen())],
        [(0.0, GOES_ON), (1.0, DONE)],
    ),
    (
        "switch on",
        PlanTarget(PlanKind.TOGGLE, LAMP),
        kitchen(),
        [
            ("PickupObject", MUG, kitchen(held=MUG)),
            ("ToggleObjectOn", FAUCET, kitchen(held=MUG, on=[FAUCET])),
            ("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[FAUCET, LAMP])),
        ],
        [(0.0, GOES_ON), (0.0, GOES_ON), (1.0, DONE)],
    ),
    (
        "switch off",
        PlanTarget(PlanKind.TOGGLE, LAMP),
        kitchen(on=[LAMP]),
        [("ToggleObjectOff", LAMP, kitchen())],
        [(1.0, DONE)],
    ),
    (
        "slice",
        PlanTarget(PlanKind.SLICE, APPLE),
        kitchen(),
        [("SliceObject", PLATE, kitchen()), ("SliceObject", APPLE, kitchen(without=[APPLE]))],
        [(0.0, GOES_ON), (1.0, DONE)],
    ),
    ("slice refused", PlanTarget(PlanKind.SLICE, APPLE), kitchen(),
     [("SliceObject", APPLE, kitchen(refused=True))],
     [(0.0, FAILED)]),
]  # fmt: skip


PUTS = [
    ("put", PUT, HOLDING, [("PutObject", OTHER_TABLE, kitchen({MUG: OTHER_TABLE}))], [(2.0, DONE)]),
    ("wrong place", PUT, HOLDING, [("PutObject", TABLE, kitchen())], [(0.0, GOES_ON)]),
    (
        "in a plate there",
        PUT,
        kitchen({PLATE: OTHER_TABLE}, held=MUG),
        [("PutObject", PLATE, kitchen({MUG: PLATE, PLATE: OTHER_TABLE}))],
        [(0.0, GOES_ON)],
    ),
    (
        "stow",
        STOW,
        HOLDING,
        [
            ("OpenObject", FRIDGE, OPEN_FRIDGE),
            ("CloseObject", FRIDGE, HOLDING),
            ("OpenObject", FRIDGE, OPEN_FRIDGE),
            ("PutObject", FRIDGE, IN_FRIDGE),
            ("CloseObject", FRIDGE, STOWED),
        ],
        [(2.0, GOES_ON), (0.0, GOES_ON), (0.0, GOES_ON), (2.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "stow elsewhere",
        STOW,
        HOLDING,
        [
            ("OpenObject", DRAWER, kitchen(held=MUG, opened=[DRAWER])),
            ("PutObject", DRAWER, kitchen({MUG: DRAWER}, opened=[DRAWER])),
        ],
        [(0.0, GOES_ON), (0.0, GOES_ON)],
    ),
    ("open already", STOW, OPEN_FRIDGE, [("PutObject", FRIDGE, IN_FRIDGE)], [(2.0, DONE)]),
    (
        "onto a closed lid",
        ON_THE_LID,
        HOLDING,
        [("PutObject", TOILET, kitchen({MUG: TOILET}))],
        [(2.0, DONE)],
    ),
    (
        "taken out again",
        STOW,
        HOLDING,
        [
            ("OpenObject", FRIDGE, OPEN_FRIDGE),
            ("PutObject", FRIDGE, IN_FRIDGE),
            ("PickupObject", MUG, OPEN_FRIDGE),
            ("CloseObject", FRIDGE, HOLDING),
            ("OpenObject", FRIDGE, OPEN_FRIDGE),
            ("PutObject", FRIDGE, IN_FRIDGE),
            ("CloseObject", FRIDGE, STOWED),
        ],
        [(2.0, GOES_ON), (2.0, GOES_ON), *[(0.0, GOES_ON)] * 4, (2.0, DONE)],
    ),
]
IN_OVEN = kitchen({MUG: MICROWAVE})
COOLING = [
    ("OpenObject", FRIDGE, OPEN_FRIDGE),
    ("PutObject", FRIDGE, IN_FRIDGE),
    ("CloseObject", FRIDGE, STOWED),
    ("OpenObject", FRIDGE, IN_FRIDGE),
]
TREATED = [
    (
        "clean",
        CLEAN,
        HOLDING,
        [("PutObject", BASIN, IN_SINK), ("ToggleObjectOn", FAUCET, WASHED)],
        [(0.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "clean without the mug",
        CLEAN,
        HOLDING,
        [
            ("ToggleObjectOn", FAUCET, kitchen(held=MUG, on=[FAUCET])),
            ("ToggleObjectOff", FAUCET, HOLDING),
            ("OpenObject", FRIDGE, OPEN_FRIDGE),
        ],
        [(0.0, GOES_ON)] * 3,
    ),
    (
        "clean what is in the sink already",
        CLEAN,
        IN_SINK,
        [("ToggleObjectOn", FAUCET, WASHED)],
        [(2.0, DONE)],
    ),
    (
        "clean, with the sink recorded as the object",
        PlanTarget(PlanKind.CLEAN, BASIN),
        HOLDING,
        [("PutObject", BASIN, IN_SINK), ("ToggleObjectOn", FAUCET, WASHED)],
        [(0.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "heat",
        HEAT,
        HOLDING,
        [
            ("OpenObject", MICROWAVE, kitchen(held=MUG, opened=[MICROWAVE])),
            ("PutObject", MICROWAVE, kitchen({MUG: MICROWAVE}, opened=[MICROWAVE])),
            ("CloseObject", MICROWAVE, IN_OVEN),
            ("ToggleObjectOn", MICROWAVE, kitchen({MUG: MICROWAVE}, on=[MICROWAVE])),
        ],
        [(0.0, GOES_ON)] * 3 + [(2.0, DONE)],
    ),
    (
        "cool",
        COOL,
        HOLDING,
        [*COOLING, ("PickupObject", MUG, OPEN_FRIDGE)],
        [(0.0, GOES_ON), (0.0, GOES_ON), (2.0, GOES_ON), (2.0, GOES_ON), (2.0, DONE)],
    ),
    (
        "cool twice",
        COOL,
        HOLDING,
        [*COOLING, ("CloseObject", FRIDGE, STOWED), COOLING[-1],
         ("PickupObject", CUP, kitchen(held=CUP))],
        [(0.0, GOES_ON), (0.0, GOES_ON), (2.0, GOES_ON), (2.0, GOES_ON), *[(0.0, GOES_ON)] * 3],
    ),
    (
        "cool what stands in the fridge",
        PlanTarget(PlanKind.COOL, MUG),
        IN_FRIDGE,
        [
            ("CloseObject", FRIDGE, STOWED),
            ("OpenObject", DRAWER, kitchen({MUG: FRIDGE}, opened=[DRAWER])),
            ("OpenObject", FRIDGE, IN_FRIDGE),
        ],
        [(2.0, GOES_ON), (0.0, GOES_ON), (2.0, GOES_ON)],
    ),
]  # fmt: skip


ALL = PICKUPS + OTHERS + PUTS + TREATED


@pytest.mark.parametrize(
    ("target", "start", "events", "expected"), [row[1:] for row in ALL], ids=[row[0] for row in ALL]
)
def test_what_each_action_gives(target, start, events, expected):
    assert run(DEFAULT, target, start, events) == expected


def test_what_was_washed_before_is_washed_again():
    before = Treatments(clean=frozenset({MUG}))
    events = [("PutObject", BASIN, IN_SINK), ("ToggleObjectOn", FAUCET, WASHED)]
    assert run(DEFAULT, CLEAN, HOLDING, events, treatments=before) == [(0.0, GOES_ON), (2.0, DONE)]


def test_treatments_are_followed():
    plan = PlanReward(DEFAULT, CLEAN, ELSEWHERE, IN_SINK, Treatments(hot=frozenset({CUP})))
    plan.after({"action": "ToggleObjectOn", "objectId": FAUCET}, IN_SINK, WASHED)
    assert plan.treatments == Treatments(clean=frozenset({MUG}), hot=frozenset({CUP}))


# -- the rules, and what does not fit

PUBLISHED = {
    "GotoLocation": 4.0, "PickupObject": 2.0, "PutObject": 2.0, "OpenObject": 2.0,
    "CloseObject": 1.0,
    "ToggleObject": 1.0, "SliceObject": 1.0, "CleanObject": 2.0, "HeatObject": 2.0,
    "CoolObject": 2.0,
}  # fmt: skip


def test_the_rule_sets_differ_in_who_scores_and_grounds_alone():
    published = reward_rules("published")
    assert DEFAULT.rewards == PUBLISHED
    assert DEFAULT.valid_actions.keys() == set(PlanKind)
    changed = {"scoring": "default", "grounding": "strict", "force_action": False}
    assert msgspec.structs.replace(published, **changed) == DEFAULT


def test_unknown_rules():
    with pytest.raises(
        UsageError, match=r"unknown reward rules 'defualt'; did you mean 'default'\?"
    ):
        reward_rules("defualt")


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (PlanTarget(PlanKind.GOTO), "this GotoLocation plan has no pose to reach"),
        (PlanTarget(PlanKind.PICKUP), "this PickupObject plan has no object"),
        (
            PlanTarget(PlanKind.OPEN, "Safe|0|0|0"),
            r"this OpenObject plan is about Safe\|0\|0\|0, which",
        ),
        (PlanTarget(PlanKind.PUT, MUG), "the PutObject plan's receptacle is None"),
        (PlanTarget(PlanKind.COOL, FRIDGE), "this CoolObject plan has no object"),
    ],
)
def test_plans_that_nobody_can_carry_out(target, words):
    with pytest.raises(DataError, match=words):
        PlanReward(DEFAULT, target, ELSEWHERE, kitchen(), Treatments(), CORRIDOR)


def test_after_the_end():
    plan = PlanReward(DEFAULT, PICKUP, ELSEWHERE, kitchen())
    assert plan.after(
        {"action": "PickupObject", "objectId": MUG}, kitchen(), HOLDING
    ) == StepReward(2.0, done=True)
    with pytest.raises(ValueError, match="over"):
        plan.after({"action": "MoveAhead"}, HOLDING, HOLDING)
