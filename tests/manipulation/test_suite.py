"""Runs from the request to the tables: baselines, tiny policies, and what cannot be evaluated."""

import io
import json
import math

import numpy as np
import pytest
from PIL import Image

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.errors import DataError, UsageError
from infthor_eval.manipulation.records import RECORDS
from infthor_eval.runs import execute, prepare, read_run
from model_adapters import ArmDelta, load

from ..helpers.command_line import assert_refused
from ..helpers.refusals import read_one_line
from ..helpers.trajectories import CANDLE, FORK, MUG, cut_trajectory, write_trajectories

pytestmark = pytest.mark.usefixtures("shared_simulators")

PICK, PUT = "manipulathor_pickup", "manipulathor_put"
STILL = ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.49)


def by_key(outcome):
    return {
        (record.task, record.cluster, record.payload.index): record for record in outcome.records
    }


def own_rows(*outcomes):
    """The rows of runs in the first table, without the published ones."""
    (table, *_) = outcomes[0].run.suite.tables([outcome.summary for outcome in outcomes])
    return [row for row in table.rows if not row.is_published]


def payloads(outcome):
    return [record.payload for record in outcome.records]


# -- a run


def test_the_planner_does_what_the_expert_did(prepare_run, data):
    write_trajectories(data / "more", cut_trajectory(CANDLE))
    outcome = execute(prepare_run())
    records = by_key(outcome)
    assert {key: record.payload.instruction for key, record in records.items()} == {
        (PICK, MUG, 9): "pick up the mug",
        (PUT, MUG, 21): "put the mug in the desk",
        (PICK, CANDLE, 6): "pick up the candle",
    }
    assert all(record.payload.done and record.payload.reward == 2 for record in outcome.records)
    assert not any(record.failure or record.excluded or record.faults for record in outcome.records)
    numbers = {
        record.key: doc.number for record, doc in zip(outcome.records, outcome.docs, strict=True)
    }
    assert numbers[records[PUT, MUG, 21].key] == 0
    (row,) = own_rows(outcome)
    assert [cell.partition(" ")[0] for cell in row.cells] == [
        "planner-arm", "0.5", "100.0", "100.0", "2", "1", "2", "0", "0", "0", "0",
        "100.0", "100.0", "-", "-",
    ]  # fmt: skip


def test_the_journal_reads_back(prepare_run):
    outcome = execute(prepare_run("random-arm"))
    header, records = read_run(outcome.folder, RECORDS)[:2]
    assert list(records) == list(outcome.records)
    assert outcome.run.suite.summarise(header, records) == outcome.summary.summary
    moved = next(step for record in records for step in record.payload.steps if step.calls)
    assert len(moved.delta) == 7 and moved.calls[0]["action"] == "MoveArmRelative"
    results = json.loads((outcome.folder / "results.json").read_text())
    assert results["summary"]["tasks"].keys() == {PICK, PUT}


def test_the_limit_is_of_episodes(prepare_run):
    outcome = execute(prepare_run("still", limit=1))
    assert sorted(by_key(outcome)) == [(PICK, MUG, 9), (PUT, MUG, 21)]
    assert outcome.summary.header.config.limit == 1


def test_equal_seeds_act_alike_and_other_seeds_do_not(prepare_run, task_file, tmp_path):
    task_file("max_steps: 3")

    def moved(seed, folder):
        outcome = execute(prepare_run("random-arm", seed=seed, output=tmp_path / folder))
        return [[step.delta for step in record.payload.steps] for record in outcome.records]

    first = moved(7, "a")
    assert first == moved(7, "b")
    assert first != moved(8, "c")


def test_several_radii_are_runs_of_their_own(data, tmp_path):
    models = (ModelSpec("still"),)
    options = RunOptions(
        models, (PICK,), data, tmp_path / "out", suite_options={"radius": "0.06,0.5"}
    )
    outcomes = [execute(prepare(*request)) for request in options.requests()]
    assert [outcome.summary.summary.tasks[PICK].radius for outcome in outcomes] == [0.06, 0.5]
    assert len({outcome.folder for outcome in outcomes}) == 2
    assert [row.cells[1] for row in own_rows(*outcomes)] == ["0.06", "0.5"]


