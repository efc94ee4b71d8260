"""Measure the speed-up of `nieh_mini` by sharing the frames' prefix between questions, and compare
the replies.

Both runs use the whole runner (suite, journal) in one process; the times are those of answering.

    python benchmarks/nieh_mini_sharing.py [--model qwen2.5-vl-tiny] [--tasks nieh_mini]
"""

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.runs import UnitKey, UnitRecord, execute, prepare


def answer(model: str, tasks: str, shared: bool, output: Path) -> list[UnitRecord]:
    """Return the records of a run with or without sharing."""
    models = (ModelSpec(model, {"share_prefix": str(shared).lower()}),)
    ((request, suite),) = RunOptions(models, (tasks,), None, output).requests()
    return execute(prepare(request, suite)).records


def main() -> None:
    """Run both, and print seconds, factor and equality by task."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="qwen2.5-vl-tiny")
    parser.add_argument("--tasks", default="nieh_mini")
    options = parser.parse_args()
    seconds: defaultdict[str, dict[bool, float]] = defaultdict(dict)
    replies: dict[bool, dict[UnitKey, str | None]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for shared in (True, False):
            records = answer(options.model, options.tasks, shared, Path(folder))
            replies[shared] = {record.key: record.payload.reply for record in records}
            for record in records:
                seconds[record.task][shared] = (
                    seconds[record.task].get(shared, 0.0) + record.seconds
                )
    print(f"{'task':18} {'questions':>9} {'shared s':>9} {'plain s':>9} {'factor':>7}")
    for task, times in sorted(seconds.items()):
        n = sum(key.task == task for key in replies[True])
        print(
            f"{task:18} {n:9} {times[True]:9.2f} {times[False]:9.2f} "
            f"{times[False] / times[True]:7.2f}"
        )
    print("replies equal:", "yes" if replies[True] == replies[False] else "NO")


if __name__ == "__main__":
    main()
