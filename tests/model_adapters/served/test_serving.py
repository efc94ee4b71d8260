"""The adapter against a server that nobody here wrote: transformers' own, with a tiny checkpoint on
the CPU."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.nieh_set import NiehSet
from model_adapters import check_adapter, load
from tests.helpers.bundled import BUNDLED
from tests.helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories

from ..asking import up_to
from ..checkpoints import save
from ..serving import free_port, run_each, wait_for_server

for package in ("fastapi", "uvicorn", "multipart", "openai"):
    pytest.importorskip(
        package, reason="what `transformers serve` needs is not installed (pip install -e '.[dev]')"
    )

SERVE = "from transformers.cli.transformers import main; main()"
WITHOUT_STOP = {"send_stop": "false"}  # this server fails on stop strings for models with images
WITHOUT_PENALTY = {"send_repetition_penalty": "false"}  # it refuses the field


class Served(NamedTuple):
    """A checkpoint, and the server that it is behind."""

    url: str
    folder: Path

    @property
    def options(self):
        return {"base_url": self.url, "model": str(self.folder)}


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    root = tmp_path_factory.mktemp("served")
    folder = root / "idefics3"
    save("idefics3", folder)
    # Without do_sample this server draws at no temperature.
    settings = folder / "generation_config.json"
    settings.write_text(json.dumps(json.loads(settings.read_text()) | {"do_sample": True}))
    port = free_port()
    command = [sys.executable, "-c", SERVE, "serve", "--host", "127.0.0.1", "--port", str(port)]
    environment = os.environ | {
        "HF_HUB_OFFLINE": "1",
        "HF_HOME": str(root / "home"),
        "OMP_NUM_THREADS": "1",
    }
    with (root / "log").open("w") as log:
        server = subprocess.Popen(
            [*command, "--device", "cpu", "--dtype", "float32"],
            stdout=log,
            stderr=log,
            env=environment,
        )
        try:
            wait_for_server(f"http://127.0.0.1:{port}/health", server, root / "log")
            yield Served(f"http://127.0.0.1:{port}/v1", folder)
        finally:
            server.send_signal(signal.SIGKILL)
            server.wait()


@pytest.fixture
def both(served, tmp_path, run_cli):
    """Runs the same tasks behind the server and in this process; gives the records of both."""

    def both(*arguments, **more):
        here = {"pretrained": served.folder, "device": "cpu", "dtype": "float32"}
        models = {"openai": served.options | more, "hf-vlm": here | {"max_tokens": 100_000}}
        return run_each(run_cli, tmp_path / "out", models, *arguments)

    return both


def test_it_keeps_the_contract(served):
    model = load("openai", served.options | WITHOUT_STOP, 0)
    check_adapter(model)
    model.close()


def test_questions_are_answered_as_in_this_process(both):
    behind, here = both("--tasks", "nieh_mini", "--limit", 3)
    assert len(behind) == 6
    assert [record.payload for record in behind] == [record.payload for record in here]
    assert [record.tokens.context for record in behind] == [
        record.tokens.context for record in here
    ]
    assert any(record.payload.reply for record in behind)
    assert not any(record.faults for record in behind)


def test_plans_are_carried_out_as_in_this_process(both, tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 2), cut_trajectory(CANDLE, 2))
    behind, here = both(
        "--tasks", "infthor_plans", "--data", data, "--greedy", **WITHOUT_STOP, **WITHOUT_PENALTY
    )
    assert len(behind) == 4
    assert [record.payload for record in behind] == [record.payload for record in here]
    assert {record.usage.requests for record in behind} == {
        len(record.payload.steps) for record in behind
    }


def test_all_bundled_questions_are_answered_alike(both):
    behind, here = both("--tasks", "nieh_mini")
    assert len(behind) == 2 * len(NiehSet(BUNDLED).questions)
    assert [record.payload for record in behind] == [record.payload for record in here]


def test_bundled_plans_are_carried_out_alike(both):
    behind, here = both(
        "--tasks", "infthor_plans_mini", "--limit", 2, "--greedy", **WITHOUT_STOP, **WITHOUT_PENALTY
    )
    assert len(behind) > 40
    # A server counts the tokens of requests alone, not those of a history that it is not asked.
    uncounted = [msgspec.structs.replace(record.payload, clue_tokens=None) for record in here]
    assert [record.payload for record in behind] == uncounted


def test_turns_and_systems_are_taken(served, frames):
    models = [
        load("openai", served.options, 0),
        load("hf-vlm", {"pretrained": str(served.folder), "device": "cpu", "dtype": "float32"}, 0),
    ]
    replies = []
    for model in models:
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], "and", frames[1], "\nWhat is it?")
        first = talk.reply(up_to(6))
        talk.append(first.text, role="assistant")
        talk.append("\nAnd this?", frames[2])
        replies.append((first.text, first.n_context_tokens, talk.reply(up_to(6)).text))
        model.close()
    assert replies[0] == replies[1]


def test_what_the_server_refuses_is_one_line(served, tmp_path):
    model = load("openai", served.options | {"model": str(tmp_path / "none"), "retries": "0"}, 0)
    talk = model.conversation()
    talk.append("What is it?")
    with pytest.raises(
        ModelError, match=r"/v1 answers 500 Internal Server Error: .*; see the server's log"
    ):
        talk.reply(up_to(4))
    model.close()