def test_all_that_changes_a_number_is_part_of_a_runs_identity(prepare_run, task_file, data):
    def prints(**changes):
        run = prepare_run("still", **changes)
        bound = run.evaluation.bind(run.suite.baselines["still"](0))
        bound.close()
        return [bound._fingerprint(unit) for unit in bound.workload.groups[0].units]

    task_file("radius: 0.5")
    plain = prints()
    assert prints() == plain
    by_options = {"radius": "0.06", "instruction": "take the {object}", "frames": "blank"}
    changed = [prints(seed=1), *(prints(**{name: value}) for name, value in by_options.items())]
    by_file = {"max_step": 0.05, "rotation": "false", "grasps": "all", "hold": "palm"}
    for name, value in {**by_file, "max_steps": 59}.items():
        task_file(f"{name}: {value}")
        changed.append(prints())
    assert all(not set(fingerprints) & set(plain) for fingerprints in changed)


# -- policies


@pytest.fixture(scope="session")
def twins():
    return {name: load(name, {}, 0) for name in ("openvla-tiny", "spatialvla-tiny")}


@pytest.mark.parametrize("name", ["openvla-tiny", "spatialvla-tiny"])
def test_tiny_policies_run_both_tasks(prepare_run, task_file, twins, monkeypatch, name):
    task_file("max_steps: 5")
    monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: twins[name])
    monkeypatch.setattr(twins[name], "close", lambda: None)
    outcome = execute(prepare_run(name))
    assert sorted(by_key(outcome)) == [(PICK, MUG, 9), (PUT, MUG, 21)]
    for record in outcome.records:
        assert record.failure is record.excluded is None
        assert 1 <= len(record.payload.steps) <= 5
        assert record.payload.ended in ("step limit", "done", "released elsewhere")
        assert all(len(step.delta) == 7 for step in record.payload.steps)
    assert outcome.summary.summary.tasks[PICK].success.n == 1
    assert [row.cells[0] for row in own_rows(outcome)] == [name]
    again = execute(prepare_run(name, output=outcome.folder.parents[1] / "again"))
    assert payloads(again) == payloads(outcome)


def test_a_policy_sees_the_present_frame_once_per_chunk_and_is_told_what_to_do(
    prepare_run, task_file, policy
):
    task_file("max_steps: 4, image_size: 96")
    move = ArmDelta((0.0, 0.05, 0.0), (0.0, 0.0, 0.2), 0.49)
    scripted = policy(lambda number: (move, STILL))
    outcome = execute(prepare_run("openvla-tiny", instruction="please: {object}"))
    assert [len(record.payload.steps) for record in outcome.records] == [4, 4]
    assert scripted.instructions == ["please: mug"] * 4
    assert scripted.resets == [0, 2]
    with Image.open(io.BytesIO(scripted.seen[0])) as image:
        assert image.size == (96, 96)
    assert len(set(scripted.seen)) == 4  # the arm has moved in them
    for record in outcome.records:
        assert [bool(step.calls) for step in record.payload.steps] == [True, False] * 2


def test_blank_frames_are_plain_and_change_nothing_else(prepare_run, task_file, policy, tmp_path):
    task_file("max_steps: 2, image_size: 64")
    on_true_frames = policy(lambda number: (STILL,))
    plain = execute(prepare_run("openvla-tiny"))
    blank = policy(lambda number: (STILL,))
    outcome = execute(prepare_run("openvla-tiny", frames="blank", output=tmp_path / "blank"))
    assert len(set(blank.seen)) == 1 and not set(blank.seen) & set(on_true_frames.seen)
    with Image.open(io.BytesIO(blank.seen[0])) as image:
        pixels = np.asarray(image)
    assert pixels.shape[:2] == (64, 64) and (pixels == 128).all()
    assert blank.instructions == on_true_frames.instructions
    assert payloads(outcome) == payloads(plain)
    assert [row.cells[0] for row in own_rows(plain, outcome)] == [
        "openvla-tiny",
        "openvla-tiny, blank frames",
    ]


