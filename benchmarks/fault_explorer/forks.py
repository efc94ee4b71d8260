"""Commands of ours in forks of a process that has imported all they need: a run takes its own time.

Starting Python and importing torch would take seconds each time, and there are thousands of runs.
"""

import atexit
import contextlib
import ctypes
import functools
import importlib
import os
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fault_explorer.control import Control, Fault
from infthor_eval import plugins
from infthor_eval.cli import main
from infthor_eval.runs import catalog

__all__ = ["Ended", "Forks", "Place"]

_LIMIT_S = 180.0  # of a run: longer is a hang
_CHILDREN_S = 10.0  # after which what a run started must have ended
_POLL_S = 0.005
_SET_CHILD_SUBREAPER = 36  # of prctl
_SET_PDEATHSIG = 1
_HUNG = -1000


@dataclass(frozen=True)
class Place:
    """The folders of an exploration."""

    root: Path

    @property
    def out(self) -> Path:
        """What is cut; every run has this path, which is in some files."""
        return self.root / "out"

    @property
    def inputs(self) -> Path:
        """What runs read."""
        return self.root / "inputs"

    @property
    def temporary(self) -> Path:
        """TMPDIR."""
        return self.root / "tmp"


@dataclass(frozen=True)
class Ended:
    """How a run ended.

    Attributes:
        code: exit code; minus the signal's number if one ended it.
        said: what it wrote on both streams.
        orphans: processes that it started and that did not end.
    """

    code: int
    said: str
    orphans: int = 0

    @property
    def hung(self) -> bool:
        """Whether it did not end by itself."""
        return self.code == _HUNG

    @property
    def was_killed(self) -> bool:
        """Whether SIGKILL ended it."""
        return self.code == -signal.SIGKILL

    @property
    def last_line(self) -> str:
        """The last line that it wrote."""
        lines = [line for line in self.said.splitlines() if line.strip()]
        return lines[-1] if lines else ""


class Forks:
    """Runs commands in forks of this process, which adopts what they leave behind."""

    def __init__(self, place: Place, control: Control) -> None:
        """Take over this process: its temporary folder, and the orphans of its forks."""
        self._place = place
        self._control = control
        self._said = place.root / "said.txt"
        ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        os.environ["TMPDIR"] = str(place.temporary)
        os.environ["XDG_CACHE_HOME"] = str(place.root / "cache")
        tempfile.tempdir = None
        # What is installed, and the packaged task files, are read once and not in each fork.
        plugins.entry_points = functools.cache(plugins.entry_points)
        catalog.read_yaml = functools.cache(catalog.read_yaml)
        self.clear_temporary()

    def clear_temporary(self) -> None:
        """Empty the temporary folder."""
        shutil.rmtree(self._place.temporary, ignore_errors=True)
        self._place.temporary.mkdir()

    def import_for(self, words: Sequence[str]) -> None:
        """Import here all that a command needs: a fork runs it and says what it has imported."""
        names = self._place.root / "modules.txt"
        self.run(words, names=names)
        for name in names.read_text().split():
            if name.partition(".")[0] == "transformers_modules" or name == "__main__":
                continue
            with contextlib.suppress(Exception):  # a module that only its package can import
                importlib.import_module(name)

    def run(
        self,
        words: Sequence[str],
        fault: Fault | None = None,
        at: int = 0,
        *,
        names: Path | None = None,
    ) -> Ended:
        """Run a command to its end; its call `at` fails."""
        process = self.start(words, self._said, fault, at, names=names)
        return self.wait(process, self._said)

    def start(
        self,
        words: Sequence[str],
        said: Path,
        fault: Fault | None = None,
        at: int = 0,
        *,
        is_watched: bool = True,
        names: Path | None = None,
    ) -> int:
        """Start a command; returns the number of its process."""
        sys.stdout.flush()
        sys.stderr.flush()
        process = os.fork()
        if process:
            return process
        code = 70
        try:
            ctypes.CDLL(None).prctl(_SET_PDEATHSIG, signal.SIGKILL)  # one that stands still, too
            _write_into(said)
            if is_watched:
                self._control.watch(self._place.out, fault, at)
            code = _exit_code(words)
            atexit._run_exitfuncs()  # as at the end of Python, which a fork does not reach
            if names is not None:
                names.write_text("\n".join(sys.modules))
        finally:
            os._exit(code)

    def wait_until_paused(self, process: int) -> bool:
        """Wait until a process stands still, or has ended; returns whether it stands."""
        while True:
            ended = os.waitid(os.P_PID, process, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
            if ended is not None:
                return ended.si_code == os.CLD_STOPPED

    def wait_a_while(self, process: int, seconds: float) -> None:
        """Wait for the end of a process, but not for long."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if os.waitid(os.P_PID, process, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None:
                return
            time.sleep(_POLL_S)

    def wait(self, process: int, said: Path) -> Ended:
        """Wait for the end of a command, and of what it started."""
        return self.wait_all({process: said})[0]

    def wait_all(self, commands: Mapping[int, Path]) -> list[Ended]:
        """Wait for the end of commands, given what each writes to, and of what they started."""
        end = time.monotonic() + _LIMIT_S
        statuses: dict[int, int] = {}
        while not commands.keys() <= statuses.keys():
            statuses |= _reap()
            if time.monotonic() > end:
                break
            time.sleep(_POLL_S)
        hung = commands.keys() - statuses.keys()
        for process in hung:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
        orphans = self._await_children()
        return [
            Ended(
                _HUNG if process in hung else os.waitstatus_to_exitcode(statuses[process]),
                said.read_text(errors="replace"),
                orphans,
            )
            for process, said in commands.items()
        ]

    def _await_children(self) -> int:
        """Wait until all processes that a run started have ended; returns how many did not."""
        end = time.monotonic() + _CHILDREN_S
        while children := _children():
            if time.monotonic() > end:
                for child in children:
                    os.kill(child, signal.SIGKILL)
                    os.waitpid(child, 0)
                return len(children)
            _reap()
            time.sleep(_POLL_S)
        return 0


def _write_into(said: Path) -> None:
    """Let both streams of this process write into a file, and read nothing."""
    file = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)


def _exit_code(words: Sequence[str]) -> int:
    try:
        main([str(word) for word in words])
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:  # noqa: BLE001 - as Python ends with whatever it is
        traceback.print_exc()
        return 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return 0


def _reap() -> dict[int, int]:
    """Return the status of each child that has ended."""
    ended = {}
    with contextlib.suppress(ChildProcessError):
        while True:
            child, status = os.waitpid(-1, os.WNOHANG)
            if not child:
                break
            ended[child] = status
    return ended


def _children() -> list[int]:
    children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    return [int(child) for child in children]
