"""Rewards of tasks whose goals come to hold, and the most that a plan gives."""

import pytest

from infthor_eval.household.navigation import GridPose
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.rewards import max_reward
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
    MUG,
    OTHER_TABLE,
    TABLE,
    kitchen,
)
from .rewarding import (
    CLEAN,
    COOL,
    DEFAULT,
    DONE,
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

# -- the task

PLACE = Task(TaskType.PLACE, "Mug", "SideTable")
IN_THE_FRIDGE = Task(TaskType.PLACE, "Mug", "Fridge")
EXAMINE = Task(TaskType.EXAMINE, "Mug", light="DeskLamp")
CLEAN_MUG = Task(TaskType.CLEAN, "Mug", "SinkBasin")
TOGGLE = PlanTarget(PlanKind.TOGGLE, LAMP)

TASKS = [
    ("done with the plan", PLACE, PUT, HOLDING,
     [("PutObject", OTHER_TABLE, kitchen({MUG: OTHER_TABLE}))],
     [(7.0, DONE)]),
    ("wrong place, right task", PLACE, PUT, HOLDING, [("PutObject", TABLE, kitchen())],
     [(5.0, GOES_ON)]),
    ("once", IN_THE_FRIDGE, STOW, HOLDING,
     [("OpenObject", FRIDGE, OPEN_FRIDGE), ("PutObject", FRIDGE, IN_FRIDGE),
      ("CloseObject", FRIDGE, STOWED)],
     [(2.0, GOES_ON), (7.0, GOES_ON), (2.0, DONE)]),
    ("held already", PLACE, TOGGLE, kitchen(), [("ToggleObjectOn", LAMP, kitchen(on=[LAMP]))],
     [(1.0, DONE)]),
    ("looked at", EXAMINE, TOGGLE, HOLDING,
     [("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP]))],
     [(6.0, DONE)]),
    ("looked at on the way", EXAMINE, PICKUP, kitchen(on=[LAMP]),
     [("PickupObject", MUG, kitchen(held=MUG, on=[LAMP]))],
     [(7.0, DONE)]),
    ("out of sight", EXAMINE, TOGGLE, HOLDING,
     [("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP], hidden=[LAMP]))], [(1.0, DONE)]),
    ("with an action of no use", EXAMINE, PICKUP, kitchen({MUG: DRAWER}, held=CUP),
     [("ToggleObjectOn", LAMP, kitchen(held=MUG, on=[LAMP]))], [(0.0, GOES_ON)]),
    ("washed", CLEAN_MUG, CLEAN, HOLDING,
     [("PutObject", BASIN, IN_SINK), ("ToggleObjectOn", FAUCET, WASHED)],
     [(0.0, GOES_ON), (7.0, DONE)]),
    ("washed, found there", CLEAN_MUG, CLEAN, IN_SINK, [("ToggleObjectOn", FAUCET, WASHED)],
     [(7.0, DONE)]),
]  # fmt: skip


@pytest.mark.parametrize(("task", "target", "start", "events", "expected"),
                         [row[1:] for row in TASKS],
                         ids=[row[0] for row in TASKS])  # fmt: skip
def test_the_task_is_paid_once_when_its_goal_comes_to_hold(task, target, start, events, expected):
    assert run(DEFAULT, target, start, events, task) == expected


def test_a_task_washed_for_in_an_earlier_plan():
    target, start = PlanTarget(PlanKind.PUT, MUG, TABLE), HOLDING
    task = Task(TaskType.CLEAN, "Mug", "SideTable")
    events = [("PutObject", TABLE, kitchen())]
    assert run(DEFAULT, target, start, events, task) == [(2.0, DONE)]
    washed = Treatments(clean=frozenset({MUG}))
    assert run(DEFAULT, target, start, events, task, treatments=washed) == [(7.0, DONE)]


# -- the most there is

MOST = [
    (PICKUP, kitchen(), None, 2.0),
    (PUT, HOLDING, None, 2.0),
    (PUT, HOLDING, PLACE, 7.0),
    (STOW, HOLDING, None, 6.0),
    (STOW, HOLDING, IN_THE_FRIDGE, 11.0),
    (STOW, OPEN_FRIDGE, None, 2.0),
    (ON_THE_LID, HOLDING, None, 2.0),
    (PlanTarget(PlanKind.OPEN, DRAWER), kitchen(), None, 2.0),
    (PlanTarget(PlanKind.CLOSE, DRAWER), kitchen(opened=[DRAWER]), None, 1.0),
    (TOGGLE, HOLDING, EXAMINE, 6.0),
    (PlanTarget(PlanKind.SLICE, APPLE), kitchen(), None, 1.0),
    (CLEAN, HOLDING, None, 2.0),
    (CLEAN, HOLDING, CLEAN_MUG, 7.0),
    (HEAT, HOLDING, None, 2.0),
    (COOL, HOLDING, None, 6.0),
    (
        PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 9), 0), goal_horizon=60.0),
        kitchen(),
        None,
        5.6,
    ),
    (
        PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 3), 0), goal_horizon=30.0),
        kitchen(),
        None,
        4.2,
    ),
    (
        PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 2), 0), goal_horizon=30.0),
        kitchen(),
        None,
        4.2,
    ),
    (
        PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 0), 0), goal_horizon=30.0),
        kitchen(),
        EXAMINE,
        9.0,
    ),
    (
        PlanTarget(PlanKind.GOTO, goal_stand=GridPose((7, 7), 0), goal_horizon=30.0),
        kitchen(),
        None,
        0.0,
    ),
]


@pytest.mark.parametrize(("target", "start", "completes", "most"), MOST)
def test_the_most_that_a_plan_gives(target, start, completes, most):
    assert max_reward(DEFAULT, target, start, CORRIDOR, completes) == pytest.approx(most)
