"""Rewards of plans on events written by hand: each table has the action, the world after it, and
what it gives."""

import msgspec
import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.household.navigation import GridPose
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import PlanReward, StepReward, count_actions_to_goal, max_reward
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

DEFAULT = reward_rules("default")
ELSEWHERE = Task(TaskType.PLACE, "Mug", "Desk")  # there is no desk: never done
GOES_ON, DONE, FAILED = "goes on", "done", "failed"


def run(rules, target, start, events, task=ELSEWHERE, grid=None, treatments=None):
    """What each event gives: (reward, how it leaves the plan)."""
    plan = PlanReward(rules, target, task, start, treatments or Treatments(), grid)
    before, rewards = start, []
    for action, object_id, after in events:
        step = plan.after({"action": action, "objectId": object_id}, before, after)
        assert not (step.done and step.failed)
        rewards.append((step.reward, DONE if step.done else FAILED if step.failed else GOES_ON))
        before = after
    return rewards


def walk(rules, poses, actions, goal=(0, 9), start=(0, 0), horizon=30.0, goal_horizon=30.0):
    """Rewards of walking through the corridor, at cells along it."""
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose(goal, 0), goal_horizon=goal_horizon)
    events = [(action, None, kitchen(at=(0, z))) for action, z in zip(actions, poses, strict=True)]
    return run(rules, target, kitchen(at=start, horizon=horizon), events, grid=CORRIDOR)


# -- going somewhere

AHEAD = "MoveAhead"


def test_goto_pays_steps_and_arrival():
    rewards = walk(DEFAULT, [1, 2, 3, 4, 5, 6, 7], [AHEAD] * 7)
    # Six to go, then 5, 4 and exactly 3 left: not there yet. At two left it is done.
    assert rewards == [(pytest.approx(0.2), GOES_ON)] * 6 + [(pytest.approx(4.2), DONE)]


def test_a_way_of_exactly_three_is_not_there():
    assert walk(DEFAULT, [6], [AHEAD], start=(0, 5)) == [(pytest.approx(0.2), GOES_ON)]
    assert walk(DEFAULT, [7], [AHEAD], start=(0, 6)) == [(pytest.approx(4.2), DONE)]


def test_to_and_fro_is_paid_once():
    actions = [AHEAD, "Teleport", AHEAD, AHEAD]
    assert walk(DEFAULT, [1, 0, 1, 2], actions) == [
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(0.2), GOES_ON),
    ]


def test_looks_and_turns_are_steps():
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 2), 90), goal_horizon=60.0)
    start = kitchen(at=(0, 0), horizon=-30.0)  # two ahead, one turn, three looks: six left
    events = [
        ("LookDown", None, kitchen(at=(0, 0), horizon=0.0)),
        ("RotateLeft", None, kitchen(at=(0, 0), facing=270, horizon=0.0)),  # worse
        ("RotateRight", None, kitchen(at=(0, 0), horizon=0.0)),
        ("MoveAhead", None, kitchen(at=(0, 1), horizon=0.0)),
        ("LookDown", None, kitchen(at=(0, 1), horizon=30.0)),
        # One ahead is lost behind turns.
        ("RotateRight", None, kitchen(at=(0, 1), facing=90, horizon=30.0)),
        ("LookDown", None, kitchen(at=(0, 1), facing=0, horizon=60.0)),
    ]
    assert run(DEFAULT, target, start, events, grid=CORRIDOR) == [
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(0.0), GOES_ON),
        (pytest.approx(0.2), GOES_ON),
        (pytest.approx(0.2), GOES_ON),
        (0.0, GOES_ON),
        (pytest.approx(4.2), DONE),
    ]


def test_half_a_look_counts_whole():
    target = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 2), 0), goal_horizon=45.0)
    events = [("MoveAhead", None, kitchen(at=(0, 1), horizon=30.0))]  # one ahead and half a look
    assert run(DEFAULT, target, kitchen(), events, grid=CORRIDOR) == [(pytest.approx(4.2), DONE)]
    assert max_reward(DEFAULT, target, kitchen(horizon=30.0), CORRIDOR) == pytest.approx(4.2)


def test_who_starts_there_must_still_act():
    assert walk(DEFAULT, [9], ["NoOp"], start=(0, 9)) == [(0.0, GOES_ON)]
    assert walk(DEFAULT, [8], [AHEAD], start=(0, 7)) == [(pytest.approx(4.2), DONE)]


def test_no_way_there_pays_nothing():
    assert walk(DEFAULT, [1], [AHEAD], goal=(7, 7)) == [(0.0, GOES_ON)]


# -- handling things

PICKUP = PlanTarget(PlanKind.PICKUP, MUG)
PUT = PlanTarget(PlanKind.PUT, MUG, OTHER_TABLE)
ON_THE_LID = PlanTarget(PlanKind.PUT, MUG, TOILET)
STOW = PlanTarget(PlanKind.PUT, MUG, FRIDGE)
HOLDING = kitchen(held=MUG)
OPEN_FRIDGE = kitchen(held=MUG, opened=[FRIDGE])
IN_FRIDGE = kitchen({MUG: FRIDGE}, opened=[FRIDGE])
STOWED = kitchen({MUG: FRIDGE})

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

CLEAN = PlanTarget(PlanKind.CLEAN, MUG, BASIN)
HEAT = PlanTarget(PlanKind.HEAT, MUG, MICROWAVE)
COOL = PlanTarget(PlanKind.COOL, MUG, FRIDGE)
IN_SINK = kitchen({MUG: BASIN})
WASHED = kitchen({MUG: BASIN}, on=[FAUCET])
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


def test_a_way_is_over_before_its_end_and_other_plans_go_on():
    poses = [kitchen(at=(0, z)).agent for z in range(1, 8)]
    ahead = PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 7), 0), goal_horizon=30.0)
    assert count_actions_to_goal(DEFAULT, ahead, poses, CORRIDOR) == 5  # two steps are left
    assert count_actions_to_goal(DEFAULT, ahead, poses[:4], CORRIDOR) == 4
    assert count_actions_to_goal(DEFAULT, PICKUP, poses) == len(poses)


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


def test_a_way_needs_the_grid():
    with pytest.raises(ValueError, match="needs the grid"):
        PlanReward(
            DEFAULT, PlanTarget(PlanKind.GOTO, goal_stand=GridPose((0, 9), 0)), ELSEWHERE, kitchen()
        )


def test_after_the_end():
    plan = PlanReward(DEFAULT, PICKUP, ELSEWHERE, kitchen())
    assert plan.after(
        {"action": "PickupObject", "objectId": MUG}, kitchen(), HOLDING
    ) == StepReward(2.0, done=True)
    with pytest.raises(ValueError, match="over"):
        plan.after({"action": "MoveAhead"}, HOLDING, HOLDING)
