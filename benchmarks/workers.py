"""Measure the speed-up by several workers, and check that files and results are the same.

    python benchmarks/workers.py [--workers 2] [--scenes 6] [--steps 150] [--cluster] [--out DIR]

Trajectories and questions are generated and replayed, and a tiny model answers questions on their
clue frames (`nieh_mini_gt`): with one worker, with several processes and, with --cluster, on a Ray
cluster of two nodes that this script starts. Every process has one thread, so that a worker uses
one core.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from infthor_eval.storage.digests import digest_of_file, fingerprint

_SCENES = (
    "kitchen-1",
    "bedroom-2",
    "living-room-3",
    "kitchen-4",
    "bedroom-5",
    "living-room-6",
    "kitchen-7",
    "bedroom-8",
)
_VARYING = {"replay.json", "run.yaml", "usage.json"}  # have times, command lines and cache hits


def main() -> None:
    """Run all stages in all ways, and print the times."""
    options = _arguments()
    os.environ["OMP_NUM_THREADS"] = "1"
    ways: dict[str, list[str]] = {
        "1": [],
        str(options.workers): ["--workers", str(options.workers)],
    }
    with tempfile.TemporaryDirectory() as scratch, _cluster(options.cluster) as address:
        if address is not None:
            ways[f"{options.workers} on Ray"] = [
                "--workers",
                str(options.workers),
                "--ray-address",
                address,
            ]
        out = options.out or Path(scratch)
        results = {
            way: _run_all(out / way.replace(" ", "-"), more, options) for way, more in ways.items()
        }
    for stage, (seconds, digest) in results["1"].items():
        texts = [
            f"{way}: {took[stage][0]:.0f} s, {seconds / took[stage][0]:.2f}x, "
            f"{'equal' if took[stage][1] == digest else 'DIFFERENT'}"
            for way, took in results.items()
            if way != "1"
        ]
        print(f"{stage}: {seconds:.0f} s by one worker; by {'; '.join(texts)}")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--scenes", type=int, default=6, help="number of trajectories, one per scene"
    )
    parser.add_argument("--steps", type=int, default=150, help="minimum steps of a trajectory")
    parser.add_argument("--cluster", action="store_true", help="also on a Ray cluster")
    parser.add_argument("--out", type=Path, help="folder of the results; default: temporary")
    return parser.parse_args()


@contextmanager
def _cluster(enabled: bool) -> Iterator[str | None]:
    if not enabled:
        yield None
        return
    from ray.cluster_utils import Cluster

    node = {"num_cpus": 1, "object_store_memory": 100 * 2**20}
    cluster = Cluster(initialize_head=True, head_node_args=node)
    cluster.add_node(**node)
    yield cluster.address
    cluster.shutdown()


def _run_all(
    out: Path, more: Sequence[str], options: argparse.Namespace
) -> dict[str, tuple[float, str]]:
    """Return seconds and a digest of the files by stage."""
    generated, replayed, answered = out / "generated", out / "set", out / "answers"
    scenes = [word for scene in _SCENES[: options.scenes] for word in ("--scene", scene)]
    generate = [
        "generate",
        *scenes,
        "--min-steps",
        str(options.steps),
        "--min-subgoals",
        "3",
        "--out",
        str(generated),
    ]
    questions = ["questions", str(replayed), "--out", str(replayed / "qa_set_q.csv")]
    evaluate = [
        "run",
        "--model",
        "qwen2.5-vl-tiny",
        "--tasks",
        "nieh_mini_gt",
        "--out",
        str(answered),
    ]
    stages = {
        "generate": (generate, generated),
        "replay": (["replay", str(generated), "--out", str(replayed)], replayed),
        "questions": (questions, replayed),
        "evaluate": (evaluate, answered),
    }
    return {
        stage: _time_command([*words, *more], folder) for stage, (words, folder) in stages.items()
    }


def _time_command(words: Sequence[str], folder: Path) -> tuple[float, str]:
    start = time.monotonic()
    command = [str(Path(sys.executable).with_name("infthor-eval")), *words]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = time.monotonic() - start
    results = list(folder.rglob("results.json"))
    files = results or [
        path for path in folder.rglob("*") if path.is_file() and path.name not in _VARYING
    ]
    return seconds, fingerprint(
        {str(path.relative_to(folder)): digest_of_file(path) for path in sorted(files)}
    )


if __name__ == "__main__":
    main()
