"""Rewards of handling things and of tasks, and their rules.

A step of a table is the action, its object, the world after it, and what it gives: nothing, and
the plan goes on, unless something else is said.
"""

import msgspec
import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.household.navigation import GridPose
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import PlanReward, StepReward, max_reward
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
    check,
)

OPEN, CLOSE = PlanTarget(PlanKind.OPEN, DRAWER), PlanTarget(PlanKind.CLOSE, DRAWER)
TOGGLE = PlanTarget(PlanKind.TOGGLE, LAMP)
SLICE, ANY_SLICE = PlanTarget(PlanKind.SLICE, APPLE), PlanTarget(PlanKind.PICKUP, SLICE_1)

PICKUPS = [
    ("asked", PICKUP, kitchen(), [("PickupObject", MUG, HOLDING, 2.0, DONE)]),
    ("another", PICKUP, kitchen(), [("PickupObject", CUP, kitchen(held=CUP))]),
    ("out of a drawer", PICKUP, kitchen({MUG: DRAWER}), [
        ("OpenObject", DRAWER, kitchen({MUG: DRAWER}, opened=[DRAWER])),
        ("PickupObject", MUG, kitchen(held=MUG, opened=[DRAWER]), 2.0, DONE),
    ]),
    ("any slice", ANY_SLICE, kitchen(), [
        ("PickupObject", SLICE_2, kitchen(held=SLICE_2), 2.0, DONE),
    ]),
    ("the whole, which has the slice's name", ANY_SLICE, kitchen(), [
        ("PickupObject", APPLE, kitchen(held=APPLE), 2.0, DONE),
    ]),
    ("no use, then refused", PICKUP, kitchen(), [
        ("MoveAhead", None, kitchen(at=(0, 1))),
        ("PickupObject", MUG, kitchen(refused=True), 0.0, FAILED),
    ]),
    ("refused and of no use", PICKUP, kitchen(), [
        ("MoveAhead", None, kitchen(refused=True), 0.0, FAILED),
    ]),
]  # fmt: skip

