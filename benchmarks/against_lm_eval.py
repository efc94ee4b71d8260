"""Our runner against lm-eval's own `hf-multimodal`: the same task, checkpoint, frames and questions.

One trajectory, `nieh_full`, a tiny Qwen2.5-VL checkpoint. Both are whole processes from start to results; printed are
lm-eval's own evaluation time (model loaded, requests answered, results written) for it and the time of the whole
process for ours, which includes more. lm-eval's model needs torchvision's Python half: run `make test` once before.

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

from infthor_eval.formats.packaged import packaged_folder
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

SHIM = Path(__file__).parents[1] / "tests" / "peers"
PEERS = Path(sys.prefix) / "test-peers"


def main() -> None:
    """Run both and print the times, the factor, and how many replies are equal."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--questions", type=int, default=24)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_tiny_checkpoint(folder / "checkpoint", seed=0)
        write_set(folder / "set", chosen.frames, chosen.questions)
        ours = run_ours(folder)
        theirs = run_theirs(folder)
        our_replies, their_replies = replies(folder / "ours"), replies(folder / "theirs")
    equal = sum(our_replies[key] == reply for key, reply in their_replies.items())
    print(f"{chosen.frames} frames, {chosen.questions} questions, nieh_full")
    print(f"infthor-eval            {ours:8.1f} s")
    print(f"lm-eval hf-multimodal   {theirs:8.1f} s")
    print(f"factor                  {theirs / ours:8.1f}")
    print(f"replies equal           {equal} of {len(their_replies)}")


def run_ours(folder: Path) -> float:
    """Seconds of `infthor-eval`, the whole process."""
    arguments = [
        "--model",
        "qwen2.5-vl",
        "--model-args",
        f"pretrained={folder / 'checkpoint'},dtype=float32,device=cpu",
    ]
    arguments += ["--tasks", "nieh_full", "--data", str(folder / "set"), "--output", str(folder / "ours")]
    return _timed(["-c", "from infthor_eval.cli import main; main()", *arguments], {})


def run_theirs(folder: Path) -> float:
    """Seconds that lm-eval states for its evaluation."""
    arguments = ["run", "--model", "hf-multimodal", "--model_args", f"pretrained={folder / 'checkpoint'},dtype=float32"]
    arguments += ["--tasks", "nieh_full", "--include_path", str(packaged_folder("tasks")), "--device", "cpu"]
    arguments += ["--metadata", json.dumps({"data": str(folder / "set")}), "--apply_chat_template", "--batch_size", "1"]
    arguments += ["--log_samples", "--output_path", str(folder / "theirs")]
    path = {"PYTHONPATH": f"{SHIM}{os.pathsep}{PEERS}"}
    _timed(["-c", "from lm_eval.__main__ import cli_evaluate; cli_evaluate()", *arguments], path)
    (results,) = (folder / "theirs").rglob("results_*.json")
    return float(json.loads(results.read_text())["total_evaluation_time_seconds"])


def replies(folder: Path) -> dict[str, str]:
    """Replies by question."""
    (path,) = folder.rglob("samples_nieh_full_*.jsonl")
    samples = [json.loads(line) for line in path.read_text().splitlines()]
    return {sample["doc"]["question_id"]: sample["resps"][0][0] for sample in samples}


def _timed(arguments: list[str], environment: dict[str, str]) -> float:
    began = time.perf_counter()
    variables = {**os.environ, "HF_HUB_OFFLINE": "1", **environment}
    subprocess.run([sys.executable, *arguments], env=variables, capture_output=True, check=True)
    return time.perf_counter() - began


if __name__ == "__main__":
    main()
