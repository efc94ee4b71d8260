"""Our command in processes of its own, and the processes that this one has started."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import psutil

from infthor_eval.runs import Silent, UnitRecord

from .waiting import PATIENCE_S

__all__ = ["ChildCounter", "cli_words", "find_children", "finish", "run_python", "start_cli"]

_ROOT = Path(__file__).parents[2]


def cli_words(*arguments: object) -> list[str]:
    """The words that start our command in a process of its own."""
    program = "from infthor_eval.cli import main; main()"
    return [sys.executable, "-c", program, *map(str, arguments)]


def start_cli(*arguments: object) -> "subprocess.Popen[str]":
    """Start our command in a process of its own, both of whose outputs are pipes."""
    return subprocess.Popen(
        cli_words(*arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )


def finish(process: "subprocess.Popen[str]") -> str:
    """Wait until a process has ended well; returns its standard error."""
    _, error_text = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error_text
    return error_text


def run_python(program: str, *words: object, **options: Any) -> "subprocess.CompletedProcess[str]":
    """Run a program in a process of its own to its end; both of its outputs are kept."""
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
        **options,
    )


def find_children() -> set[int]:
    """The processes that this one has started and that are still there."""
    return {child.pid for child in psutil.Process().children()}


class ChildCounter(Silent):
    """Counts the processes whenever an episode is done.

    Attributes:
        before: those that were there when it was made.
        most: the most of the others at once.
    """

    def __init__(self) -> None:
        self.before, self.most = find_children(), 0

    def done(self, record: UnitRecord, resumed: bool) -> None:
        """See `Observer`."""
        self.most = max(self.most, len(find_children() - self.before))
