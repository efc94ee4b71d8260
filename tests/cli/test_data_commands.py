"""generate, replay and questions, one after the other as a person types them."""

import json
import shutil

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import read_questions


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return tmp_path_factory.mktemp("made")


def test_the_three_commands_make_a_set(made, run):
    scene = ("--scene", "kitchen-5", "--min-steps", 60, "--seed", 1)
    code, out, err = run("generate", *scene, "--out", made / "trajectories", "--json")
    assert code == 0, err
    assert json.loads(out)["trajectories"] == 1

    code, out, err = run("replay", made / "trajectories", "--out", made / "set", "--json")
    document = json.loads(out)
    assert code == 0, err
    assert document["whole"] == document["trajectories"] == 1
    assert document["actions"]["MoveAhead"]["refused"] == 0
    assert {"iou", "seconds"} <= set(document)

    csv = made / "set/qa_set_mine.csv"
    code, out, _ = run("questions", made / "set", "--out", csv, "--per-trajectory", 12)
    assert code == 0
    assert "12 questions on 1 trajectories" in out
    assert len(read_questions(csv)) == 12
    first = csv.read_bytes()
    run("questions", made / "set", "--out", csv, "--per-trajectory", 12)
    assert csv.read_bytes() == first


def test_what_they_print_for_people(made, tmp_path, run):
    code, out, _ = run("replay", made / "trajectories", "--out", made / "set")
    assert code == 0
    assert "1 trajectories on 1 floor plans (1 replayed earlier, 0 failed), 1 whole" in out
    assert "MoveAhead" in out
    code, out, _ = run("generate", "--scene", "kitchen-5", "--min-steps", 1, "--out", tmp_path)
    assert code == 0
    assert "1 trajectories (0 made earlier)" in out


def test_a_truncated_trajectory_is_named_and_nothing_half_written(made, tmp_path, run):
    source = next((made / "trajectories").glob("*.json"))
    (tmp_path / "cut.json").write_bytes(source.read_bytes()[:-100])
    code, _, err = run("replay", tmp_path / "cut.json", "--out", tmp_path / "set")
    assert code == 1
    assert "cut.json: not a trajectory" in err
    assert not list((tmp_path / "set/metadata").iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("replay", "nowhere.jsonl", "--out", "set"), "nowhere.jsonl"),
        (("questions", "nowhere", "--out", "qa.csv"), "no trajectory there"),
        (("generate", "--scene", "nowhere-1", "--out", "out"), "nowhere-1"),
    ],
)
def test_bad_input_is_one_line(arguments, words, tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*arguments)
    assert code in {1, 2}
    assert words in err
    assert "Traceback" not in err


def test_bathrooms_are_left_out_of_test_sets(tmp_path, run):
    code, _, err = run("generate", "--scene", "bathroom-1", "--test-set", "--out", tmp_path)
    assert code == 2
    assert "bathrooms are left out" in err


def test_a_replayed_set_is_an_nieh_set(made, run):
    shutil.rmtree(made / "set/metadata/.nothing", ignore_errors=True)
    assert NiehSet(made / "set")
