"""Race of the engines: the same questions on the same checkpoint, in transformers (ours) and vLLM,
and in lm-eval.

The checkpoint is a Qwen2.5-VL of 107 million random weights. The sets are `nieh_mini_full` and a
long trajectory of noise. Every way is run as a whole process on one question, and on more; their
difference, by question, is what a further question takes. Processor time includes a server's and
all threads'.

    make test-vllm                                  # once: the environment with vLLM
    .venv-vllm/bin/python benchmarks/engines.py --sets mini long --dtypes float32 --threads 1

Ways that encode everything for each question are slow: they are asked `--slow-questions`.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from noise_set import write_set
from served import serve_vllm

from infthor_eval.runs import read_run
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.suites import find_suite
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

MODEL = "checkpoint"
WAYS = (
    "ours",
    "ours one by one",
    "vLLM",
    "vLLM uncached",
    "vLLM's server",
    "lm-eval hf-multimodal",
)
SLOW = {"vLLM uncached", "lm-eval hf-multimodal"}
REFERENCE = "ours one by one"
_COMMAND = ["-c", "from infthor_eval.cli import main; main()"]
_LM_EVAL = ["-c", "from lm_eval.__main__ import cli_evaluate; cli_evaluate()"]
_PIXELS = {"shortest_edge": 56 * 56, "longest_edge": 84 * 84}  # 9 tokens a frame


@dataclass(frozen=True)
class Race:
    """What is asked in one round: a set of questions, in one precision, with so many threads."""

    task: str
    data: Path | None
    dtype: str
    threads: int

    @property
    def environment(self) -> dict[str, str]:
        """The variables of every process."""
        variables = {
            "OMP_NUM_THREADS": str(self.threads),
            "HF_HUB_OFFLINE": "1",
            "VLLM_CPU_OMP_THREADS_BIND": "nobind",
        }
        return {**os.environ, **variables, "VLLM_CPU_KVCACHE_SPACE": "4"}


@dataclass(frozen=True)
class Cost:
    """What a process took: seconds by the clock, processor seconds, and each question's reply and
    tokens."""

    wall: float
    processor: float
    replies: Mapping[str, str]
    n_read: int | None = None
    n_cached: int | None = None


def main() -> None:
    """Run all rounds and print a table of each."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_checkpoint(folder / MODEL)
        write_set(folder / "long", options.frames, options.questions)
        sets = {"mini": ("nieh_mini_full", None), "long": ("nieh_full", folder / "long")}
        for name in options.sets:
            for dtype in options.dtypes:
                for threads in options.threads:
                    run_race(Race(*sets[name], dtype, threads), folder, options)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", nargs="+", choices=("mini", "long"), default=["mini", "long"])
    parser.add_argument("--dtypes", nargs="+", choices=("float32", "bfloat16"), default=["float32"])
    parser.add_argument("--threads", nargs="+", type=int, default=[1])
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--frames", type=int, default=500, help="frames of the long trajectory")
    parser.add_argument("--questions", type=int, default=24, help="questions on it")
    parser.add_argument(
        "--slow-questions", type=int, default=4, help="questions for ways that encode all for each"
    )
    return parser.parse_args()


def write_checkpoint(folder: Path) -> None:
    """Write a Qwen2.5-VL of 107 million random weights with the small tokenizer."""
    size = replace(Qwen25VLTiny.twin, config=_config, image_settings={"size": _PIXELS})
    size.save(folder, seed=0)


def _config(ids: Mapping[str, int], vocab_size: int) -> Any:
    config = Qwen25VLTiny.twin.config(ids, vocab_size)
    text, vision = config.text_config, config.vision_config
    text.hidden_size, text.intermediate_size, text.num_hidden_layers = 768, 2304, 16
    text.num_attention_heads, text.num_key_value_heads, text.layer_types = (
        12,
        2,
        ["full_attention"] * 16,
    )
    text.rope_parameters["mrope_section"] = [8, 12, 12]
    vision.depth, vision.hidden_size, vision.intermediate_size, vision.num_heads = 4, 256, 512, 4
    vision.out_hidden_size, vision.fullatt_block_indexes = 768, [1, 3]
    text.initializer_range = vision.initializer_range = 0.06
    return config


def run_race(race: Race, folder: Path, options: argparse.Namespace) -> None:
    """Run every way on one question and on more, and print what they took."""
    print(
        f"\n{race.task}, {race.dtype}, {race.threads} thread(s); processor seconds (seconds by the "
        "clock)"
    )
    heads = (
        f"{'one question':>18}{'whole run':>20}{'asked':>6}{'each further':>18}"
        f"{'encoded':>9}{'cached':>8}"
    )
    print(f"{'':22}{heads}  equal")
    expected: Mapping[str, str] = {}
    for way in sorted(options.ways, key=lambda way: way != REFERENCE):
        limit = options.slow_questions if way in SLOW else None
        one, whole = (run_way(way, race, folder, number) for number in (1, limit))
        if way == REFERENCE:
            expected = whole.replies
        print(_row(way, one, whole, expected), flush=True)


