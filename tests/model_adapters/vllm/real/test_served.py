"""vLLM's own server behind `--model openai`: the replies of the same checkpoint in transformers."""

import os
import subprocess
import sys
from contextlib import contextmanager

import psutil
import pytest

from infthor_eval.errors import ModelError
from infthor_eval.storage.folders import packaged_folder
from model_adapters import load
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_records
from tests.helpers.processes import cli_words
from tests.helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from tests.helpers.waiting import PATIENCE_S, wait_until

from ...asking import up_to
from ...serving import free_port, run_each, wait_for_server

SERVER = "vllm.entrypoints.openai.api_server"
MODEL = str(packaged_folder(NANO_FOLDER))
MOST_FRAMES = 200  # more than a context of `nieh_mini_full` has


@contextmanager
def _server(port, log):
    """vLLM's server with the small trained model, on a port."""
    limits = [
        "--max-model-len",
        "32768",
        "--limit-mm-per-prompt",
        f'{{"image": {MOST_FRAMES}, "video": 0}}',
    ]
    pixels = ["--mm-processor-kwargs", '{"use_fast": false}', "--enable-prompt-tokens-details"]
    where = ["--host", "127.0.0.1", "--port", str(port)]
    command = [
        sys.executable,
        "-m",
        SERVER,
        *option_words(model=MODEL, dtype="float32"),
        "--enforce-eager",
        *limits,
    ]
    environment = os.environ | {
        "VLLM_CPU_KVCACHE_SPACE": "1",
        "VLLM_CPU_OMP_THREADS_BIND": "nobind",
    }
    with log.open("w") as log_file:
        server = subprocess.Popen(
            [*command, *pixels, *where], stdout=log_file, stderr=log_file, env=environment
        )
        try:
            wait_for_server(f"http://127.0.0.1:{port}/health", server, log)
            yield server
        finally:
            server.terminate()
            server.wait()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """The small trained model behind vLLM's server; the options of `--model openai` for it."""
    port = free_port()
    with _server(port, tmp_path_factory.mktemp("served") / "log"):
        yield {"base_url": f"http://127.0.0.1:{port}/v1", "model": MODEL}


@pytest.fixture
def both(served, tmp_path, run_cli):
    """Runs the same tasks behind the server and in this process; the records of both."""

    def both(*arguments, **more):
        here = {"pretrained": served["model"], "device": "cpu", "dtype": "float32"}
        models = {"openai": served | more, "qwen2.5-vl": here}
        return run_each(run_cli, tmp_path / "out", models, *arguments)

    return both


def test_questions_are_answered_as_in_this_process(both):
    behind, here = both("--tasks", "nieh_mini_gt,nieh_mini_full", "--limit", 20)
    assert [record.payload.reply for record in behind] == [record.payload.reply for record in here]
    assert sum(record.tokens.cached or 0 for record in behind) > 0


def test_plans_stop_at_special_tokens(both, tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 3), cut_trajectory(CANDLE, 2))
    behind, here = both("--tasks", "infthor_plans", "--data", data, "--greedy")
    assert [record.payload for record in behind] == [record.payload for record in here]


def test_choices_hold(served, frames):
    model = load("openai", served | {"guided": "vllm"}, 0)
    talk = model.conversation()
    talk.append(frames[0], "Where is the mug?")
    assert talk.reply(up_to(20, choices=("on the table", "in the sink"))).text in (
        "on the table",
        "in the sink",
    )
    model.close()


def test_more_frames_than_the_server_takes_are_refused_with_its_option(served, make_frames):
    model = load("openai", served, 0)
    talk = model.conversation()
    talk.append(*make_frames(MOST_FRAMES + 1, 28, 28), "What is it?")
    with pytest.raises(
        ModelError, match=r"/v1 answers 400 Bad Request: .* --limit-mm-per-prompt .* fewer frames"
    ):
        talk.reply(up_to(4))
    model.close()


def test_a_server_that_dies_costs_nothing_that_was_answered_and_goes_on_once_it_is_back(
    tmp_path, run_cli
):
    port, output = free_port(), tmp_path / "out"
    model_args = f"base_url=http://127.0.0.1:{port}/v1,model={MODEL},retries=1,max_in_flight=1"
    words = option_words(model="openai", model_args=model_args, tasks="nieh_mini_full", limit="40")
    command = cli_words(*words, "--out", output)

    def n_answered():
        lines = [
            line
            for path in output.rglob("worker-*.jsonl")
            for line in path.read_text().splitlines()
        ]
        return sum('"type":"unit"' in line.replace(" ", "") for line in lines)

    with _server(port, tmp_path / "first") as server:
        asking = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        wait_until(lambda: n_answered() >= 5)
        for each in [*psutil.Process(server.pid).children(recursive=True), server]:
            each.kill()
        output_text = asking.communicate(timeout=PATIENCE_S)[0]
    assert asking.returncode == 1, output_text
    assert "Traceback" not in output_text
    before = {record.key: record for record in read_records(output) if record.failure is None}
    assert 5 <= len(before) < 40, "it did not die in the middle"
    with _server(port, tmp_path / "second"):
        code, _, err = run_cli(*words, "--out", output)
    assert code == 0, err
    records = read_records(output)
    assert len(records) == 40
    assert [record.failure for record in records] == [None] * 40
    assert all(
        record.payload == before[record.key].payload for record in records if record.key in before
    )