OTHERS = [
    ("open", OPEN, kitchen(), [
        ("OpenObject", FRIDGE, kitchen(opened=[FRIDGE])),
        ("CloseObject", FRIDGE, kitchen()),
        ("OpenObject", DRAWER, kitchen(opened=[DRAWER]), 2.0, DONE),
    ]),
    ("close", CLOSE, kitchen(opened=[DRAWER, FRIDGE]), [
        ("CloseObject", FRIDGE, kitchen(opened=[DRAWER])),
        ("CloseObject", DRAWER, kitchen(), 1.0, DONE),
    ]),
    ("switch on", TOGGLE, kitchen(), [
        ("PickupObject", MUG, kitchen(held=MUG)),
        ("ToggleObjectOn", FAUCET, kitchen(held=MUG, on=[FAUCET])),
        ("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[FAUCET, LAMP]), 1.0, DONE),
    ]),
    ("switch off", TOGGLE, kitchen(on=[LAMP]), [("ToggleObjectOff", LAMP, kitchen(), 1.0, DONE)]),
    ("slice", SLICE, kitchen(), [
        ("SliceObject", PLATE, kitchen()),
        ("SliceObject", APPLE, kitchen(without=[APPLE]), 1.0, DONE),
    ]),
    ("slice refused", SLICE, kitchen(), [
        ("SliceObject", APPLE, kitchen(refused=True), 0.0, FAILED),
    ]),
]  # fmt: skip


PUTS = [
    ("put", PUT, HOLDING, [("PutObject", OTHER_TABLE, kitchen({MUG: OTHER_TABLE}), 2.0, DONE)]),
    ("wrong place", PUT, HOLDING, [("PutObject", TABLE, kitchen())]),
    ("in a plate there", PUT, kitchen({PLATE: OTHER_TABLE}, held=MUG), [
        ("PutObject", PLATE, kitchen({MUG: PLATE, PLATE: OTHER_TABLE})),
    ]),
    ("stow", STOW, HOLDING, [
        ("OpenObject", FRIDGE, OPEN_FRIDGE, 2.0),
        ("CloseObject", FRIDGE, HOLDING),
        ("OpenObject", FRIDGE, OPEN_FRIDGE),
        ("PutObject", FRIDGE, IN_FRIDGE, 2.0),
        ("CloseObject", FRIDGE, STOWED, 2.0, DONE),
    ]),
    ("stow elsewhere", STOW, HOLDING, [
        ("OpenObject", DRAWER, kitchen(held=MUG, opened=[DRAWER])),
        ("PutObject", DRAWER, kitchen({MUG: DRAWER}, opened=[DRAWER])),
    ]),
    ("open already", STOW, OPEN_FRIDGE, [("PutObject", FRIDGE, IN_FRIDGE, 2.0, DONE)]),
    ("onto a closed lid", ON_THE_LID, HOLDING, [
        ("PutObject", TOILET, kitchen({MUG: TOILET}), 2.0, DONE),
    ]),
    ("taken out again", STOW, HOLDING, [
        ("OpenObject", FRIDGE, OPEN_FRIDGE, 2.0),
        ("PutObject", FRIDGE, IN_FRIDGE, 2.0),
        ("PickupObject", MUG, OPEN_FRIDGE),
        ("CloseObject", FRIDGE, HOLDING),
        ("OpenObject", FRIDGE, OPEN_FRIDGE),
        ("PutObject", FRIDGE, IN_FRIDGE),
        ("CloseObject", FRIDGE, STOWED, 2.0, DONE),
    ]),
]  # fmt: skip
OPENS_AGAIN = ("OpenObject", FRIDGE, IN_FRIDGE)
COOLING = [
    ("OpenObject", FRIDGE, OPEN_FRIDGE),
    ("PutObject", FRIDGE, IN_FRIDGE),
    ("CloseObject", FRIDGE, STOWED, 2.0),
    (*OPENS_AGAIN, 2.0),
]
TREATED = [
    ("clean", CLEAN, HOLDING, [
        ("PutObject", BASIN, IN_SINK),
        ("ToggleObjectOn", FAUCET, WASHED, 2.0, DONE),
    ]),
    ("clean without the mug", CLEAN, HOLDING, [
        ("ToggleObjectOn", FAUCET, kitchen(held=MUG, on=[FAUCET])),
        ("ToggleObjectOff", FAUCET, HOLDING),
        ("OpenObject", FRIDGE, OPEN_FRIDGE),
    ]),
    ("clean what is in the sink already", CLEAN, IN_SINK, [
        ("ToggleObjectOn", FAUCET, WASHED, 2.0, DONE),
    ]),
    ("clean, with the sink recorded as the object", PlanTarget(PlanKind.CLEAN, BASIN), HOLDING, [
        ("PutObject", BASIN, IN_SINK),
        ("ToggleObjectOn", FAUCET, WASHED, 2.0, DONE),
    ]),
    ("heat", HEAT, HOLDING, [
        ("OpenObject", MICROWAVE, kitchen(held=MUG, opened=[MICROWAVE])),
        ("PutObject", MICROWAVE, kitchen({MUG: MICROWAVE}, opened=[MICROWAVE])),
        ("CloseObject", MICROWAVE, kitchen({MUG: MICROWAVE})),
        ("ToggleObjectOn", MICROWAVE, kitchen({MUG: MICROWAVE}, on=[MICROWAVE]), 2.0, DONE),
    ]),
    ("cool", COOL, HOLDING, [*COOLING, ("PickupObject", MUG, OPEN_FRIDGE, 2.0, DONE)]),
    ("cool twice", COOL, HOLDING, [
        *COOLING,
        ("CloseObject", FRIDGE, STOWED),
        OPENS_AGAIN,
        ("PickupObject", CUP, kitchen(held=CUP)),
    ]),
    ("cool what stands in the fridge", PlanTarget(PlanKind.COOL, MUG), IN_FRIDGE, [
        ("CloseObject", FRIDGE, STOWED, 2.0),
        ("OpenObject", DRAWER, kitchen({MUG: FRIDGE}, opened=[DRAWER])),
        ("OpenObject", FRIDGE, IN_FRIDGE, 2.0),
    ]),
]  # fmt: skip


ALL = PICKUPS + OTHERS + PUTS + TREATED


@pytest.mark.parametrize(
    ("target", "start", "steps"), [row[1:] for row in ALL], ids=[row[0] for row in ALL]
)
def test_what_each_action_gives(target, start, steps):
    check(target, start, steps)


def test_what_was_washed_before_is_washed_again():
    before = Treatments(clean=frozenset({MUG}))
    steps = [("PutObject", BASIN, IN_SINK), ("ToggleObjectOn", FAUCET, WASHED, 2.0, DONE)]
    check(CLEAN, HOLDING, steps, treatments=before)


def test_treatments_are_followed():
    plan = PlanReward(DEFAULT, CLEAN, ELSEWHERE, IN_SINK, Treatments(hot=frozenset({CUP})))
    plan.after({"action": "ToggleObjectOn", "objectId": FAUCET}, IN_SINK, WASHED)
    assert plan.treatments == Treatments(clean=frozenset({MUG}), hot=frozenset({CUP}))


# -- the task

PLACE = Task(TaskType.PLACE, "Mug", "SideTable")
IN_THE_FRIDGE = Task(TaskType.PLACE, "Mug", "Fridge")
EXAMINE = Task(TaskType.EXAMINE, "Mug", light="DeskLamp")
CLEAN_MUG = Task(TaskType.CLEAN, "Mug", "SinkBasin")

TASKS = [
    ("done with the plan", PLACE, PUT, HOLDING, [
        ("PutObject", OTHER_TABLE, kitchen({MUG: OTHER_TABLE}), 7.0, DONE),
    ]),
    ("wrong place, right task", PLACE, PUT, HOLDING, [("PutObject", TABLE, kitchen(), 5.0)]),
    ("once", IN_THE_FRIDGE, STOW, HOLDING, [
        ("OpenObject", FRIDGE, OPEN_FRIDGE, 2.0),
        ("PutObject", FRIDGE, IN_FRIDGE, 7.0),
        ("CloseObject", FRIDGE, STOWED, 2.0, DONE),
    ]),
    ("held already", PLACE, TOGGLE, kitchen(), [
        ("ToggleObjectOn", LAMP, kitchen(on=[LAMP]), 1.0, DONE),
    ]),
    ("looked at", EXAMINE, TOGGLE, HOLDING, [
        ("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP]), 6.0, DONE),
    ]),
    ("looked at on the way", EXAMINE, PICKUP, kitchen(on=[LAMP]), [
        ("PickupObject", MUG, kitchen(held=MUG, on=[LAMP]), 7.0, DONE),
    ]),
    ("out of sight", EXAMINE, TOGGLE, HOLDING, [
        ("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP], hidden=[LAMP]), 1.0, DONE),
    ]),
    ("with an action of no use", EXAMINE, PICKUP, kitchen({MUG: DRAWER}, held=CUP), [
        ("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP])),
    ]),
    ("washed", CLEAN_MUG, CLEAN, HOLDING, [
        ("PutObject", BASIN, IN_SINK),
        ("ToggleObjectOn", FAUCET, WASHED, 7.0, DONE),
    ]),
    ("washed, found there", CLEAN_MUG, CLEAN, IN_SINK, [
        ("ToggleObjectOn", FAUCET, WASHED, 7.0, DONE),
    ]),
]  # fmt: skip


@pytest.mark.parametrize(
    ("task", "target", "start", "steps"), [row[1:] for row in TASKS], ids=[row[0] for row in TASKS]
)
def test_the_task_is_paid_once_when_its_goal_comes_to_hold(task, target, start, steps):
    check(target, start, steps, task)


def test_a_task_washed_for_in_an_earlier_plan():
    target, task = PlanTarget(PlanKind.PUT, MUG, TABLE), Task(TaskType.CLEAN, "Mug", "SideTable")
    check(target, HOLDING, [("PutObject", TABLE, kitchen(), 2.0, DONE)], task)
    washed = Treatments(clean=frozenset({MUG}))
    check(target, HOLDING, [("PutObject", TABLE, kitchen(), 7.0, DONE)], task, treatments=washed)


# -- the most there is


def way_to(cell, horizon=30.0):
    return PlanTarget(PlanKind.GOTO, goal_stand=GridPose(cell, 0), goal_horizon=horizon)


MOST = [
    (PICKUP, kitchen(), None, 2.0),
    (PUT, HOLDING, None, 2.0),
    (PUT, HOLDING, PLACE, 7.0),
    (STOW, HOLDING, None, 6.0),
    (STOW, HOLDING, IN_THE_FRIDGE, 11.0),
    (STOW, OPEN_FRIDGE, None, 2.0),
    (ON_THE_LID, HOLDING, None, 2.0),
    (OPEN, kitchen(), None, 2.0),
    (CLOSE, kitchen(opened=[DRAWER]), None, 1.0),
    (TOGGLE, HOLDING, EXAMINE, 6.0),
    (SLICE, kitchen(), None, 1.0),
    (CLEAN, HOLDING, None, 2.0),
    (CLEAN, HOLDING, CLEAN_MUG, 7.0),
    (HEAT, HOLDING, None, 2.0),
    (COOL, HOLDING, None, 6.0),
    (way_to((0, 9), 60.0), kitchen(), None, 5.6),
    (way_to((0, 3)), kitchen(), None, 4.2),
    (way_to((0, 2)), kitchen(), None, 4.2),
    (way_to((0, 0)), kitchen(), EXAMINE, 9.0),
    (way_to((7, 7)), kitchen(), None, 0.0),
]


@pytest.mark.parametrize(("target", "start", "completes", "most"), MOST)
def test_the_most_that_a_plan_gives(target, start, completes, most):
    assert max_reward(DEFAULT, target, start, CORRIDOR, completes) == pytest.approx(most)


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
