"""An adapter that counts no tokens and knows no ids keeps the contract, and is evaluated like any
other."""

import json
from pathlib import Path

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from model_adapters import check_adapter
from model_adapters.built_in import BUILT_IN, BuiltIn
from tests.model_adapters.toy_adapter import Talk, Toy

from ..helpers.bundled import BUNDLED
from ..helpers.command_line import read_success


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    monkeypatch.setitem(
        BUILT_IN, "toy", BuiltIn(f"{Toy.__module__}:Toy", f"{Toy.__module__}:Options")
    )


def test_it_keeps_the_contract():
    check_adapter(Toy())


def test_it_runs_the_bundled_set(tmp_path, run_cli):
    n = len(NiehSet(BUNDLED).questions)
    out, err = read_success(run_cli("--model", "toy", "--tasks", "nieh_mini", "--out", tmp_path))
    assert f"toy: {2 * n} evaluated now" in err
    (results,) = tmp_path.rglob("results.json")
    tasks = json.loads(results.read_text())["summary"]["tasks"]
    assert {name: task["n"] for name, task in tasks.items()} == {
        "nieh_mini_gt": n,
        "nieh_mini_full": n,
    }
    row = next(line.split() for line in out.splitlines() if line.split()[:1] == ["toy"])
    assert row[-1] == str(n)
    again = run_cli("--model", "toy", "--tasks", "nieh_mini", "--out", tmp_path)[2]
    assert f"0 evaluated now, {2 * n} resumed" in again


def test_an_error_in_its_code_has_its_place_and_its_traceback_is_kept(
    make_nieh_set, tmp_path, run_cli, monkeypatch
):
    def reply(self, decoding):
        return self.turns[0].parts[99]

    monkeypatch.setattr(Talk, "reply", reply)
    data = make_nieh_set(size=56)
    code, _, err = run_cli(
        "--model", "toy", "--tasks", "nieh_gt", "--data", data, "--out", tmp_path / "out"
    )
    place = f"{Path(__file__).name}:{reply.__code__.co_firstlineno + 1} (reply)"
    failure = (
        f"toy fails on the request (IndexError in {place}: tuple index out of range); fix the "
        "adapter, or report it"
    )
    assert code == 1
    assert (
        f"nieh_gt: 5 sample(s) failed, in no score: {failure}; traceback in "
        "journal/tracebacks.txt" in err
    )
    (text,) = [path.read_text() for path in (tmp_path / "out").rglob("journal/tracebacks.txt")]
    assert text.count("Traceback (most recent call last)") == 1
    assert text.count("\nas for nieh_gt: ") == 4
    assert "in reply\n    return self.turns[0].parts[99]\n" in text
