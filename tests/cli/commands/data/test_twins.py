"""`twins`, as a user types it."""

import json
from collections import Counter
from dataclasses import replace

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.twins import read_pairs
from infthor_eval.thor import launch
from infthor_eval.thor.launch import embedded_launch

from ....helpers.command_line import assert_refused, read_success
from ....helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories

OPTIONS = ("--kinds", "state,replace", "--per-kind", 1, "--per-trajectory", 3)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    documents = [cut_trajectory(name, 4) for name in (FORK, MUG)]
    return write_trajectories(tmp_path_factory.mktemp("twins") / "data", *documents)


def content(folder):
    """All files of a set by their names."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_a_set_of_twins(data, tmp_path, run_cli):
    code, out, _ = run_cli("twins", data, "--out", tmp_path / "one", *OPTIONS, "--json")
    summary = json.loads(out)
    assert code == 0
    assert summary["trajectories"] == 2
    assert sum(summary["by_kind"].values()) == sum(summary["by_form"].values()) == summary["pairs"]
    assert summary["pairs"] > 1

    twins = NiehSet(tmp_path / "one")
    assert not twins.skipped
    assert len(twins.questions) == 2 * summary["pairs"]
    assert set(Counter(question.pair for question in twins.questions).values()) == {2}
    names = {name for pair in read_pairs(tmp_path / "one") for name in pair.traj_ids}
    assert {question.traj_id for question in twins.questions} == names
    per_side = Counter(question.traj_id for question in twins.questions)
    assert max(per_side.values()) <= 3

    # Again: the same files, of an earlier run; then with two workers, from the beginning.
    before = content(tmp_path / "one")
    out, _ = read_success(run_cli("twins", data, "--out", tmp_path / "one", *OPTIONS))
    assert "2 trajectories (2 of earlier runs)" in out
    assert content(tmp_path / "one") == before
    other = tmp_path / "two"
    read_success(run_cli("twins", data, "--out", other, *OPTIONS, "--workers", 2))
    assert content(other) == before

    # With another seed the set is not continued.
    code, _, err = run_cli("twins", data, "--out", other, *OPTIONS, "--seed", 1)
    assert code == 1
    assert "made with other kinds, seed or --per-kind" in err


def test_an_unknown_kind_is_one_line(data, tmp_path, run_cli):
    ended = run_cli("twins", data, "--out", tmp_path, "--kinds", "swop")
    assert_refused(ended, "unknown kind of twins 'swop'", "swap")


def test_a_trajectory_that_does_not_replay_is_named_and_the_others_are_made(tmp_path, run_cli):
    good = cut_trajectory(MUG, 4)
    bad = cut_trajectory(FORK, 4)
    calls = [low["api_action"] for low in bad["plan"]["low_actions"]]
    call = next(call for call in calls if call["action"] == "PickupObject")
    call["objectId"] = "Statue|+09.00|+09.00|+09.00"  # which the kitchen lacks
    data = write_trajectories(tmp_path / "data", bad, good)
    options = ("--kinds", "move", "--per-kind", 1, "--json")
    code, out, err = run_cli("twins", data, "--out", tmp_path / "out", *options)
    summary = json.loads(out)
    assert (code, summary["trajectories"], len(summary["failures"])) == (1, 1, 1)
    assert FORK in summary["failures"][0] and "PickupObject" in summary["failures"][0]
    assert "Traceback" not in err


def test_the_same_command_with_unity(data, tmp_path, run_cli, monkeypatch):
    # No Unity is here: the embedded simulator answers in its place, behind the same client.
    monkeypatch.setattr(launch, "unity_launch", lambda: replace(embedded_launch(), label="unity"))
    options = ("--kinds", "state", "--per-kind", 1, "--unity")
    read_success(run_cli("twins", data, "--out", tmp_path, *options))
    assert read_pairs(tmp_path)
    assert json.loads((tmp_path / "set.json").read_text())["simulator"] == "unity"


def test_twins_with_final_tasks_print_their_numbers(data, tmp_path, run_cli):
    # Two short trajectories, after which there is no room for a history of 40 actions.
    out, _ = read_success(run_cli("twins", data, "--out", tmp_path / "agents", "--final-tasks"))
    assert "2 trajectories (0 of earlier runs): 0 of 0 edits kept; 0 pairs of final tasks" in out
    code, out, _ = run_cli("twins", data, "--out", tmp_path / "agents", "--final-tasks", "--json")
    summary = json.loads(out)
    assert (code, summary["resumed"], summary["pairs"]) == (0, 2, 0)
