import json

import pytest


def test_two_runs_are_compared_question_by_question(make_nieh_set, tmp_path, run):
    data = make_nieh_set(size=56)
    run("--model", "oracle,blind", "--tasks", "nieh_gt", "--data", data, "--output", tmp_path)
    (oracle,), (blind,) = (list((tmp_path / name).iterdir()) for name in ("oracle", "blind"))
    code, out, _ = run("compare", blind, oracle)
    rows = [line.split() for line in out.splitlines()]
    assert code == 0
    (row,) = [row for row in rows if row[:2] == ["nieh_gt", "strict"]]
    assert row[3] == "100.00"
    assert float(row[4]) == pytest.approx(100 - float(row[2]), abs=0.01)
    assert row[-2:] == ["5", "0"]
    code, out, _ = run("compare", oracle, oracle)
    assert "+0.00" in out
    assert "1.0000" in out


def test_runs_without_a_shared_unit_and_folders_without_a_run_are_refused(make_nieh_set, tmp_path, run):
    data = make_nieh_set(size=56)
    for task in ("nieh_gt", "nieh_full"):
        run("--model", "oracle", "--tasks", task, "--data", data, "--output", tmp_path)
    folders = sorted((tmp_path / "oracle").iterdir())
    code, _, err = run("compare", *folders)
    assert (code, len(err.splitlines())) == (2, 1)
    assert "share no unit of the same task" in err
    code, _, err = run("compare", tmp_path, folders[0])
    assert (code, len(err.splitlines())) == (2, 1)
    assert f"{tmp_path}: no journal in it; give the folder of a run" in err


def test_a_run_of_an_earlier_version_is_refused_in_one_line(make_nieh_set, tmp_path, run):
    run("--model", "oracle", "--tasks", "nieh_gt", "--data", make_nieh_set(size=56), "--output", tmp_path / "out")
    (ours,) = (tmp_path / "out" / "oracle").iterdir()
    old = tmp_path / "old"
    old.mkdir()
    (old / "journal.jsonl").write_text(json.dumps({"format": 1, "identity": {"model": {"name": "oracle"}}}) + "\n")
    for folders in ((old, ours), (ours, old)):
        code, out, err = run("compare", *folders)
        assert (code, out, len(err.splitlines())) == (2, "", 1)
        assert f"{old}: its journal is of format 1, this version reads 3; run the evaluation again" in err


def test_runs_of_one_name_are_told_apart_by_their_folders(make_nieh_set, tmp_path, run):
    data = make_nieh_set(size=56)
    for seed in (0, 1):
        arguments = ["--model", "random", "--tasks", "nieh_gt", "--data", data, "--output", tmp_path, "--seed", seed]
        assert run(*arguments)[0] == 0
    first, second = sorted((tmp_path / "random").iterdir())
    code, out, _ = run("compare", first, second)
    assert code == 0
    assert f"random ({second.name}) against random ({first.name})" in " ".join(out.split())
