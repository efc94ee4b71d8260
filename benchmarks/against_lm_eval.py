"""Compare our runner with lm-eval's `hf-multimodal` on the same task, checkpoint, frames and
questions.

The task is `nieh_full` on one trajectory, with a tiny Qwen2.5-VL checkpoint. Both are timed as
whole processes, from start to results. Both also run on a single frame and question, which measures
the start-up; the second factor is without it. lm-eval's model needs torchvision's Python half, so
run `make test` once before.

    python benchmarks/against_lm_eval.py [--frames 120] [--questions 24]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from noise_set import write_set

from infthor_eval.storage.folders import packaged_folder
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

SHIM = Path(__file__).parents[1] / "tests" / "peers"
PEERS = Path(sys.prefix) / "test-peers"


def main() -> None:
    """Run both and print the times, the factor, and the number of equal replies."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--questions", type=int, default=24)
    options = parser.parse_args()
    if not PEERS.is_dir():
        sys.exit(
            f"{PEERS}: no torchvision, which lm-eval's model needs; run `make test` once, which "
            "puts it there"
        )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_tiny_checkpoint(folder / "checkpoint", seed=0)
        start_up = compare(folder, 1, 1)
        whole = compare(folder, options.frames, options.questions)
    print(f"{options.frames} frames, {options.questions} questions, nieh_full")
    print(f"{'':24}{'whole process':>14}{'start-up':>10}{'the rest':>10}")
    for name, long, short in zip(
        ("infthor-eval", "lm-eval hf-multimodal"), whole[:2], start_up[:2], strict=True
    ):
        print(f"{name:24}{long:12.1f} s{short:8.1f} s{long - short:8.1f} s")
    rest = (whole[1] - start_up[1]) / (whole[0] - start_up[0])
    print(f"{'factor':24}{whole[1] / whole[0]:13.1f}x{'':9}{rest:9.1f}x")
    print(f"replies equal           {whole[2]} of {options.questions}")


def compare(folder: Path, frames: int, questions: int) -> tuple[float, float, int]:
    """Return the seconds of both processes on a new set, and the number of equal replies."""
    place = folder / f"{frames}x{questions}"
    write_set(place / "set", frames, questions)
    ours, theirs = run_ours(folder / "checkpoint", place), run_theirs(folder / "checkpoint", place)
    our_replies, their_replies = replies(place / "ours"), replies(place / "theirs")
    return ours, theirs, sum(our_replies[key] == reply for key, reply in their_replies.items())


def run_ours(checkpoint: Path, folder: Path) -> float:
    """Return the seconds of the whole process of `infthor-eval`."""
    arguments = [
        "--model",
        "qwen2.5-vl",
        "--model-args",
        f"pretrained={checkpoint},dtype=float32,device=cpu",
    ]
    arguments += [
        "--tasks",
        "nieh_full",
        "--data",
        str(folder / "set"),
        "--out",
        str(folder / "ours"),
    ]
    return _time_process(["-c", "from infthor_eval.cli import main; main()", *arguments], {})


def run_theirs(checkpoint: Path, folder: Path) -> float:
    """Return the seconds of the whole process of `lm-eval`."""
    arguments = [
        "run",
        "--model",
        "hf-multimodal",
        "--model_args",
        f"pretrained={checkpoint},dtype=float32",
    ]
    arguments += [
        "--tasks",
        "nieh_full",
        "--include_path",
        str(packaged_folder("tasks")),
        "--device",
        "cpu",
    ]
    arguments += [
        "--metadata",
        json.dumps({"data": str(folder / "set")}),
        "--apply_chat_template",
        "--batch_size",
        "1",
    ]
    arguments += ["--log_samples", "--output_path", str(folder / "theirs")]
    path = {"PYTHONPATH": f"{SHIM}{os.pathsep}{PEERS}"}
    return _time_process(
        ["-c", "from lm_eval.__main__ import cli_evaluate; cli_evaluate()", *arguments], path
    )


def replies(folder: Path) -> dict[str, str]:
    """Return the replies by question."""
    (path,) = folder.rglob("samples_nieh_full_*.jsonl")
    samples = [json.loads(line) for line in path.read_text().splitlines()]
    return {sample["doc"]["question_id"]: sample["resps"][0][0] for sample in samples}


def _time_process(arguments: list[str], environment: dict[str, str]) -> float:
    start = time.perf_counter()
    variables = {**os.environ, "HF_HUB_OFFLINE": "1", **environment}
    subprocess.run([sys.executable, *arguments], env=variables, capture_output=True, check=True)
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
