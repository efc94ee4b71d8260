"""Measure the time from a typed command to the first question, and to the end of commands that only
print.

    python benchmarks/start_up.py [--rounds 5] [--against CHECKOUT] [--only NAME ...]

It prints one JSON object: for each command the median seconds and processor seconds until the first
question is asked and until its reply is there (on nieh_mini), or until the command has ended. A
"first run" has an empty user cache: what can be guessed of the questions is not known yet. A first
round, which does not count, puts all files into memory. With --against each round runs both
checkouts by turns, so that whatever else the machine does hits both; processor seconds vary less
than seconds.
"""

import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

_RUN = ("--tasks", "nieh_mini", "--threads", "1")
_COMMANDS: dict[str, tuple[str, ...]] = {
    "oracle": ("--model", "oracle", "--tasks", "nieh_mini"),
    "oracle, first run": ("--model", "oracle", "--tasks", "nieh_mini"),
    "blind": ("--model", "blind", "--tasks", "nieh_mini"),
    "nano": ("--model", "qwen2.5-vl-nano", *_RUN),
    "nano, first run": ("--model", "qwen2.5-vl-nano", *_RUN),
    "tiny": ("--model", "qwen2.5-vl-tiny", *_RUN),
    "help": ("--help",),
    "ls models": ("ls", "models"),
    "ls tasks": ("ls", "tasks"),
    "show": ("show",),
}
_END = os._exit  # which the command makes an error while it runs
_ASKING = "infthor_eval.questions.asking"


class _Stopwatch(MetaPathFinder, Loader):
    """Times the first call of an answerer; it waits for the import of their module, so as not to
    cause it."""

    def __init__(self) -> None:
        self.times: dict[str, tuple[float, float]] = {}

    def find_spec(
        self, name: str, path: Any, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Take over the import of the answerers' module."""
        if name != _ASKING:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.loader is not None
        self._execute = spec.loader.exec_module
        spec.loader = self
        return spec

    def exec_module(self, module: ModuleType) -> None:
        """Wrap the answerers once they are defined."""
        self._execute(module)
        for answerer in (module.ModelReplier, module.BaselineReplier):
            answerer.answer = self._timed(answerer.answer)

    def _timed(self, answer: Callable[..., Any]) -> Callable[..., Any]:
        def first_answer(*given: Any) -> None:
            self.stop("asked")
            answer(*given)
            self.stop("answered")
            self.leave()

        return first_answer

    def stop(self, event: str) -> None:
        """Note when something happened: time of day, and processor seconds of this process."""
        self.times[event] = time.time(), time.process_time()

    def leave(self) -> None:
        """Print the times as the last line, and end the process."""
        # While a model is asked, what is printed goes to standard error.
        print(f"\n{json.dumps(self.times)}", file=sys.__stdout__, flush=True)
        _END(0)


def execute(arguments: list[str]) -> None:
    """Run one command in this process until its first reply or its end, and print the times."""
    stopwatch = _Stopwatch()
    sys.meta_path.insert(0, stopwatch)
    from infthor_eval.cli import main

    try:
        main(arguments)
    except SystemExit as ended:
        if ended.code:
            raise
    stopwatch.stop("ended")
    stopwatch.leave()


def measure(checkout: Path, name: str, output: Path, shown: Path) -> dict[str, float]:
    """Return seconds and processor seconds until each event, of one command by one checkout."""
    arguments = _COMMANDS[name]
    with tempfile.TemporaryDirectory(dir=output) as folder:
        where = ("--out", folder) if "--tasks" in arguments else ()
        if name == "show":
            where = tuple(map(str, shown.glob("*/*")))
        cache = folder if name.endswith("first run") else str(output / "cache")
        start = time.time()
        done = subprocess.run(
            [sys.executable, __file__, "--execute", *arguments, *where],
            env=os.environ | {"PYTHONPATH": str(checkout), "OMP_NUM_THREADS": "1",
                              "XDG_CACHE_HOME": cache},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    times = json.loads(done.stdout.splitlines()[-1])
    return {
        f"{event}, {kind}": value
        for event, (at, processor) in times.items()
        for kind, value in (("s", at - start), ("processor s", processor))
    }


def compare(checkouts: dict[str, Path], names: list[str], rounds: int) -> dict[str, Any]:
    """Return the medians of each command and checkout; all are run by turns."""
    taken: dict[str, dict[str, list[dict[str, float]]]] = {
        name: {at: [] for at in checkouts} for name in names
    }
    with tempfile.TemporaryDirectory() as folder:
        output, shown = Path(folder), Path(folder, "shown")
        subprocess.run(
            [sys.executable, "-c", "from infthor_eval.cli import main; main()",
             *_COMMANDS["oracle"], "--quiet",
             "--out", str(shown)],
            env=os.environ | {"PYTHONPATH": str(checkouts["this"])}, stdout=subprocess.DEVNULL,
            check=True,
        )  # fmt: skip
        for number in range(rounds + 1):
            for name in names:
                for at, checkout in checkouts.items():
                    times = measure(checkout, name, output, shown)
                    if number:
                        taken[name][at].append(times)
    return {
        name: {
            at: {
                event: round(statistics.median(times[event] for times in all_times), 2)
                for event in all_times[0]
            }
            for at, all_times in by_checkout.items()
        }
        for name, by_checkout in taken.items()
    }


def main() -> None:
    """Measure all commands."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--against", type=Path, metavar="CHECKOUT")
    parser.add_argument(
        "--only", nargs="+", choices=_COMMANDS, default=list(_COMMANDS), metavar="NAME"
    )
    given = parser.parse_args()
    checkouts = {"this": Path(__file__).parents[1]}
    if given.against:
        checkouts["other"] = given.against.resolve()
    print(json.dumps(compare(checkouts, given.only, given.rounds), indent=2))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--execute"]:
        execute(sys.argv[2:])
    else:
        main()
