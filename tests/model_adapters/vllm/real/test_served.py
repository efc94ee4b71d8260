"""vLLM's own server behind `--model openai`: the replies of the same checkpoint in transformers."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.runs import UnitRecord
from model_adapters import load
from model_adapters.tiny.qwen2_5_vl_nano import FOLDER
from tests.plans.cut import CANDLE, FORK, cut, write

from ...asking import up_to
from ...serving import free_port, records_in, wait_for_server

SERVER = "vllm.entrypoints.openai.api_server"
MOST_FRAMES = 100  # more than a context of `nieh_mini_full` has


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The small trained model behind vLLM's server; the options of `--model openai` for it."""
    log, folder = tmp_path_factory.mktemp("served") / "log", str(packaged_folder(FOLDER))
    port = free_port()
    limits = ["--max-model-len", "32768", "--limit-mm-per-prompt", f'{{"image": {MOST_FRAMES}, "video": 0}}']
    pixels = ["--mm-processor-kwargs", '{"use_fast": false}', "--enable-prompt-tokens-details"]
    where = ["--host", "127.0.0.1", "--port", str(port)]
    command = [sys.executable, "-m", SERVER, "--model", folder, "--dtype", "float32", "--enforce-eager", *limits]
    environment = os.environ | {"VLLM_CPU_KVCACHE_SPACE": "1", "VLLM_CPU_OMP_THREADS_BIND": "nobind"}
    with log.open("w") as said:
        server = subprocess.Popen([*command, *pixels, *where], stdout=said, stderr=said, env=environment)
        try:
            wait_for_server(f"http://127.0.0.1:{port}/health", server, log)
            yield {"base_url": f"http://127.0.0.1:{port}/v1", "model": folder}
        finally:
            server.terminate()
            server.wait()


@pytest.fixture
def both(served: dict[str, str], tmp_path: Path, run: Any) -> Callable[..., list[list[UnitRecord[Any]]]]:
    """Runs the same tasks behind the server and in this process; the records of both."""

    def both(*arguments: object, **more: str) -> list[list[UnitRecord[Any]]]:
        here = {"pretrained": served["model"], "device": "cpu", "dtype": "float32"}
        records = []
        for model, given in (("openai", served | more), ("qwen2.5-vl", here)):
            options = ",".join(f"{name}={value}" for name, value in given.items())
            code, _, err = run(
                *("--model", model, "--model-args", options, "--name", model, "--output", tmp_path / "out"), *arguments
            )
            assert code == 0, err
            records.append(records_in(tmp_path / "out" / model))
        return records

    return both


def test_questions_are_answered_as_in_this_process(both: Callable[..., list[list[UnitRecord[Any]]]]) -> None:
    behind, here = both("--tasks", "nieh_mini_gt,nieh_mini_full", "--limit", 20)
    assert [record.payload.reply for record in behind] == [record.payload.reply for record in here]
    assert sum(record.tokens.cached for record in behind) > 0


def test_plans_stop_at_special_tokens(both: Callable[..., list[list[UnitRecord[Any]]]], tmp_path: Path) -> None:
    data = write(tmp_path / "data", cut(FORK, 3), cut(CANDLE, 2))
    behind, here = both("--tasks", "infthor_plans", "--data", data, "--greedy")
    assert [record.payload for record in behind] == [record.payload for record in here]


def test_choices_hold(served: dict[str, str], frames: list[FrameRef]) -> None:
    model: Any = load("openai", served | {"guided": "vllm"}, 0)
    talk = model.conversation()
    talk.append(frames[0], "Where is the mug?")
    assert talk.reply(up_to(20, choices=("on the table", "in the sink"))).text in ("on the table", "in the sink")
    model.close()


def test_more_frames_than_the_server_takes_are_refused_with_its_option(
    served: dict[str, str], make_frames: Callable[..., list[FrameRef]]
) -> None:
    model: Any = load("openai", served, 0)
    talk = model.conversation()
    talk.append(*make_frames(MOST_FRAMES + 1, 28, 28), "What is it?")
    with pytest.raises(ModelError, match=r"/v1 answers 400 Bad Request: .* --limit-mm-per-prompt .* fewer frames"):
        talk.reply(up_to(4))
    model.close()
