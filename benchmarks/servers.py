"""Are replies behind other people's servers those of the same checkpoint in this process?

All questions of `nieh_mini` and all plans of `infthor_plans_mini`, greedy and in float32, of the
small trained model: behind vLLM's server and `transformers serve`, through `--model openai`, and in
vLLM and transformers here.

    make test-vllm                      # once: the environment with vLLM
    .venv-vllm/bin/python benchmarks/servers.py --engines "vLLM, here" "vLLM's server"
    make .venv/test-peers               # once: half of torchvision (transformers_server.py)
    .venv/bin/python benchmarks/servers.py --engines "transformers serve"
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from served import Served, serve_transformers, serve_vllm

from infthor_eval.runs import read_run
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.suites import find_suite
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER

TASKS = {"nieh": "nieh_mini", "plans": "infthor_plans_mini"}
HERE = "transformers, here"
ENGINES = (HERE, "vLLM, here", "vLLM's server", "transformers serve")
ENVIRONMENT = {
    **os.environ,
    "OMP_NUM_THREADS": "1",
    "HF_HUB_OFFLINE": "1",
    "VLLM_CPU_OMP_THREADS_BIND": "nobind",
    "VLLM_CPU_KVCACHE_SPACE": "2",
}
_COMMAND = [sys.executable, "-c", "from infthor_eval.cli import main; main()"]


def main() -> None:
    """Print for each engine how many replies and plans are equal."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--limit", type=int, help="questions, and trajectories of plans, of each task"
    )
    parser.add_argument(
        "--pretrained",
        type=Path,
        default=packaged_folder(NANO_FOLDER),
        help="folder of a checkpoint",
    )
    parser.add_argument("--adapter", default="qwen2.5-vl", help="its model name here")
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=ENGINES)
    options = parser.parse_args()
    limit = options.limit
    more = [] if limit is None else ["--limit", str(limit)]
    checkpoint = options.pretrained
    serving: dict[str, Callable[[], AbstractContextManager[Served | None]]] = {
        "vLLM's server": lambda: serve_vllm(checkpoint, "float32", ENVIRONMENT, most_frames=300),
        "transformers serve": lambda: serve_transformers("float32", ENVIRONMENT),
    }
    expected: dict[str, Mapping[Any, Any]] = {}
    print(f"{'':20}{'questions':>14}{'cached':>9}{'plans':>14}{'cached':>9}")
    for name in (HERE, *(engine for engine in options.engines if engine != HERE)):
        cells = []
        with serving.get(name, nullcontext)() as served, tempfile.TemporaryDirectory() as output:
            for suite, task in TASKS.items():
                given = _arguments(name, options.adapter, checkpoint, served, suite)
                replies, cached = _ask(
                    suite, [*given, "--tasks", task, *more], Path(output) / suite
                )
                known = expected.setdefault(suite, replies)
                equal = sum(replies[key] == reply for key, reply in known.items())
                cells.append(f"{f'{equal} of {len(known)}':>14}{cached:>9.1%}")
        print(f"{name:20}{''.join(cells)}", flush=True)


def _arguments(
    name: str, adapter: str, checkpoint: Path, served: Served | None, suite: str
) -> list[str]:
    greedy = ["--greedy"] if suite == "plans" else []
    if served is not None:
        given = f"base_url={served.url},model={checkpoint}"
        if name == "transformers serve":
            # It fails on stop strings for models with images, and refuses the other field.
            given += ",send_stop=false,send_repetition_penalty=false"
        return ["--model", "openai", "--model-args", given, *greedy]
    given = f"pretrained={checkpoint},dtype=float32"
    if name == HERE:
        return ["--model", adapter, "--model-args", f"{given},device=cpu,batch_size=1", *greedy]
    return [
        "--model",
        adapter,
        "--engine",
        "vllm",
        "--model-args",
        f"{given},enforce_eager=true",
        *greedy,
    ]


def _ask(suite: str, arguments: list[str], output: Path) -> tuple[dict[Any, Any], float]:
    """Return the reply, or the steps of a plan, by unit, and the share of cached tokens.

    The rest of a plan's record is not compared: tokens since a clue are not known of a server.
    """
    process = subprocess.run(
        [*_COMMAND, *arguments, "--out", str(output)],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    if process.returncode not in (0, 1):  # 1: some units failed, which shows in the count
        sys.exit(process.stderr[-3000:])
    (results,) = output.rglob("results.json")
    _, records = read_run(results.parent, find_suite(suite).records)
    read = sum(record.tokens.context or 0 for record in records)
    cached = sum(record.tokens.cached or 0 for record in records)
    said = "steps" if suite == "plans" else "reply"
    replies = {record.key: record.failure or getattr(record.payload, said) for record in records}
    return replies, cached / max(read, 1)


if __name__ == "__main__":
    main()
