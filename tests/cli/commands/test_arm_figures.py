"""The command that draws figures, of runs of manipulation."""

import pytest

from ...helpers.arm_runs import make_arm_planner_run, make_arm_run, make_episode_record
from ...helpers.command_line import assert_refused
from ...helpers.journals import write_run
from ...helpers.plan_runs import make_plan_record, make_plans_run
from ...helpers.printed import read_rows


def episodes(**about):
    return [
        make_episode_record(name, 5 * number, kind, **about)
        for name in "ab"
        for number, kind in enumerate(("pickup", "put"))
    ]


EPISODES, LOST = episodes(), episodes(done=False)


@pytest.fixture
def folders(tmp_path):
    runs = (
        make_arm_run("m", EPISODES),
        make_arm_run("m", LOST, radius=0.1),
        make_arm_planner_run(EPISODES),
    )
    return [
        write_run(run, tmp_path / "results", f"arm-{number}") for number, run in enumerate(runs)
    ]


def test_figure_6_is_drawn_and_its_ends_are_printed(folders, tmp_path, run_cli):
    out = tmp_path / "figures"
    code, output, err = run_cli("report", *folders, "--figure", "6", "--out", out)
    assert (code, err) == (0, "")
    assert "arm_pickup and arm_put: reward at the end, mean over 2 trajectories" in output
    assert output.splitlines()[-2:] == [str(out / "figure6.png"), str(out / "figure6.svg")]
    assert all((out / name).stat().st_size > 1000 for name in ("figure6.png", "figure6.svg"))
    assert "m, 0.1 m 0.00 [0.00, 0.00] 0.0 0.00 0.00 5 4" in read_rows(output)


def test_runs_of_figure_6_can_be_put_into_panels(folders, tmp_path, run_cli):
    (tmp_path / "panels.yaml").write_text("Large: ['m, 0.5 m']\n")
    words = ("--figure", "6", "--out", tmp_path, "--panels", tmp_path / "panels.yaml")
    _, output, _ = run_cli("report", *folders, *words)
    assert "in no panel: m, 0.1 m" in output.splitlines()


def test_success_by_radius_is_drawn(folders, tmp_path, run_cli):
    code, output, err = run_cli("report", *folders, "--figure", "radius", "--out", tmp_path)
    assert (code, err) == (0, "")
    assert output.splitlines()[-2:] == [str(tmp_path / "radius.png"), str(tmp_path / "radius.svg")]
    assert "success by radius, %, of 2 trajectories" in output


def test_what_cannot_be_drawn_is_one_line(folders, tmp_path, run_cli):
    plans = write_run(make_plans_run("p", [make_plan_record("a", 0, (0, 1))]), tmp_path)
    other = write_run(make_arm_run("z", [make_episode_record("z", 1)]), tmp_path)
    twin = write_run(make_arm_run("m", EPISODES), tmp_path, "twin")
    first, *_ = folders
    foreign = f"{plans}: is a run of plans, and figure 6 is of manipulation; leave it out"
    panels = ("radius", "--panels", tmp_path / "panels.yaml")
    for runs, words, expected in (
        ((first, plans), ["6"], foreign),
        ((first,), ["7"], "is a run of manipulation, and figure 7 is of plans"),
        ((first, first), ["radius"], "given twice"),
        (folders, panels, "--panels: figure radius has panels of"),
        ((first, other), ["6"], "share no trajectory of arm_pickup"),
        ((first, twin), ["radius"], "two runs are called m and have a radius of 0.5 m"),
    ):
        ended = run_cli("report", *runs, "--out", tmp_path, "--figure", *words)
        assert_refused(ended, expected)
