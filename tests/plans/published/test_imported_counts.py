"""Plan logs as runs: what they hold, and what they say that they do not hold."""

import gzip
import json
from pathlib import Path

import pytest

from infthor_eval.plans.records import RECORDS
from infthor_eval.runs import read_run

from ...helpers.command_line import assert_refused
from ...helpers.journals import write_run
from ...helpers.plan_runs import make_plan_record, make_planner_run

LOG = "eval_longhrz_checkpoints_some-model-hf_yarn_4.0.log"
PUBLISHED = sorted(
    (Path(__file__).parents[3] / "../shared/data/published_sets/plans").glob("*.log.gz")
)


def row(traj_id, goto=(0, 0), pick=(0, 0), put=(0, 0), more=0):
    """A row as the published scripts write it; each count is (done, plans), `more` plans are of
    other kinds."""
    kinds = {"goto": goto, "pick": pick, "put": put}
    metric = {"total_count": sum(n for _, n in kinds.values()) + more, "agent_reward": 0}
    metric["success_count"] = sum(done for done, _ in kinds.values())
    for name, (done, n) in kinds.items():
        metric |= {f"{name}_count": n, f"{name}_success": done}
    return json.dumps({"traj_id": traj_id, "metric": metric}) + "\n"


ROWS = row("t0", (1, 2), (0, 1), (0, 1)) + row("t1") + row("t2", (0, 1), (1, 1), (0, 1))


REPLY = '{"question_id": "q", "reply": ""}\n'


@pytest.fixture
def import_log(tmp_path, run_cli):
    """Imports a text as a log; returns exit code, what was said, and the run's folder."""

    def import_log(content, *options, name=LOG):
        path = tmp_path / name
        path.write_bytes(
            gzip.compress(content.encode()) if name.endswith(".gz") else content.encode()
        )
        code, out, err = run_cli("import-replies", path, "--out", tmp_path / "out", *options)
        return code, out + err, next((tmp_path / "out").glob("*/*"), None)

    return import_log


def summary_of(folder):
    """What was found of the run's one task."""
    (task,) = json.loads((folder / "results.json").read_text())["summary"]["tasks"].values()
    return task


@pytest.mark.parametrize("name", [LOG, f"{LOG}.gz"])
def test_a_log_becomes_a_run_of_its_plans(import_log, run_cli, name):
    code, output, folder = import_log(ROWS, name=name)
    assert (code, folder.parent.name) == (0, "some-model-hf_yarn_4.0")
    assert "7 plans of 2 trajectories imported; the set-up of 1 more failed" in output
    header, records = read_run(folder, RECORDS)
    assert list(header.config.tasks) == ["infthor_final"]
    assert [(record.id, record.payload.kind, record.payload.ended) for record in records] == [
        ("t0/0000", "GotoLocation", "done"),
        ("t0/0001", "GotoLocation", "not done"),
        ("t0/0002", "PickupObject", "not done"),
        ("t0/0003", "PutObject", "not done"),
        ("t2/0000", "GotoLocation", "not done"),
        ("t2/0001", "PickupObject", "done"),
        ("t2/0002", "PutObject", "not done"),
    ]
    task = summary_of(folder)
    assert {name: (round(rate["mean"], 4), rate["n"]) for name,
            rate in task["success"].items()} == {
        "Go to": (0.3333, 3), "Pick up": (0.5, 2), "Put": (0.0, 2), "total": (0.2857, 7),
    }  # fmt: skip
    assert task["skipped"] == {"its set-up failed: the log counts no plan of it": 1}
    lines = (folder / "scores.jsonl").read_text().splitlines()
    scores = [json.loads(line)["scores"] for line in lines]
    assert scores[:2] == [{"success": 1.0}, {"success": 0.0}]
    before = (folder / "results.json").read_bytes()
    assert import_log(ROWS, name=name)[0] == 0
    assert (folder / "results.json").read_bytes() == before


