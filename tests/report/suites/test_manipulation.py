"""Figures of arms: success by radius, and reward over steps, from numbers made by hand."""

from dataclasses import replace

from PIL import Image

from infthor_eval.manipulation.recorded.curves import arm_curves
from infthor_eval.manipulation.recorded.radii import success_by_radius
from infthor_eval.report.figures import save_figure
from infthor_eval.report.suites.manipulation import radii_result
from infthor_eval.report.suites.reward_curves import curves_result

from ...helpers.arm_runs import make_arm_planner_run, make_arm_run, make_episode_record
from .drawings import read_texts


def runs():
    records, lost = (
        [
            make_episode_record(name, number, kind, done=done)
            for name in "ab"
            for number, kind in enumerate(("pickup", "put"))
        ]
        for done in (True, False)
    )
    return [
        make_arm_run("m", lost, radius=0.1),
        make_arm_run("m", records),
        make_arm_planner_run(records),
    ]


def test_figure_6_has_a_panel_for_both_kinds_and_for_each(tmp_path):
    curves = arm_curves([replace(run, label=f"run {number}") for number, run in enumerate(runs())])
    result = curves_result(curves, None)
    _, svg = save_figure(result.plot, tmp_path, "figure6")
    words_drawn = read_texts(svg)
    for words in (
        *("Pick-up and put", "Pick-up", "Put", "run 0"),
        "Cumulative reward on arm_pickup and arm_put",
        "mean over 2 trajectories, 95 % intervals shaded",
        "embedded simulator: not comparable with the paper's curves",
        "the runs differ in the radius of the hand's sphere: 0.1, 0.5 m",
    ):
        assert words in words_drawn
    assert words_drawn.count("the expert's step (low-level action)") == 3
    table = result.table
    assert [column.name for column in table.columns] == [
        *("run", "reward", "95 % interval", "of the bound, %", "of pick-ups", "of puts", "at step"),
        "episodes",
    ]
    assert "|".join(table.rows[1].cells) == "run 1|4.00|[4.00, 4.00]|100.0|2.00|2.00|1|4"


def test_success_by_radius_is_drawn_with_its_floor(tmp_path):
    result = radii_result(success_by_radius(runs()))
    one, other = (save_figure(result.plot, tmp_path, name)[1] for name in ("one", "other"))
    assert one.read_bytes() == other.read_bytes()
    drawn = {"Pick-up", "Put", "m", "planner-arm", "in the sphere at the start", "success (%)"}
    assert drawn <= set(read_texts(one))
    with Image.open(tmp_path / "one.png") as picture:
        assert min(picture.size) > 300
    table = result.table
    assert [column.name for column in table.columns][2:] == ["0.1 m", "0.5 m", "episodes"]
    assert [row.cells[:2] for row in table.rows] == [
        ("m", "Pick-up"),
        ("planner-arm", "Pick-up"),
        ("m", "Put"),
        ("planner-arm", "Put"),
        ("(in the sphere at the start)", "Pick-up"),
    ]
    assert table.rows[1].cells[2] == "-"
    assert table.notes[0] == "embedded simulator: not comparable with the paper's results"
