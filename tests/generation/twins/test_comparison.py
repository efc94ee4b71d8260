"""What makes two replays no twins, each with a pair of logs that shows it."""

import pytest
from msgspec.structs import replace

from infthor_eval.formats.step_log import LoggedPose, ObjectInFrame
from infthor_eval.formats.trajectory import ExpertPlan, InitAction, Scene, Trajectory
from infthor_eval.generation.twins.comparison import Difference, World, compare
from infthor_eval.generation.twins.kinds import Worlds

from ..questions.logs import history, moved, state

TABLE, DESK, BOX = "DiningTable|1|0|0", "Desk|1|0|0", "Box|1|0|0"
MUG, MOVED_MUG, BOOK = "Mug|1|0|0", "Mug|2|0|0", "Book|1|0|0"
TRAJECTORY = Trajectory(Scene("kitchen-1", InitAction(0.0, 0.9, 0.0)), ExpertPlan([]))
WORLDS = Worlds((TRAJECTORY, TRAJECTORY), frozenset({MUG}), frozenset({"Mug"}), {MUG: MOVED_MUG})
START = {key: state(key) for key in (TABLE, DESK, BOX)} | {BOOK: state(BOOK, TABLE)}


def world(start, *events, pictures="aab"):
    log = history(start, *events)
    return World(log.steps, list(pictures[: len(log.steps)]))


def first(*events, pictures="aab"):
    return world({**START, MUG: state(MUG, TABLE)}, *events, pictures=pictures)


def second(*events, pictures="axy", book=None):
    changed = {MOVED_MUG: state(MOVED_MUG, DESK)} | ({BOOK: book} if book else {})
    return world({**START, **changed}, *events, pictures=pictures)


def test_a_frame_in_which_the_changed_thing_is_in_view_may_differ():
    frames, displaced = compare(
        WORLDS, first(*moved(BOOK, TABLE, DESK)), second(*moved(BOOK, TABLE, DESK))
    )
    assert [frame.same for frame in frames] == [True, False, False]
    assert {frame.changed for frame in frames} == {(MUG,)}
    assert not displaced


def test_a_thing_in_the_hand_is_in_view():
    worlds = [first(), second()]
    for one, key in zip(worlds, (MUG, MOVED_MUG), strict=True):
        for step in one.steps:
            step.seen = {}
        one.steps[0].changes[key] = state(key, held=True)
    worlds[1].steps[0].changes[MOVED_MUG] = state(MOVED_MUG, held=True, is_dirty=True)
    (frame,), _ = compare(WORLDS, *worlds)
    assert frame.changed == (MUG,)


def test_a_third_thing_may_lie_a_little_beside_and_is_named():
    near = state(BOOK, TABLE, position=(0.2, 0.0, 0.0))
    assert compare(WORLDS, first(), second(book=near))[1] == {BOOK}


def blind(one):
    """A world in which nothing is in view."""
    for step in one.steps:
        step.seen = {}
    return one


def elsewhere(one):
    """A world in which the agent stands elsewhere."""
    steps = [replace(step, pose=LoggedPose(1.0, 0.9, 0.0, 0.0, 0.0)) for step in one.steps]
    return World(steps, one.pictures)


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        (second(*moved(BOOK, TABLE, DESK)), "another number of frames"),
        (elsewhere(second()), "the agent is elsewhere"),
        (second(book=state(BOOK, DESK)), "was not to be changed"),
        (second(book=state(BOOK, TABLE, position=(3.0, 0.0, 0.0))), "was not to be changed"),
        (second(book=state(BOOK, TABLE, is_open=True)), "was not to be changed"),
        (second(book=state(BOOK, TABLE, exists=False)), "was not to be changed"),
        (blind(second(pictures="x")), "nothing that differs is in view"),
    ],
    ids=["frames", "pose", "parent", "displaced", "open", "gone", "picture"],
)
def test_what_was_not_declared_is_rejected(other, reason):
    with pytest.raises(Difference, match=reason):
        compare(WORLDS, blind(first()) if "view" in reason else first(), other)


def test_a_changed_thing_in_view_of_one_world_alone_counts():
    one = blind(first())
    one.steps[0].seen = {MUG: ObjectInFrame(400, (100, 100, 120, 120), True)}
    (frame,), _ = compare(WORLDS, one, blind(second(pictures="x")))
    assert frame.changed == (MUG,)