GOOD = (0.0, 0.0, 0.0)
BAD = {
    "not a number": ((ArmDelta(GOOD, (0.0, math.nan, 0.0), 1.0),), "numbers that are not finite"),
    "a gripper that is none": ((ArmDelta(GOOD, GOOD, math.nan),), "numbers that are not finite"),
    "an infinite way": (
        (ArmDelta((math.inf, 0.0, 0.0), GOOD, 1.0),),
        "numbers that are not finite",
    ),
    "a text": ((ArmDelta(("far", 0.0, 0.0), GOOD, 1.0),), "numbers that are not finite"),
    "too few": ((ArmDelta((0.0, 0.0), GOOD, 1.0),), "gives 6 numbers for a step; it must be 7"),
    "too many": ((ArmDelta(GOOD, (0.0,) * 4, 1.0),), "gives 8 numbers for a step; it must be 7"),
    "bare numbers": (((0.0,) * 7,), "it must be an ArmDelta"),
    "no step": ((), "gives no movement; a policy gives at least one"),
    "bad after good": ((STILL, ArmDelta(GOOD, GOOD, math.inf)), "numbers that are not finite"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_movement_is_a_failure_of_the_policy(prepare_run, task_file, policy, name):
    task_file("max_steps: 3, image_size: 32")
    chunk, expected = BAD[name]
    policy(lambda number: chunk)
    outcome = execute(prepare_run("openvla-tiny", tasks=(PICK,)))
    (record,) = outcome.records
    assert expected in record.failure and "\n" not in record.failure
    assert (record.payload.ended, record.payload.done, record.excluded) == ("", False, None)
    task = outcome.summary.summary.tasks[PICK]
    assert (task.n_failed, task.success, task.endings) == (1, None, {"failed": 1})


# -- what cannot be evaluated


def test_a_trajectory_whose_expert_is_refused_counts_up_to_there(prepare_run, tmp_path):
    document = cut_trajectory(MUG)
    opens = {"action": "OpenObject", "objectId": "Desk|+9.99|+0.00|+0.00"}
    document["plan"]["low_actions"][12]["api_action"] = opens
    data = write_trajectories(tmp_path / "refused", document)
    for model in ("planner-arm", "still"):
        outcome = execute(prepare_run(model, data=data, output=tmp_path / "out" / model))
        pick, put = by_key(outcome)[PICK, MUG, 9], by_key(outcome)[PUT, MUG, 21]
        assert pick.excluded is None
        assert put.excluded.startswith("the expert's action 12 (OpenObject) is refused here: ")
        task = outcome.summary.summary.tasks[PUT]
        assert (task.success, task.excluded) == (None, {put.excluded: 1})
        (table, *_) = outcome.run.suite.tables([outcome.summary])
        assert f"1 left out: {put.excluded}" in table.notes


def test_an_episode_whose_object_is_missing_counts_for_nobody(prepare_run, tmp_path):
    document = cut_trajectory(MUG)
    recorded = document["plan"]["low_actions"][9]["api_action"]
    recorded["objectId"] = "Elephant|+00.00|+00.00|+00.00"
    outcome = execute(
        prepare_run("still", data=write_trajectories(tmp_path / "elephant", document))
    )
    # What comes after is not known either.
    assert all("Elephant" in record.excluded for record in outcome.records)
    assert by_key(outcome)[PICK, MUG, 9].payload.instruction == "pick up the elephant"
    assert outcome.summary.summary.tasks[PICK].success is None


def test_a_scene_that_is_not_here_counts_for_nobody(prepare_run, data):
    document = cut_trajectory(FORK, called="elsewhere")
    document["scene"]["floor_plan"] = "FloorPlan7"
    (data / "elsewhere.json").write_text(json.dumps(document))
    outcome = execute(prepare_run("still"))
    left_out = [record for record in outcome.records if record.excluded is not None]
    assert [record.cluster for record in left_out] == ["elsewhere"] * 2
    assert all(record.excluded.startswith("scene FloorPlan7: ") for record in left_out)
    assert not any(record.faults for record in left_out)
    assert outcome.summary.summary.tasks[PICK].success.n == 1


BROKEN = {
    "no JSON": ("{", "not a trajectory"),
    "of another form": ('{"scene": 5}', "not a trajectory"),
    "a pick-up of nothing": (
        lambda document: document["plan"]["low_actions"][9]["api_action"].pop("objectId"),
        "action 9 (PickupObject) names no object; restore the file",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_trajectory_is_skipped_named_and_counted(prepare_run, data, name):
    damage, expected = BROKEN[name]
    if isinstance(damage, str):
        (data / "broken.json").write_text(damage)
    else:
        document = cut_trajectory(MUG, called="broken")
        damage(document)
        (data / "broken.json").write_text(json.dumps(document))
    outcome = execute(prepare_run("still", tasks=(PICK,)))
    ((reason, number),) = outcome.summary.summary.tasks[PICK].skipped.items()
    assert number == 1 and reason.startswith("broken.json") and expected in reason
    assert "\n" not in reason and str(data) not in reason
    (table, *_) = outcome.run.suite.tables([outcome.summary])
    assert f"1 left out: {reason}" in table.notes
    assert len(outcome.records) == 1


def test_where_no_trajectory_has_such_an_action_that_is_said(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "walks", cut_trajectory(MUG, 1))
    with pytest.raises(
        UsageError, match="manipulathor_pickup: no trajectory there has a Pick-up"
    ) as caught:
        prepare_run(data=data)
    read_one_line(caught)
    with pytest.raises(UsageError, match="manipulathor_put: no trajectory there has a Put"):
        prepare_run(
            data=write_trajectories(tmp_path / "picks", cut_trajectory(MUG, 2)), tasks=(PUT,)
        )


def test_nothing_to_evaluate_is_refused_in_one_line(prepare_run, tmp_path):
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "a.json").write_text("{")
    for place, error, expected in (
        (None, UsageError, "no trajectories of its own; give them as --data"),
        (broken, DataError, "nothing to evaluate"),
    ):
        with pytest.raises(error, match=expected) as caught:
            prepare_run(data=place)
        read_one_line(caught)


@pytest.mark.parametrize(("option", "value", "expected"), [
    ("radius", "0.7", "--radius 0.7: give a number of metres from 0.04, at most 0.5"),
    ("radius", "wide", "--radius wide: give a number of metres"),
    ("frames", "black", "--frames black: give shown or blank"),
    ("instruction", "do it", "must have {object}"),
    ("scenes", "/nowhere/at/all", "/nowhere/at/all"),
])  # fmt: skip
def test_an_option_that_does_not_fit_ends_the_command_in_one_line(
    run_cli, data, tmp_path, option, value, expected
):
    words = ("run", "--model", "still", "--tasks", PICK, "--data", data, "--out", tmp_path / "o")
    assert_refused(run_cli(*words, f"--{option}", value), expected)


def test_two_tasks_about_the_same_episodes_run_together(prepare_run, task_files):
    """They share the expert's history; each has its own frames' size and radius."""
    for name, settings in (("near", "radius: 0.06, image_size: 64"), ("far", "radius: 0.5")):
        (task_files / "manipulation" / f"{name}.yaml").write_text(
            "include: _manipulation.yaml\n"
            f"task: {name}\n"
            f"dataset_kwargs: {{kind: pickup, {settings}}}\n"
        )
    outcome = execute(prepare_run("planner-arm", tasks=("near", "far")))
    records = by_key(outcome)
    assert sorted(records) == [("far", MUG, 9), ("near", MUG, 9)]
    assert records["far", MUG, 9].payload.done
    near, far = (records[name, MUG, 9].payload.start_distance for name in ("near", "far"))
    assert near > far  # a small sphere
    assert [row.cells[1] for row in own_rows(outcome)] == ["0.06", "0.5"]
