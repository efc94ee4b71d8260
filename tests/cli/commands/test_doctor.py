"""`doctor`: what is installed and what is missing, with a hint, and no token in it."""

import json
import time

import pytest

from infthor_eval.cli.commands import doctor as checks

TOKEN = "hf_of_nobody_0123456789"


@pytest.fixture(autouse=True)
def offline(monkeypatch):
    """The hub takes its time, as where a name cannot be looked up."""
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", False)
    monkeypatch.setattr(checks, "_HUB_TIMEOUT_S", 0.1)
    monkeypatch.setattr(checks, "_connection_problem", lambda url: time.sleep(5) or "")


def test_everything_is_checked_and_what_is_missing_has_a_hint(run, monkeypatch):
    monkeypatch.setenv("HF_TOKEN", TOKEN)
    code, out, err = run("doctor", "--json")
    assert (code, err) == (0, "")
    by_name = {check["name"]: check for check in json.loads(out)}
    assert {"Python", "torch", "memory", "embedded simulator", "AI2-THOR", "display", "hub token", "hub"} <= set(
        by_name
    )
    assert {"disk, here", "disk, cache", "NIEH data", *(f"extra {name}" for name in checks._EXTRAS)} <= set(by_name)
    assert all(check["hint"] for check in by_name.values() if check["state"] != "ok")
    assert by_name["hub"]["detail"].endswith("cannot be reached (no answer in 0.1 s)")
    assert by_name["hub token"] == {"name": "hub token", "state": "ok", "detail": "stored", "hint": ""}
    assert "fetch nieh" in by_name["NIEH data"]["hint"]
    assert TOKEN not in out


def test_people_read_lines(run):
    code, out, _ = run("doctor")
    assert code == 0
    assert any(line.startswith("ok       Python: 3.") for line in out.splitlines())
    assert "`infthor-eval fetch nieh`" in out


def test_a_missing_requirement_sets_the_exit_code(run, monkeypatch):
    monkeypatch.setattr(checks, "_torch", lambda: checks.Check("torch", "wrong", "none", "pip install torch"))
    code, out, _ = run("doctor")
    assert code == 1
    assert "wrong    torch: none\n         pip install torch" in out


@pytest.mark.parametrize("url", ["http://localhost:9", "no address"])
def test_a_hub_that_refuses_is_reported_at_once(url, monkeypatch):
    monkeypatch.undo()
    assert checks._connection_problem(url)
