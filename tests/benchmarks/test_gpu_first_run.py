"""The first run on a GPU: steps, resuming, failures, the page, and a rehearsal from end to end."""

import importlib
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import psutil
import pytest

from infthor_eval.plugins import import_target

from ..helpers.benchmarks import FOLDER
from ..helpers.waiting import wait_until

SCRIPT = FOLDER / "gpu_first_run.py"


@pytest.fixture(scope="module")
def script() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        yield importlib.import_module("gpu_first_run")


@pytest.fixture
def machine(script):
    return script.Machine(
        device="cuda",
        name="H100",
        gpus=1,
        memory_gib=79.0,
        tiny=False,
        checkpoint=None,
        data=None,
        download=False,
        old_libraries=None,
        flash=False,
        frames=1040,
    )


class Steps:
    """Steps of which one fails in its first call, and what was called."""

    def __init__(self, script) -> None:
        self.called: list[str] = []
        self._script = script
        outcome = importlib.import_module("first_run.outcome").Outcome
        self.all = (
            self._step("first", lambda _: outcome("one | two", True, {"rate": 3})),
            self._step("breaks", self._break),
            self._step("reads", lambda work: outcome(f"rate {work.earlier['first']['rate']}")),
            self._step("lacks", lambda _: outcome("never"), lambda _: "no such thing here"),
        )

    def _step(self, name, run, missing=lambda _: None):
        def called(work):
            self.called.append(name)
            return run(work)

        return self._script.Step(name, "Why?", "3", 7, missing, called)

    def _break(self, _):
        if self.called.count("breaks") == 1:
            raise ValueError("not\na number")
        return importlib.import_module("first_run.outcome").Outcome("wrong", False)


@pytest.fixture
def steps(script):
    return Steps(script)


def states(results) -> list[str]:
    return [result.state for result in results]


def test_thirteen_steps_take_less_than_an_hour(script):
    assert len(script.STEPS) == len({step.name for step in script.STEPS}) == 13
    assert sum(step.seconds for step in script.STEPS) <= 3600


def test_a_failing_step_stops_no_other_and_is_on_the_page(script, machine, steps, tmp_path):
    results = script.run_steps(machine, tmp_path, 60, steps=steps.all)
    assert states(results) == ["done", "failed", "done", "not run"]
    assert [result.text for result in results[1:]] == [
        "not a number",
        "rate 3",
        "no such thing here",
    ]
    page = (tmp_path / "page.md").read_text()
    assert "**2 of 4 steps done" in page and "1 failed, 1 not run.**" in page
    assert "| one \\| two | yes |" in page
    assert "| failed: not a number | - |" in page
    assert "| rate 3 | see |" in page
    assert "| not run: no such thing here | - | - |" in page


def test_the_same_command_goes_on_where_it_stopped(script, machine, steps, tmp_path):
    script.run_steps(machine, tmp_path, 60, chosen={1, 2}, steps=steps.all)
    assert steps.called == ["first", "breaks"]
    results = script.run_steps(machine, tmp_path, 60, steps=steps.all)
    assert steps.called == ["first", "breaks", "breaks", "reads"]
    assert states(results) == ["done", "done", "done", "not run"]
    assert "| wrong | **NO** |" in (tmp_path / "page.md").read_text()


def test_results_of_another_machine_do_not_count(script, machine, steps, tmp_path):
    script.run_steps(machine, tmp_path, 60, chosen={1}, steps=steps.all)
    script.run_steps(replace(machine, flash=True), tmp_path, 60, chosen={1}, steps=steps.all)
    assert steps.called == ["first", "first"]


def test_data_that_are_given_later_undo_nothing_and_weights_do(script, machine, steps, tmp_path):
    script.run_steps(machine, tmp_path, 60, chosen={1}, steps=steps.all)
    later = replace(machine, data=Path("set"), old_libraries="old")
    script.run_steps(later, tmp_path, 60, chosen={1}, steps=steps.all)
    assert steps.called == ["first"]
    other = replace(machine, data=Path("other"), old_libraries="old")
    script.run_steps(later, tmp_path, 60, chosen={2}, steps=steps.all)
    script.run_steps(later, tmp_path, 60, chosen={2}, steps=steps.all)  # it failed before
    script.run_steps(other, tmp_path, 60, chosen={1, 2}, steps=steps.all)
    assert steps.called == ["first", "breaks", "breaks", "breaks"], "the last had other data"
    weights = replace(machine, checkpoint="Q")
    script.run_steps(weights, tmp_path, 60, chosen={1}, steps=steps.all)
    assert steps.called[4:] == ["first"], "some steps take real weights where there are any"


def test_no_step_begins_when_the_time_is_up(script, machine, steps, tmp_path):
    results = script.run_steps(machine, tmp_path, 0, steps=steps.all)
    assert steps.called == []
    assert results[0].text.startswith("no time left")


def test_a_damaged_result_is_one_line(script, machine, steps, tmp_path):
    script.run_steps(machine, tmp_path, 60, chosen={1}, steps=steps.all)
    (tmp_path / "01" / "result.json").write_text("{")
    with pytest.raises(script.InfthorError, match="delete it, and the step is done again"):
        script.run_steps(machine, tmp_path, 60, steps=steps.all)


