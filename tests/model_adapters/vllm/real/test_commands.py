"""Whole runs in real vLLM, as their user types them, on the small trained model: equal to those in
transformers."""

import os
import random
import signal
import subprocess
from pathlib import Path

import pytest

from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_records
from tests.helpers.processes import cli_words
from tests.helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from tests.helpers.waiting import PATIENCE_S, wait_until

ENGINES = ("vllm", "transformers")


def _arguments(engine, output, *more):
    model_args = f"pretrained={packaged_folder(NANO_FOLDER)},dtype=float32"
    model_args += ",enforce_eager=true" if engine == "vllm" else ",device=cpu"
    typed = [
        *option_words(model="qwen2.5-vl", engine=engine, model_args=model_args, out=output),
        *more,
    ]
    return list(map(str, typed))


@pytest.fixture
def run_engine(run_cli, tmp_path, monkeypatch):
    """Runs a command with one of the engines; its records."""
    monkeypatch.setenv("VLLM_CPU_KVCACHE_SPACE", "1")

    def run_engine(engine, *more):
        output = tmp_path / engine / str(random.getrandbits(32))
        code, _, err = run_cli(*_arguments(engine, output, *more))
        assert code == 0, err
        return read_records(output)

    return run_engine


def test_questions_are_answered_alike(run_engine):
    ours, theirs = (
        run_engine(engine, "--tasks", "nieh_mini_gt,nieh_mini_full", "--limit", 40)
        for engine in ENGINES
    )
    assert [record.payload for record in ours] == [record.payload for record in theirs]
    assert [record.tokens.context for record in ours] == [
        record.tokens.context for record in theirs
    ]
    read, cached = (
        sum(getattr(record.tokens, name) for record in ours) for name in ("context", "cached")
    )
    assert cached > 0.5 * read


def test_switches_are_tried_before_the_run(run_cli, tmp_path, monkeypatch):
    monkeypatch.setenv("VLLM_CPU_KVCACHE_SPACE", "1")
    tasks = ("--tasks", "nieh_mini_gt", "--limit", 6, "--check-equality", 6)
    switches = "max_num_batched_tokens=256,kv_cache_dtype=fp8"
    arguments = _arguments("vllm", tmp_path / "out", *tasks)
    at = arguments.index("--model-args") + 1
    arguments[at] += f",{switches}"
    code, _, err = run_cli(*arguments)
    assert code == 0, err
    assert f"6 replies are equal with and without {switches}" in " ".join(err.split())
    assert len(read_records(tmp_path / "out")) == 6


@pytest.mark.parametrize("more", [("--greedy",), ("--greedy", "--constrained")])
def test_plans_are_carried_out_alike(more, run_engine, tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 6), cut_trajectory(CANDLE, 4))
    ours, theirs = (
        run_engine(engine, "--tasks", "infthor_plans", "--data", data, *more) for engine in ENGINES
    )
    assert len(ours) == 10
    assert [record.payload for record in ours] == [record.payload for record in theirs]


def test_two_workers_answer_as_one(run_engine):
    one, two = (
        run_engine("vllm", "--tasks", "nieh_mini_gt", "--limit", 24, *more)
        for more in ((), ("--workers", 2))
    )
    assert {record.key: record.payload for record in one} == {
        record.key: record.payload for record in two
    }


def test_plans_are_carried_out_by_workers(run_engine, tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 3), cut_trajectory(CANDLE, 3))
    words = ("--tasks", "infthor_plans", "--data", data, "--greedy")
    one, two = (run_engine("vllm", *words, *more) for more in ((), ("--workers", 2)))
    assert {record.key: record.payload for record in one} == {
        record.key: record.payload for record in two
    }


def test_a_run_that_was_killed_goes_on(run_engine, tmp_path):
    words = ("--tasks", "nieh_mini_full", "--limit", 40)
    output = tmp_path / "killed"
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[4])}
    command = cli_words(*_arguments("vllm", output, *words))

    def n_lines():
        return sum(path.read_bytes().count(b"\n") for path in output.rglob("worker-0.jsonl"))

    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    )
    wait_until(lambda: n_lines() >= 5 or process.poll() is not None)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert 5 <= n_lines() < 40, "it was not killed in the middle"
    again = subprocess.run(
        command, capture_output=True, text=True, env=environment, timeout=PATIENCE_S, check=False
    )
    assert again.returncode == 0, again.stderr
    assert "resumed from the journal" in again.stderr + again.stdout
    assert [record.payload for record in read_records(output)] == [
        record.payload for record in run_engine("vllm", *words)
    ]
