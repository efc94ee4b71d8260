"""Pictures of what an agent did, from moments made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from infthor_eval.plans.recorded.replay_frames import (
    FloorPose,
    MapObject,
    PlanFrame,
    PlanObservation,
    PlanRewards,
    PlanTitle,
    RoomMap,
)
from infthor_eval.report.recordings.canvas import END_REPEATS, SIZE, TITLE_REPEATS
from infthor_eval.report.recordings.fonts import break_lines, fit_line, font, one_line
from infthor_eval.report.recordings.plan_pictures import (
    draw_plan_frame,
    draw_plan_title,
    plan_pictures,
)
from infthor_eval.report.recordings.room_map import draw_map

from .pictures import find_colours

FLOOR = tuple((x * 0.25, z * 0.25) for x in range(8) for z in range(8))
TABLE, MUG = (
    MapObject("SideTable", (2.0, 0.0), (2.6, 1.0)),
    MapObject("Mug", (2.2, 0.4), (2.3, 0.5), is_named=True),
)
ROOM = RoomMap(FLOOR, (TABLE, MUG), FloorPose((1.75, 0.5), 90))
FRAME = np.full((300, 300, 3), 90, np.uint8)
SIGHT = PlanObservation(FRAME, ROOM, FloorPose((0.5, 0.5), 90), ((0.25, 0.5), (0.5, 0.5)))
TITLE = PlanTitle(7, 24, "pick up the mug", "put a mug on the desk", 4, 1)
START = PlanFrame(title=TITLE, observation=SIGHT, rewards=PlanRewards(None, 0.0, 2.0, 3.0, 9.0))
END = replace(START, number=1, action="PickupObject Mug", ending="done", done=True)
GREEN, RED = (26, 127, 55), (193, 39, 45)
BADGE = (900, 808)  # a place of it that has no letters
LONG = "wherever it may be found, and then again " * 20


def words(picture):
    """What stands beneath frame and map, on the left."""
    return np.asarray(picture)[650:, :870]


def test_a_plan_has_its_title_its_start_and_its_end_held():
    pictures = list(plan_pictures([START, END, START], "a run"))
    assert len(pictures) == TITLE_REPEATS + 1 + END_REPEATS + TITLE_REPEATS + 1
    assert {(picture.size, picture.mode) for picture in pictures} == {(SIZE, "RGB")}
    assert all(side % 2 == 0 for side in SIZE)


def test_of_a_plan_that_was_never_begun_the_title_alone_is_shown():
    idle = PlanFrame(title=TITLE, observation=None, rewards=START.rewards, ending="not attempted")
    assert len(list(plan_pictures([idle], "a run"))) == TITLE_REPEATS
    assert RED in find_colours(draw_plan_title(idle, "a run"))
    assert RED not in find_colours(draw_plan_title(START, "a run"))
    with pytest.raises(ValueError, match="no observation"):
        draw_plan_frame(idle, "a run")


def test_the_ending_is_green_where_the_plan_is_done_and_red_where_it_is_not():
    ends = [END, replace(END, ending="step limit", done=False)]
    assert [draw_plan_frame(moment, "").getpixel(BADGE) for moment in ends] == [GREEN, RED]
    assert not {GREEN, RED} & find_colours(draw_plan_frame(START, ""))


def test_the_same_moments_are_the_same_pictures():
    one, other = (draw_plan_frame(END, "a run").tobytes() for _ in range(2))
    assert one == other


def test_reply_fault_and_difference_are_each_written():
    plain = draw_plan_frame(END, "")
    changes = {"reply": "take it", "wrong": "no Mug in sight", "note": "it earns 2"}
    for name, value in (changes | {"action": "RotateLeft"}).items():
        changed = draw_plan_frame(replace(END, **{name: value}), "")
        assert not np.array_equal(words(changed), words(plain))


def test_whatever_a_model_says_there_is_room_for_it():
    wild = f"{LONG}\n\x1b[31m\u202e\x00{'x' * 5000}"
    title = replace(TITLE, text=wild, goal=wild)
    moment = replace(END, title=title, action=wild, reply=wild, wrong=wild, note=wild, ending=wild)
    picture = np.asarray(draw_plan_frame(moment, wild))
    assert (picture[-4:] == 255).all()  # nothing runs out at the bottom
    assert (picture[660:, 858:876] == 255).all()  # nor into the rewards
    draw_plan_title(moment, wild)


def test_lines_are_broken_between_words_and_cut():
    face = font(16)
    lines = break_lines(LONG, face, 300, 2)
    assert len(lines) == 2
    assert all(face.getlength(line) <= 300 for line in lines)
    assert lines[1].endswith("…")
    assert break_lines("", face, 300, 2) == []
    assert break_lines("x" * 900, face, 300, 3)[0].endswith("…")
    assert fit_line("short", face, 300) == "short"
    assert one_line("a\n b\x1b") == "a b\\x1b"


def test_the_map_shows_where_the_agent_is_and_walked():
    size = 400
    there = np.asarray(draw_map(SIGHT, size))
    moved = np.asarray(draw_map(replace(SIGHT, agent=FloorPose((1.5, 0.5), 90)), size))
    still = np.asarray(draw_map(replace(SIGHT, walked=((0.5, 0.5),)), size))
    assert there.shape == (size, size, 3)
    assert all(not np.array_equal(there, other) for other in (moved, still))
    agent = (there == (0, 114, 178)).all(axis=2)[: size - 40]  # without the legend
    _, columns = np.nonzero(agent)
    assert columns.mean() < size / 2  # left of the middle, as x is


def test_goal_and_named_things_stand_out():
    size = 400
    plain = replace(SIGHT, room=RoomMap(FLOOR, (TABLE,)))
    goal, named = (0, 158, 115), (213, 94, 0)
    assert {goal, named} <= find_colours(draw_map(SIGHT, size))
    assert not {goal, named} & find_colours(draw_map(plain, size))


def test_a_room_without_a_cell_is_drawn():
    assert draw_map(replace(SIGHT, room=RoomMap((), ()), walked=()), 200).size == (200, 200)
