"""`doctor`: what is there and what is not, each with its mend, and no token in it."""

import json
import time

import pytest

from infthor_eval.cli.commands import doctor as checks

TOKEN = "hf_of_nobody_0123456789"


@pytest.fixture(autouse=True)
def offline(monkeypatch):
    """The hub takes its time, as where a name cannot be looked up."""
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", False)
    monkeypatch.setattr(checks, "_PATIENCE_S", 0.1)
    monkeypatch.setattr(checks, "_reached", lambda url: time.sleep(5) or "")


def test_everything_is_looked_at_and_what_is_missing_has_its_mend(run, monkeypatch):
    monkeypatch.setenv("HF_TOKEN", TOKEN)
    code, out, err = run("doctor", "--json")
    assert (code, err) == (0, "")
    found = {check["name"]: check for check in json.loads(out)}
    assert {"Python", "torch", "memory", "embedded simulator", "AI2-THOR", "display", "hub token", "hub"} <= set(found)
    assert {"disk, here", "disk, cache", "NIEH data", *(f"extra {name}" for name in checks._EXTRAS)} <= set(found)
    assert all(check["mend"] for check in found.values() if check["state"] != "ok")
    assert found["hub"]["found"].endswith("cannot be reached (no answer in 0.1 s)")
    assert found["hub token"] == {"name": "hub token", "state": "ok", "found": "there is one", "mend": ""}
    assert "fetch nieh" in found["NIEH data"]["mend"]
    assert TOKEN not in out


def test_people_read_lines(run):
    code, out, _ = run("doctor")
    assert code == 0
    assert any(line.startswith("ok       Python: 3.") for line in out.splitlines())
    assert "`infthor-eval fetch nieh`" in out


def test_what_nothing_will_do_without_is_told_by_the_exit_code(run, monkeypatch):
    monkeypatch.setattr(checks, "_torch", lambda: checks.Check("torch", "wrong", "none", "pip install torch"))
    code, out, _ = run("doctor")
    assert code == 1
    assert "wrong    torch: none\n         pip install torch" in out


@pytest.mark.parametrize("url", ["http://localhost:9", "no address"])
def test_a_hub_that_refuses_is_told_at_once(url, monkeypatch):
    monkeypatch.undo()
    assert checks._reached(url)
