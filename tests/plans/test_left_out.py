"""What cannot be evaluated is left out, named and counted."""

import json

import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import execute

from ..helpers.command_line import option_words
from ..helpers.refusals import read_one_line
from ..helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories
from .outcomes import cells, payloads, summary

pytestmark = pytest.mark.usefixtures("shared_simulators")


def refused_in(plan):
    """The kitchen, with an action of the expert in that plan that no simulator can carry out."""
    document = cut_trajectory(FORK)
    low = next(low for low in document["plan"]["low_actions"] if low["high_idx"] == plan)
    low["api_action"] = {"action": "OpenObject", "objectId": "Wardrobe|+00.00|+00.00|+00.00"}
    return document


@pytest.mark.parametrize("after_failure", ["continue", "stop"])
def test_plans_that_the_expert_cannot_do_here_count_for_nobody(
    prepare_run, tmp_path, after_failure
):
    data = write_trajectories(tmp_path / "refused", refused_in(2))
    for model, ended in (("planner", "done"), ("scripted", "refused by the simulator")):
        outcome = execute(prepare_run(model, data=data, after_failure=after_failure))
        assert payloads(outcome)[0].ended == ended
        task = summary(outcome)
        assert (task.n_plans, task.n_failed, sum(task.endings.values())) == (2, 0, 2)
        ((reason, number),) = task.excluded.items()
        assert reason.startswith(
            "the expert's action 15 (OpenObject Wardrobe, in plan 2) is refused here: "
        )
        assert number == 2
        n_plans = {name: rate.n for name, rate in task.success.items()}
        assert n_plans == {"Go to": 1, "Pick up": 1, "total": 2}
        assert cells(outcome, "Plans completed")["excluded"] == "2"
        (table, *_) = outcome.run.suite.tables([outcome.summary])
        assert f"2 left out: {reason}" in table.notes


def test_a_plan_about_what_is_not_there_counts_for_nobody(prepare_run, tmp_path):
    document = cut_trajectory(FORK)
    nowhere = "Elephant|+00.00|+00.00|+00.00"
    document["plan"]["high_pddl"][3]["planner_action"]["receptacleObjectId"] = nowhere
    outcome = execute(prepare_run(data=write_trajectories(tmp_path / "elephant", document)))
    task = summary(outcome)
    assert task.excluded == {f"the scene has no object for '{nowhere}'": 1}
    assert (task.n_plans, task.n_failed, task.endings) == (3, 0, {"done": 3})


def test_trajectories_in_a_scene_that_is_not_here_count_for_nobody(prepare_run, data):
    document = cut_trajectory(MUG, 2, called="elsewhere")
    document["scene"]["floor_plan"] = "FloorPlan7"
    (data / "elsewhere.json").write_text(json.dumps(document))
    outcome = execute(prepare_run("scripted"))
    task = summary(outcome)
    ((reason, number),) = task.excluded.items()
    assert reason.startswith("scene FloorPlan7: ")
    assert (number, task.n_plans, task.n_failed) == (2, 4, 0)
    assert all(not record.faults for record in outcome.records)


def test_where_all_is_left_out_the_exit_code_says_so(run_cli, tmp_path):
    document = cut_trajectory(MUG, 2)
    document["scene"]["floor_plan"] = "FloorPlan7"
    data = write_trajectories(tmp_path / "elsewhere", document)
    words = option_words(model="scripted", tasks="infthor_plans", data=data, out=tmp_path / "o")
    code, out, err = run_cli("run", *words)
    assert code == 1
    assert "scene FloorPlan7" in out and "--scenes DIR" in " ".join(out.split())
    assert "no result: every sample is excluded" in err


BROKEN = {
    "no JSON": ("{", "not a trajectory"),
    "of another form": ('{"scene": 5}', "not a trajectory"),
    "unknown plan kind": (
        lambda it: it["plan"]["high_pddl"][1]["discrete_action"].update(action="Juggle"),
        "sub-goal 1 is 'Juggle'; there are GotoLocation",
    ),
    "no goal": (
        lambda it: it["sub_tasks"][0]["task_info"].update(goal=""),
        "task 0: a task has no goal",
    ),
    "an action without a name": (
        lambda it: it["plan"]["low_actions"][5]["api_action"].update(action=" "),
        "not a trajectory (Expected `str` matching regex",
    ),
    "no action": (
        lambda it: it["plan"].update(low_actions=[]),
        "no plan with an action; leave it out",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_trajectory_is_skipped_named_and_counted(prepare_run, data, name):
    damage, expected = BROKEN[name]
    document = cut_trajectory(FORK, called="broken")
    if isinstance(damage, str):
        (data / "broken.json").write_text(damage)
    else:
        damage(document)
        (data / "broken.json").write_text(json.dumps(document))
    run = prepare_run("scripted")
    (skipped,) = run.evaluation.bind(run.suite.baselines["scripted"](0)).workload.skipped
    assert skipped.key.id == "broken.json"
    assert expected in skipped.reason
    assert "\n" not in skipped.reason
    assert str(data) not in skipped.reason  # the run is the same one wherever its data lie


def test_files_that_cannot_be_read_are_skipped_too(prepare_run, data):
    (data / "a.jsonl.gz").write_bytes(b"no gzip")
    (data / "b.json").mkdir()
    (data / "c.json").symlink_to("nowhere")
    (data / "d.jsonl").write_text(json.dumps(cut_trajectory(MUG, 1, called="sound")) + "\n{\n")
    outcome = execute(prepare_run())
    assert {record.cluster for record in outcome.records} == {FORK, "sound"}
    task = summary(outcome)
    assert (sum(task.skipped.values()), task.n_trajectories) == (3, 2)
    assert cells(outcome, "Plans completed")["skipped"] == "3"
    for name in ("a.jsonl.gz", "c.json", "d.jsonl:2"):
        assert any(name in reason for reason in task.skipped)


def test_nothing_to_evaluate_is_refused_in_one_line(prepare_run, tmp_path):
    nowhere, empty, broken = (tmp_path / name for name in ("nowhere", "empty", "broken"))
    empty.mkdir()
    broken.mkdir()
    (broken / "a.json").write_text("{")
    for place, error, expected in (
        (None, UsageError, "no trajectories of its own; give them as --data"),
        (nowhere, UsageError, "there is no such file or folder"),
        (empty, DataError, "no .json, .jsonl, .jsonl.gz file"),
        (broken, DataError, "nothing to evaluate"),
    ):
        with pytest.raises(error, match=expected) as caught:
            prepare_run(data=place)
        read_one_line(caught)
    twice = write_trajectories(tmp_path / "twice", cut_trajectory(FORK, 1))
    write_trajectories(twice / "again", cut_trajectory(FORK, 2))
    with pytest.raises(DataError, match=f"{FORK} is the name of another trajectory too"):
        prepare_run(data=twice)
