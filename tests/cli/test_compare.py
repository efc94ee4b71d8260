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


def test_runs_without_a_shared_question_and_folders_without_a_run_are_refused(make_nieh_set, tmp_path, run):
    data = make_nieh_set(size=56)
    for task in ("nieh_gt", "nieh_full"):
        run("--model", "oracle", "--tasks", task, "--data", data, "--output", tmp_path)
    folders = sorted((tmp_path / "oracle").iterdir())
    code, _, err = run("compare", *folders)
    assert (code, len(err.splitlines())) == (2, 1)
    assert "share no question" in err
    code, _, err = run("compare", tmp_path, folders[0])
    assert (code, len(err.splitlines())) == (2, 1)
    assert "journal.jsonl: cannot be read" in err
