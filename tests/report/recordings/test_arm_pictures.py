"""Pictures of arms: moments and sheets, from numbers made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from infthor_eval.manipulation.recorded.replay_frames import (
    ArmFrame,
    ArmObservation,
    EpisodeTitle,
    NearbyObject,
    Reach,
)
from infthor_eval.report.recordings.arm_pictures import (
    COLUMNS,
    arm_pictures,
    draw_arm_frame,
    draw_arm_title,
    draw_sheet,
    shown_steps,
)
from infthor_eval.report.recordings.canvas import END_REPEATS, SIZE, TITLE_REPEATS
from infthor_eval.report.recordings.reach_view import draw_reach

from .pictures import find_colours

GREEN, RED = (26, 127, 55), (193, 39, 45)
NAMED, HAND = (213, 94, 0), (0, 114, 178)
MUG = NearbyObject("Mug", ((0.1, 0.6), (0.1, 0.7), (0.2, 0.7), (0.2, 0.6)), 0.8, 0.9, is_named=True)
TABLE = NearbyObject("SideTable", ((-0.3, 0.5), (-0.3, 1.2), (0.4, 1.2), (0.4, 0.5)), 0.0, 0.8)
FAR = NearbyObject(
    "Sofa", ((3.0, 0.5), (3.0, 1.2), (4.0, 1.2), (4.0, 0.5)), 0.0, 0.8, is_named=False
)
WAY = ((0.0, 0.3, 0.8), (0.1, 0.5, 0.9))
JOINTS = ((0.0, 0.0, 0.8), (0.0, 0.2, 0.9))
REACH = Reach(JOINTS, WAY[-1], 0.2, WAY, (TABLE, MUG, FAR), (-0.4, -0.1, 0.5), (0.5, 0.9, 1.2))
SIGHT = ArmObservation(np.full((300, 300, 3), 90, np.uint8), REACH)
TITLE = EpisodeTitle(2, 7, 57, "Pick-up", "pick up the mug", 1, 0.2)
START = ArmFrame(title=TITLE, observation=SIGHT, distance=0.5, closest=0.5, max_reward=2.0)
END = replace(
    START,
    number=1,
    requests=("delta: x +1.0", "MoveArmRelative"),
    actions=("MoveArmRelative",),
    ending="done",
    done=True,
)


def test_an_episode_has_its_title_its_start_and_its_end_held():
    pictures = list(arm_pictures([START, END], "a run"))
    assert len(pictures) == TITLE_REPEATS + 1 + END_REPEATS
    assert {(picture.size, picture.mode) for picture in pictures} == {(SIZE, "RGB")}
    idle = replace(START, observation=None, ending="left out: no room")
    assert len(list(arm_pictures([idle], "a run"))) == TITLE_REPEATS
    assert RED in find_colours(draw_arm_title(idle, ""))
    with pytest.raises(ValueError, match="no observation"):
        draw_arm_frame(idle, "")


def test_the_ending_is_green_or_red_and_what_is_told_is_written():
    lost = replace(END, ending="step limit", done=False)
    assert GREEN in find_colours(draw_arm_frame(END, ""))
    assert RED in find_colours(draw_arm_frame(lost, ""))
    assert not {GREEN, RED} & find_colours(draw_arm_frame(START, ""))
    plain = draw_arm_frame(END, "").tobytes()
    changes = {"refusals": ("Collided",), "note": "differs", "requests": ("other",)}
    for name, value in (changes | {"n_collisions": 3}).items():
        assert draw_arm_frame(replace(END, **{name: value}), "").tobytes() != plain


def test_the_reach_shows_hand_and_target_and_not_what_lies_beside():
    picture = draw_reach(REACH, 400)
    assert picture.size == (400, 400)
    assert {NAMED, HAND} <= find_colours(picture)
    without = draw_reach(replace(REACH, objects=(TABLE, MUG)), 400)
    rows = slice(200, 370)  # the view from the side, which the sofa would stand in
    assert np.array_equal(np.asarray(picture)[rows], np.asarray(without)[rows])


@pytest.mark.parametrize("n_steps", [0, 1, 3, 4, 60])
def test_a_row_has_its_start_and_its_end(n_steps):
    steps = shown_steps(n_steps)
    assert (steps[0], steps[-1]) == (0, n_steps)
    assert len(steps) == min(COLUMNS, n_steps + 1)


def test_a_sheet_has_a_row_for_each_episode():
    lost = replace(END, ending="step limit", done=False, refusals=("Collided with a wall",))
    idle = replace(START, observation=None, ending="failed: broken")
    one = draw_sheet([[START, END]], "a run")
    three = draw_sheet([[START, END], [START, lost], [idle]], "a run")
    assert three.size[0] == one.size[0]
    assert three.size[1] > 2 * one.size[1]
    assert GREEN in find_colours(one)
    assert RED not in find_colours(one)
    assert {GREEN, RED} <= find_colours(three)
