"""The command that draws figures, of runs of manipulation."""

import pytest

from ...manipulation.made_runs import episode, made_run, planner_run, write_run
from ...plans.made_runs import made_run as plans_run
from ...plans.made_runs import plan
from ...plans.made_runs import write_run as write_plans

EPISODES = [
    episode(name, 5 * number, kind)
    for name in "ab"
    for number, kind in enumerate(("pickup", "put"))
]
LOST = [
    episode(name, 5 * number, kind, done=False)
    for name in "ab"
    for number, kind in enumerate(("pickup", "put"))
]


@pytest.fixture
def folders(tmp_path):
    made = (made_run("m", EPISODES), made_run("m", LOST, radius=0.1), planner_run(EPISODES))
    return [
        write_run(run, tmp_path / "results", f"arm-{number}") for number, run in enumerate(made)
    ]


def refused(found, *said):
    code, out, err = found
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    for words in said:
        assert words in err


def test_figure_6_is_drawn_and_its_ends_are_printed(folders, tmp_path, run):
    out = tmp_path / "figures"
    code, said, err = run("report", *folders, "--figure", "6", "--out", out)
    assert (code, err) == (0, "")
    assert "arm_pickup and arm_put: reward at the end, mean over 2 trajectories" in said
    assert said.splitlines()[-2:] == [str(out / "figure6.png"), str(out / "figure6.svg")]
    assert all((out / name).stat().st_size > 1000 for name in ("figure6.png", "figure6.svg"))
    rows = [line.split() for line in said.splitlines()]
    assert [
        "m,",
        "0.1",
        "m",
        "0.00",
        "[0.00,",
        "0.00]",
        "0.0",
        "0.00",
        "0.00",
        "5",
        "4",
        "0",
    ] in rows


def test_runs_of_figure_6_can_be_put_into_panels(folders, tmp_path, run):
    (tmp_path / "panels.yaml").write_text("Large: ['m, 0.5 m']\n")
    words = ("--figure", "6", "--out", tmp_path, "--panels", tmp_path / "panels.yaml")
    _, said, _ = run("report", *folders, *words)
    assert "in no panel: m, 0.1 m" in said.splitlines()


def test_success_by_radius_is_drawn(folders, tmp_path, run):
    code, said, err = run("report", *folders, "--figure", "radius", "--out", tmp_path)
    assert (code, err) == (0, "")
    assert said.splitlines()[-2:] == [str(tmp_path / "radius.png"), str(tmp_path / "radius.svg")]
    assert "success by radius, %, of 2 trajectories" in said


def test_what_cannot_be_drawn_is_one_line(folders, tmp_path, run):
    plans = write_plans(plans_run("p", [plan("a", 0, (0, 1))]), tmp_path)
    said = f"{plans}: is a run of plans, and figure 6 is of manipulation; leave it out"
    refused(run("report", folders[0], plans, "--figure", "6"), said)
    refused(
        run("report", folders[0], "--figure", "7"),
        "is a run of manipulation, and figure 7 is of plans",
    )
    refused(run("report", folders[0], folders[0], "--figure", "radius"), "given twice")
    panels = tmp_path / "panels.yaml"
    refused(
        run("report", *folders, "--figure", "radius", "--panels", panels),
        "--panels: figure radius has panels of",
    )
    other = write_run(made_run("z", [episode("z", 1)]), tmp_path)
    refused(
        run("report", folders[0], other, "--figure", "6", "--out", tmp_path),
        "share no trajectory of arm_pickup",
    )
    twin = write_run(made_run("m", EPISODES), tmp_path, "twin")
    words = ("report", folders[0], twin, "--figure", "radius", "--out", tmp_path)
    refused(run(*words), "two runs are called m and have a radius of 0.5 m")