def _row(way: str, one: Cost, whole: Cost, expected: Mapping[str, str]) -> str:
    n_more = len(whole.replies) - len(one.replies)
    each = [
        (after - before) / n_more
        for before, after in ((one.processor, whole.processor), (one.wall, whole.wall))
    ]
    equal = sum(
        whole.replies[key] == reply for key, reply in expected.items() if key in whole.replies
    )
    compared = f"{equal} of {len(whole.replies)}" if expected else "-"
    tokens = f"{'?':>9}{'?':>8}"
    if whole.n_read is not None and whole.n_cached is not None:
        tokens = f"{whole.n_read - whole.n_cached:>9,}{whole.n_cached / whole.n_read:>8.1%}"
    return (
        f"{way:22}{one.processor:9.1f} ({one.wall:6.1f}){whole.processor:11.1f} ({whole.wall:6.1f})"
        f"{len(whole.replies):6}{each[0]:9.2f} ({each[1]:6.2f}){tokens}  {compared}"
    )


def run_way(way: str, race: Race, folder: Path, limit: int | None) -> Cost:
    """Return what a way takes for the first questions, or all."""
    tasks = ["--tasks", race.task, *([] if limit is None else ["--limit", str(limit)])]
    with tempfile.TemporaryDirectory(dir=folder) as name:
        output = Path(name)
        if way == "lm-eval hf-multimodal":
            return _run_lm_eval(race, folder / MODEL, tasks, output)
        data = [] if race.data is None else ["--data", str(race.data)]
        if way != "vLLM's server":
            wall, processor = _time(
                [*_COMMAND, *_model(way, race, folder / MODEL), *tasks, *data, *_to(output)], race
            )
            return _cost(wall, processor, output)
        start = time.perf_counter()
        with serve_vllm(folder / MODEL, race.dtype, race.environment, most_frames=512) as served:
            given = [
                "--model",
                "openai",
                "--model-args",
                f"base_url={served.url},model={folder / MODEL}",
            ]
            _, processor = _time([*_COMMAND, *given, *tasks, *data, *_to(output)], race)
        return _cost(time.perf_counter() - start, processor + served.processor_seconds, output)


def _to(output: Path) -> list[str]:
    return ["--out", str(output)]


def _model(way: str, race: Race, checkpoint: Path) -> list[str]:
    given = {"pretrained": str(checkpoint), "dtype": race.dtype}
    engine: list[str] = []
    if way.startswith("vLLM"):
        engine = ["--engine", "vllm"]
        given |= {"enforce_eager": "true", "max_model_len": "16384"}
        if way == "vLLM uncached":
            given |= {"prefix_caching": "false", "max_num_seqs": "1"}
    else:
        given |= {"device": "cpu"} | ({"batch_size": "1"} if way == REFERENCE else {})
    return [
        "--model",
        "qwen2.5-vl",
        *engine,
        "--model-args",
        ",".join(f"{key}={given[key]}" for key in given),
    ]


def _run_lm_eval(race: Race, checkpoint: Path, tasks: Sequence[str], output: Path) -> Cost:
    command = [
        *_LM_EVAL,
        "run",
        "--model",
        "hf-multimodal",
        *tasks,
        "--device",
        "cpu",
        "--batch_size",
        "1",
    ]
    command += [
        "--model_args",
        f"pretrained={checkpoint},dtype={race.dtype}",
        "--apply_chat_template",
    ]
    command += [
        "--include_path",
        str(packaged_folder("tasks")),
        "--log_samples",
        "--output_path",
        str(output),
    ]
    command += [] if race.data is None else ["--metadata", json.dumps({"data": str(race.data)})]
    wall, processor = _time(command, race)
    (path,) = output.rglob("samples_*.jsonl")
    samples = [json.loads(line) for line in path.read_text().splitlines()]
    return Cost(
        wall, processor, {sample["doc"]["question_id"]: sample["resps"][0][0] for sample in samples}
    )


def _cost(wall: float, processor: float, output: Path) -> Cost:
    (results,) = output.rglob("results.json")
    _, records = read_run(results.parent, find_suite("nieh").records)
    failed = [record.failure for record in records if record.failure]
    if failed:
        sys.exit(f"{len(failed)} questions failed: {failed[0]}")
    read = sum(record.tokens.context or 0 for record in records)
    cached = sum(record.tokens.cached or 0 for record in records)
    return Cost(
        wall, processor, {record.key.id: record.payload.reply for record in records}, read, cached
    )


def _time(arguments: Sequence[str], race: Race) -> tuple[float, float]:
    """Return the seconds by the clock and the processor seconds of a process and its children."""
    start = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, *arguments], env=race.environment, stdout=said, stderr=said
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            said.seek(0)
            sys.exit(f"{' '.join(arguments)}:\n{said.read().decode()[-3000:]}")
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