def test_what_is_not_in_the_log_is_not_in_the_results(import_log):
    _, _, folder = import_log(ROWS)
    names = ("reward", "max_reward", "reward_share", "goals", "n_actions")
    assert {summary_of(folder)[name] for name in names} == {None}


def test_the_run_is_shown_and_compared_like_any_other(import_log, run_cli):
    _, _, folder = import_log(ROWS)
    code, out, _ = run_cli("show", folder, "--full")
    assert code == 0
    assert "published, final long-horizon tasks" in out
    assert "Both stand" in out
    assert run_cli("compare", folder, folder)[0] == 0


def test_a_page_says_that_there_is_nothing_to_draw(import_log, run_cli, tmp_path):
    _, _, folder = import_log(ROWS)
    code, _, _ = run_cli("report", folder, "--out", tmp_path / "r.html")
    assert (code, "imported counts have no steps" in (tmp_path / "r.html").read_text()) == (0, True)


@pytest.mark.parametrize("words", [("watch",), ("report", "--figure", "7", "--out", "figure")])
def test_what_needs_steps_says_that_there_are_none(import_log, run_cli, words):
    _, _, folder = import_log(ROWS)
    refusal = "imported counts have no steps and no rewards; give runs made here"
    ended = run_cli(words[0], folder, *words[1:])
    assert_refused(ended, f"infthor-eval: some-model-hf_yarn_4.0: {refusal}")


def test_imported_counts_stand_beside_a_run_made_here(import_log, run_cli, tmp_path):
    _, _, folder = import_log(ROWS)
    own = make_planner_run(
        [make_plan_record("t0", 0, (0, 3), 5.0, most=5.0, task="infthor_final")],
        task="infthor_final",
    )
    code, out, _ = run_cli("show", folder, write_run(own, tmp_path / "own", "infthor_final-0123"))
    assert code == 0
    assert "100.0" in out and "28.6" in out


def test_lines_that_are_not_imported_are_counted_and_named(import_log):
    code, output, folder = import_log(ROWS + row("t3", (1, 1), more=2) + '{"traj_id": "t4"\n')
    assert code == 1
    assert "some-model-hf_yarn_4.0: 2 row(s) not imported" in output
    assert f"{LOG}, line 4: counts plans of other kinds than goto, pick and put" in output
    assert f"{LOG}, line 5: has no counts of plans (" in output
    assert sum(summary_of(folder)["skipped"].values()) == 3


@pytest.mark.parametrize(
    ("content", "name", "reason"),
    [
        (ROWS, "mine.log", "mine.log: its name has no model; give one with --model"),
        (row("t0"), LOG, "can be imported; give a log that counts goto, pick and put"),
        ('{"metric": {}}\n', LOG, "no line has counts of plans (line 1 has no counts of plans ("),
        (REPLY, LOG, "has replies to questions; give their NIEH set with --data"),
    ],
)
def test_a_log_that_cannot_be_imported_is_one_line(import_log, content, name, reason):
    code, output, folder = import_log(content, name=name)
    assert (code, folder, output.count("\n")) == (2, None, 1)
    assert reason in output


def test_a_name_can_be_given(import_log):
    assert import_log(ROWS, "--model", "mine", name="mine.log")[2].parent.name == "mine"


@pytest.mark.skipif(not PUBLISHED, reason="the published plan logs are not at ../shared/data")
def test_the_published_logs_give_the_published_totals(tmp_path, run_cli):
    logs = [path for path in PUBLISHED if "yarn" not in path.name and "infini-ft" in path.name]
    assert run_cli("import-replies", *logs, "--out", tmp_path)[0] == 0
    totals = {}
    for results in tmp_path.glob("*/*/results.json"):
        total = summary_of(results.parent)["success"]["total"]
        totals[results.parents[1].name] = round(100 * total["mean"], 1), total["n"]
    assert totals == {
        "infini-ft_step-20000-hf": (9.2, 131),
        "infini-ft_step-20000-hf_dynamic_4.0": (9.9, 131),
        "infini-ft_step-20000-hf_longrope_4.0": (9.2, 131),
    }
