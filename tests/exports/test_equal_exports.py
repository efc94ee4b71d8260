"""An export says nothing of when it was made: those of one run are equal, byte for byte."""

import time

import pytest

FORMATS = {
    "every-eval-ever": (),
    "inspect": (),
    "inspect, with frames": ("--frames",),
    "hf-eval-results": ("--dataset", "lab/set"),
}


def contents(folder):
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.parametrize("suite", ["nieh", "plans", "manipulation"])
@pytest.mark.parametrize("name", FORMATS)
def test_exports_of_one_run_are_equal(runs, tmp_path, run_cli, monkeypatch, name, suite):
    found = []
    for day in (0, 40):
        out = tmp_path / f"{day}"
        later = time.time() + 86400 * day
        monkeypatch.setattr(time, "time", lambda later=later: later)
        command = ("export", runs[suite], "--format", name.partition(",")[0], "--out", out)
        assert run_cli(*command, *FORMATS[name])[0] == 0
        monkeypatch.undo()
        found.append(contents(out))
    assert found[0] == found[1]
    assert found[0]


def test_what_a_run_writes_for_lm_eval_is_written_once(twin_set, tmp_path, run_cli):
    command = ("run", "--model", "random", "--tasks", "nieh_gt", "--data", twin_set)
    found = []
    for _ in range(2):
        assert run_cli(*command, "--output", tmp_path)[0] == 0
        (folder,) = tmp_path.rglob("lm_eval")
        found.append(contents(folder))
    assert found[0] == found[1]
    assert len(found[0]) == 2