def test_one_gpu_without_weights_runs_what_it_can(script, machine):
    missing = {step.name: step.missing(machine) for step in script.STEPS}
    assert [name for name, why in missing.items() if why] == [
        "the real model",
        "whole trajectories",
        "one model on several GPUs",
        "policies",
        "cost",
    ]
    assert missing["one model on several GPUs"] == "needs 2 GPUs, and there is 1"
    whole = replace(
        machine, checkpoint="Q", data=Path("set"), gpus=2, old_libraries="old", flash=True
    )
    assert not any(step.missing(whole) for step in script.STEPS)
    no_data = replace(whole, data=None)
    assert [step.name for step in script.STEPS if step.missing(no_data)] == [
        "the real model",
        "cost",
    ]


def test_a_gpu_is_timed_without_the_kernel_that_plans_each_length(script, machine):
    kernels = importlib.import_module("first_run.speeds")._kernels
    assert list(kernels(machine)) == ["sdpa", "sdpa without cuDNN"]
    assert list(kernels(replace(machine, flash=True))) == [
        "sdpa",
        "flash_attention_2",
        "sdpa without cuDNN",
    ]
    assert list(kernels(replace(machine, device="cpu"))) == ["sdpa"]


@pytest.mark.parametrize(
    ("margins", "expected"), [((0.5, 0.002), 0.002), ((0.5,), None), ((), None)]
)
def test_replies_part_at_a_margin_if_it_was_recorded(script, margins, expected):
    run = importlib.import_module("first_run.work").Run

    def of(reply, ids):
        payload = SimpleNamespace(reply=reply, reply_ids=ids, margins=margins)
        return run("m", [SimpleNamespace(key="q", payload=payload)])

    assert of("a b", (1, 2)).parting_margin(of("a c", (1, 3))) == expected
    assert of("a b", (1, 2)).parting_margin(of("a b", (1, 2))) is None


def test_commands_of_the_real_model_are_commands_that_there_are(
    script, machine, tmp_path, monkeypatch
):
    module = importlib.import_module("first_run.work")
    typed = []

    def record(self, words, codes):
        typed.append(words[2:] if words[:2] == module.INFTHOR_EVAL else ())
        raise module.StepFailed("not run in this test")

    monkeypatch.setattr(module.Work, "_run", record)
    there = tmp_path / "there"
    (there / "metadata").mkdir(parents=True)
    for data in (there, tmp_path / "to-be-downloaded"):
        whole = replace(
            machine, checkpoint="Q", data=data, gpus=2, old_libraries="old", download=True
        )
        for step in script.STEPS:
            with pytest.raises(module.StepFailed):
                step.run(module.Work(whole, tmp_path / "work", time.monotonic() + 60))
    asked = list(filter(None, typed))
    assert ("fetch", "nieh", "--out", str(data)) in asked
    assert {words[0] for words in asked} == {"--model", "fetch", "plan"}
    for words in asked:
        name, *rest = ("run", *words) if words[0] == "--model" else words
        target = import_target(f"infthor_eval.cli.commands.{name}:command")
        assert target.make_context(name, rest).params


def test_a_command_is_stopped_with_its_children_when_the_time_is_up(machine, tmp_path, script):
    module = importlib.import_module("first_run.work")
    work = module.Work(machine, tmp_path, time.monotonic() + 3)
    child = tmp_path / "child"
    child = tmp_path / "child"
    sleeps = (
        "import os, pathlib, sys, time; pathlib.Path(sys.argv[1]).write_text(str(os.getpid()));"
    )
    starts = "import subprocess, sys; subprocess.run([sys.executable, '-c', *sys.argv[1:]])"
    with pytest.raises(module.StepFailed, match="the step's time"):
        work.python("-c", starts, f"{sleeps} time.sleep(99)", str(child))
    wait_until(lambda: has_ended(int(child.read_text())))


def has_ended(process: int) -> bool:
    try:
        return psutil.Process(process).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def test_a_command_that_fails_says_its_last_line(machine, tmp_path, script):
    module = importlib.import_module("first_run.work")
    work = module.Work(machine, tmp_path, time.monotonic() + 60)
    with pytest.raises(module.StepFailed, match="exit code 1: no room"):
        work.python("-c", "import sys; print('begins'); sys.exit('no room')")
    with (
        pytest.raises(module.StepFailed, match="ended with 1: no port"),
        work.server(["-c", "import sys; sys.exit('no port')"], 9, {}),
    ):
        pass


def test_a_cpu_rehearses_and_does_nothing_else(script, capsys):
    with pytest.raises(SystemExit):
        script.main(["--out", "x", "--device", "cpu"])
    with pytest.raises(SystemExit):
        script.main(["--out", "x", "--device", "cpu", "--tiny", "--steps", "14"])
    errors = capsys.readouterr().err
    assert "--device cpu needs --tiny" in errors
    assert "'14' is not a number from 1 to 13" in errors
    assert script.main(["--out", "x", "--device", "cpu", "--tiny", "--list"]) == 0
    assert capsys.readouterr().out.count("\n") == 13


@pytest.mark.slow
@pytest.mark.timeout(2400)
def test_a_rehearsal_from_end_to_end(tmp_path):
    command = [sys.executable, SCRIPT, "--out", tmp_path, "--device", "cpu", "--tiny"]
    first = subprocess.run(command, capture_output=True, text=True, check=False)
    assert first.returncode == 0, first.stderr
    page = (tmp_path / "page.md").read_text()
    assert "**12 of 13 steps done" in page and "0 of them not as expected; 0 failed, 1 not" in page
    assert "not run: needs the libraries" in page
    again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert again.stderr == "12/13 policies\n"
