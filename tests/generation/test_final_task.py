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


def test_alone_is_what_no_other_frame_shows():
    early, late = end_types(log(*["AaDF"] * 2, *["BD"] * 6, *["CcFB"] * 2), alone=True)
    assert (early.pickupable, early.visible) == ({"A"}, {"C", "c"})
    assert (late.pickupable, late.visible) == ({"C"}, {"A", "a"})
    assert early.either == {"A", "a", "D", "F", "C", "c", "B"}


def test_what_was_seen_as_slices_was_seen():
    entries = [{"visible": [name], "pickupable": [name]} for name in ("Apple", "B", "B", "B", "B")]
    assert end_types(entries, alone=True)[0].pickupable == {"Apple"}
    entries[2] = {"visible": ["AppleSliced"], "pickupable": ["AppleSliced"]}
    assert end_types(entries, alone=True)[0].pickupable == set()


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


@pytest.mark.parametrize(
    ("pickup", "receptacle", "middle", "memory"),
    [("A", "C", "B", True), ("C", "a", "B", True), ("A", "C", "A", False), ("A", "C", "C", False)],
)
def test_a_memory_is_needed_of_what_is_seen_nowhere_else(pickup, receptacle, middle, memory):
    made = trajectory(pickup, receptacle)
    made.object_log[4] = log(middle)[0]
    assert violation(made) is None
    assert (violation(made, alone=True) is None) == memory


def test_without_a_final_task():
    nothing = Trajectory(Scene("kitchen-1", InitAction(0, 0, 0)), ExpertPlan([]))
    assert violation(nothing) == "there is no final task"
