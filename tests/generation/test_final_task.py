import pytest

from infthor_eval.formats.trajectory import (
    ExpertPlan,
    InitAction,
    Scene,
    SubTask,
    SubTrajectory,
    TaskInfo,
    Trajectory,
)
from infthor_eval.generation.final_task import end_types, violation


def log(*types):
    """Entries in which upper-case types can be picked up and all are visible."""
    return [
        {"visible": list(visible), "pickupable": [name for name in visible if name.isupper()]}
        for visible in types
    ]


def test_the_ends_are_a_fifth_each():
    early, late = end_types(log(*["Aa"] * 2, *"BBBBBB", *["Cc"] * 2))
    assert (early.pickupable, early.visible) == ({"A"}, {"C", "c"})
    assert (late.pickupable, late.visible) == ({"C"}, {"A", "a"})


def trajectory(pickup, receptacle, movable=None, before=10):
    task = SubTask(TaskInfo("pick_and_place_simple", pickup, movable, receptacle), "put it there")
    return Trajectory(
        Scene("kitchen-1", InitAction(0, 0, 0)),
        ExpertPlan([]),
        sub_trajs=[
            SubTrajectory(0, (0, 1), (0, before)),
            SubTrajectory(1, (1, 2), (before, before + 3)),
        ],
        long_horizon_task=task,
        object_log=log("Aa", "Aa", *"BBBBBBB", "Cc", "Cc", *"XXX"),
    )


@pytest.mark.parametrize(
    ("pickup", "receptacle", "movable", "fine"),
    [
        ("A", "C", None, True),
        ("A", "c", None, True),
        ("C", "a", None, True),
        ("c", "A", None, False),
        ("C", "A", None, True),
        ("A", "C", "A", True),
        ("A", "A", None, False),
        ("A", "B", None, False),
        ("A", "C", "B", False),
        ("X", "A", None, False),
    ],
)
def test_the_rule_is_derived_from_the_log(pickup, receptacle, movable, fine):
    assert (violation(trajectory(pickup, receptacle, movable)) is None) == fine


def test_without_a_final_task():
    assert (
        violation(Trajectory(Scene("kitchen-1", InitAction(0, 0, 0)), ExpertPlan([])))
        == "there is no final task"
    )
