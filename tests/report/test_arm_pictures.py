"""Pictures of arms: figures, moments and sheets, from numbers made by hand."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from infthor_eval.manipulation.recorded.curves import arm_curves
from infthor_eval.manipulation.recorded.radii import success_by_radius
from infthor_eval.manipulation.recorded.replay_frames import (
    ArmFrame,
    ArmObservation,
    EpisodeTitle,
    NearbyObject,
    Reach,
)
from infthor_eval.report.figures.curve_tables import curves_table, one_panel
from infthor_eval.report.figures.curves import draw_curves
from infthor_eval.report.figures.radius import draw_radii, radii_table
from infthor_eval.report.recordings.arm_pictures import arm_pictures, draw_arm_frame, draw_arm_title
from infthor_eval.report.recordings.canvas import END_REPEATS, SIZE, TITLE_REPEATS
from infthor_eval.report.recordings.episode_sheet import COLUMNS, draw_sheet, shown_steps
from infthor_eval.report.recordings.reach_view import draw_reach

from ..helpers.arm_runs import make_arm_planner_run, make_arm_run, make_episode_record
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


def runs():
    records = [
        make_episode_record(name, number, kind)
        for name in "ab"
        for number, kind in enumerate(("pickup", "put"))
    ]
    lost = [
        make_episode_record(name, number, kind, done=False)
        for name in "ab"
        for number, kind in enumerate(("pickup", "put"))
    ]
    return [
        make_arm_run("m", lost, radius=0.1),
        make_arm_run("m", records),
        make_arm_planner_run(records),
    ]


def texts(svg):
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg.read_text(encoding="utf-8"))


def test_figure_6_has_a_panel_for_both_kinds_and_for_each(tmp_path):
    curves = arm_curves([replace(run, label=f"run {number}") for number, run in enumerate(runs())])
    _, svg = draw_curves(curves, one_panel(curves), tmp_path, "figure6")
    words_drawn = texts(svg)
    for words in (
        "Pick-up and put",
        "Pick-up",
        "Put",
        "run 0",
        "Cumulative reward on arm_pickup and arm_put",
        "mean over 2 trajectories, 95 % intervals shaded",
        "embedded simulator: not comparable with the paper's curves",
        "the runs differ in the radius of the hand's sphere: 0.1, 0.5 m",
    ):
        assert words in words_drawn
    assert words_drawn.count("the expert's step (low-level action)") == 3
    table = curves_table(curves)
    names = [
        "run",
        "reward",
        "95 % interval",
        "of the bound, %",
        "of pick-ups",
        "of puts",
        "at step",
    ]
    assert [column.name for column in table.columns] == [*names, "episodes", "failed"]
    assert table.rows[1].cells == (
        "run 1",
        "4.00",
        "[4.00, 4.00]",
        "100.0",
        "2.00",
        "2.00",
        "1",
        "4",
        "0",
    )


def test_success_by_radius_is_drawn_with_its_floor(tmp_path):
    curves = success_by_radius(runs())
    one, other = (draw_radii(curves, tmp_path, name)[1] for name in ("one", "other"))
    assert one.read_bytes() == other.read_bytes()
    for words in (
        "Pick-up",
        "Put",
        "m",
        "planner-arm",
        "in the sphere at the start",
        "success (%)",
    ):
        assert words in texts(one)
    with Image.open(tmp_path / "one.png") as picture:
        assert min(picture.size) > 300
    table = radii_table(curves)
    assert [column.name for column in table.columns][2:] == ["0.1 m", "0.5 m", "episodes", "failed"]
    assert [row.cells[:2] for row in table.rows] == [
        ("m", "Pick-up"),
        ("planner-arm", "Pick-up"),
        ("m", "Put"),
        ("planner-arm", "Put"),
        ("(in the sphere at the start)", "Pick-up"),
    ]
    assert table.rows[1].cells[2] == "-"
    assert table.notes[0] == "embedded simulator: not comparable with the paper's results"


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
    for change in (
        {"refusals": ("Collided",)},
        {"note": "differs"},
        {"requests": ("other",)},
        {"n_collisions": 3},
    ):
        assert draw_arm_frame(replace(END, **change), "").tobytes() != plain


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
