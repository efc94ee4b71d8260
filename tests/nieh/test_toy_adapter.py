"""An adapter that counts no tokens and knows no ids keeps the contract, and is evaluated like any other."""

import json

import pytest

from model_adapters import check_adapter
from model_adapters.built_in import BUILT_IN, BuiltIn
from tests.model_adapters.toy_adapter import Toy


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    monkeypatch.setitem(BUILT_IN, "toy", BuiltIn(f"{Toy.__module__}:Toy", f"{Toy.__module__}:Options"))


def test_it_keeps_the_contract():
    check_adapter(Toy())


def test_it_runs_the_bundled_set(tmp_path, run):
    code, out, err = run("--model", "toy", "--tasks", "nieh_mini", "--output", tmp_path)
    assert code == 0, err
    assert "toy: 294 evaluated now" in err
    (results,) = tmp_path.rglob("results.json")
    tasks = json.loads(results.read_text())["summary"]["tasks"]
    assert {name: task["n"] for name, task in tasks.items()} == {"nieh_mini_gt": 147, "nieh_mini_full": 147}
    row = next(line.split() for line in out.splitlines() if line.split()[:1] == ["toy"])
    assert row[-1] == "147"
    assert "0 evaluated now, 294 resumed" in run("--model", "toy", "--tasks", "nieh_mini", "--output", tmp_path)[2]


def test_a_context_that_is_measured_in_tokens_wants_their_number(make_nieh_set, tmp_path, run):
    data = make_nieh_set(n_frames=70, size=56)
    arguments = ["--model", "toy", "--tasks", "nieh_truncate_head_8k", "--data", data, "--output", tmp_path / "out"]
    code, _, err = run(*arguments)
    assert (code, len(err.strip().splitlines())) == (2, 1)
    assert "a size in tokens, which toy does not count; give --tokens-per-frame" in err
    assert run(*arguments, "--tokens-per-frame", 500)[0] == 0
    (samples,) = (tmp_path / "out").rglob("samples_*.jsonl")
    assert {len(json.loads(line)["doc"]["frames"]) for line in samples.read_text().splitlines()} == {16}
