"""What a step works with: commands in processes of their own within its time, and runs' records."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.report.differences import margin_of_difference
from infthor_eval.report.presenter import ReplyTokens
from infthor_eval.runs import UnitRecord, read_run
from infthor_eval.suites import find_suite

from .machine import Machine

__all__ = ["BENCHMARKS", "INFTHOR_EVAL", "TINY_LIMIT", "Done", "Run", "StepFailed", "Work"]

BENCHMARKS = Path(__file__).parents[1]
INFTHOR_EVAL = ("-c", "from infthor_eval.cli import main; main()")
TINY_LIMIT = 12  # questions of a run in a rehearsal: two on each trajectory
_START_S = 300


class StepFailed(Exception):
    """A step cannot be finished, in one line."""


@dataclass(frozen=True)
class Done:
    """A command that has ended: its exit code, seconds, and standard output."""

    code: int
    seconds: float
    output: str


@dataclass(frozen=True)
class Run:
    """The records of a finished run, by the model's name."""

    name: str
    records: Sequence[UnitRecord[Any]]

    @property
    def n_failed(self) -> int:
        """Number of questions without a reply."""
        return sum(record.failure is not None for record in self.records)

    @property
    def replies(self) -> dict[Any, str | None]:
        """Replies by question."""
        return {record.key: record.payload.reply for record in self.records}

    def accuracy(self, scorer: str) -> float:
        """Return the mean score in percent."""
        scores = [record.payload.scores.get(scorer, 0.0) for record in self.records]
        return 100 * sum(scores) / len(scores)

    def n_equal(self, other: "Run") -> int:
        """Return how many replies are those of another run."""
        theirs = other.replies
        return sum(reply == theirs.get(key) for key, reply in self.replies.items())

    def parting_margin(self, other: "Run") -> float | None:
        """Return the largest margin at which a reply parts from that of another run, in nats; None
        if none does, or one's was not recorded."""
        theirs = {record.key: record.payload for record in other.records}
        margins = [
            margin_of_difference(_tokens(record.payload), _tokens(theirs[record.key]))
            for record in self.records
            if record.payload.reply != theirs[record.key].reply
        ]
        known = [margin for margin in margins if margin is not None]
        return max(known) if margins and len(known) == len(margins) else None


def _tokens(payload: Any) -> ReplyTokens:
    return ReplyTokens(payload.reply_ids, payload.margins)


@dataclass
class Work:
    """A step's folder, machine and time.

    Attributes:
        folder: the step's own, kept for when it is resumed.
        end: when its time is up, on the monotonic clock.
        earlier: figures of the steps before it, by their names.
    """

    machine: Machine
    folder: Path
    end: float
    earlier: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    _n_commands: int = field(default=0, init=False)

    def evaluate(
        self, name: str, *words: str, codes: Sequence[int] = (0,), fresh: bool = False
    ) -> tuple[list[Run], Done]:
        """Run `infthor-eval` into a folder of this name, and read its runs.

        Args:
            name: name of the folder below the step's; an unfinished run in it is continued.
            words: the command's words; in a rehearsal a limit is added.
            codes: exit codes that are no fault.
            fresh: begin again, for what is timed.
        """
        output = self.folder / name
        limited = self.machine.tiny and "--limit" not in words
        more = ["--limit", str(TINY_LIMIT)] if limited else []
        more += ["--fresh"] if fresh else []
        done = self.command(*words, "--out", str(output), *more, codes=codes)
        return read_runs(output), done

    def command(self, *words: str, codes: Sequence[int] = (0,)) -> Done:
        """Run a command of infthor-eval."""
        return self._run((*INFTHOR_EVAL, *words), codes)

    def benchmark(self, script: str, *words: str) -> Done:
        """Run a script of the benchmarks."""
        return self.python(str(BENCHMARKS / script), *words)

    def python(self, *words: str) -> Done:
        """Run a Python program."""
        return self._run(words, (0,))

    @contextmanager
    def server(
        self, words: Sequence[str], port: int, environment: Mapping[str, str]
    ) -> Iterator[None]:
        """Run a Python program that serves a port, within the context."""
        log = self._log()
        with log.open("wb") as said:
            process = subprocess.Popen(
                [sys.executable, *words], stdout=said, stderr=said, env=os.environ | environment
            )
            try:
                self._wait_for(process, port, log)
                yield
            finally:
                process.terminate()
                process.wait()

    def _wait_for(self, process: "subprocess.Popen[bytes]", port: int, log: Path) -> None:
        end = min(self.end, time.monotonic() + _START_S)
        while time.monotonic() < end:
            if process.poll() is not None:
                raise StepFailed(f"the server ended with {process.returncode}: {_last_line(log)}")
            with socket.socket() as tried:
                if tried.connect_ex(("127.0.0.1", port)) == 0:
                    return
            time.sleep(0.2)
        raise StepFailed(f"the server does not come up; see {log}")

    def _log(self) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        self._n_commands += 1
        return self.folder / f"{self._n_commands}.log"

    def _run(self, words: Sequence[str], codes: Sequence[int]) -> Done:
        """Run a Python program, its standard error into a log.

        Raises:
            StepFailed: it ends with another code, or the step's time is up.
        """
        log = self._log()
        start = time.monotonic()
        with log.open("wb") as said:
            process = subprocess.Popen(
                [sys.executable, *words],
                stdout=subprocess.PIPE,
                stderr=said,
                start_new_session=True,  # ended with all processes that it has started
            )
            try:
                output, _ = process.communicate(timeout=max(0.0, self.end - start))
            except BaseException as error:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                if not isinstance(error, subprocess.TimeoutExpired):
                    raise
                seconds = time.monotonic() - start
                raise StepFailed(
                    f"stopped after {seconds:.0f} s, the step's time; see {log}"
                ) from None
        seconds = time.monotonic() - start
        text = output.decode(errors="replace")
        log.with_suffix(".out").write_text(text, encoding="utf-8")
        if process.returncode not in codes:
            raise StepFailed(f"exit code {process.returncode}: {_last_line(log)}")
        return Done(process.returncode, seconds, text)


def read_runs(output: Path) -> list[Run]:
    """Return the runs in a results folder by their names, the last one where there are several."""
    folders = sorted(output.glob("*/*/results.json"), key=lambda path: path.stat().st_mtime)
    runs = {}
    for path in folders:
        header, records = read_run(path.parent, find_suite("nieh").records)
        runs[header.name] = Run(header.name, records)
    return [runs[name] for name in sorted(runs)]


def _last_line(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), f"see {log}")
