"""The exploration of one kind: each fault at each of its calls, then the same command again."""

import gc
import hashlib
import os
import shutil
import signal
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fault_explorer.control import CallKind, Control, Fault
from fault_explorer.forks import Ended, Forks, Place
from fault_explorer.kinds import Kind
from fault_explorer.trees import Tree, difference, read_tree

__all__ = ["Cut", "Exploration", "explore"]

_BESIDE_S = 3.0  # that another process has, at most, while the first stands still
_PASSING_S = 0.5  # semaphores of other programs have a name for less
_KIND_OF_NAME = 8  # characters of a temporary file's name; those after them are random
# What does not depend on the call that it comes at: so many calls of each kind, evenly.
_SPARSE = {
    Fault.READ_ONLY: 10,
    Fault.PAUSE: 10,
    Fault.CLOCK_BACK: 3,
    Fault.CLOCK_FORWARD: 3,
}
_TOLD = 2  # exit code of a command that says in one line why not
_ENDS = (0, 1, _TOLD)


@dataclass(frozen=True)
class Cut:
    """One fault at one call, and what came of it.

    Attributes:
        call: name and path of the call.
        lost: what was lost, or left behind; None if nothing.
        told: why the same command does not go on, in its own line; None if it did.
    """

    fault: Fault
    at: int
    call: str
    lost: str | None = None
    told: str | None = None


@dataclass
class Exploration:
    """What is known of a kind.

    Attributes:
        calls: what each call of an uncut run does.
        n_points: number of cuts to be made.
        n_possible: that number with all faults, each at as many calls as it is to come at.
        cuts: those so far.
        n_states: number of different states that they left, from each of which the command was
            run again.
    """

    kind: str
    calls: list[CallKind]
    n_points: int = 0
    n_possible: int = 0
    cuts: list[Cut] = field(default_factory=list)
    n_states: int = 0
    seconds: float = 0.0


class _LostError(Exception):
    """Something was lost, or is left behind."""


class _Explorer:
    def __init__(self, kind: Kind, place: Place, control: Control) -> None:
        self._kind = kind
        self._place = place
        self._control = control
        self._forks = Forks(place, control)
        self._expected: Tree = {}
        self._seen: dict[str, str | _LostError | None] = {}
        self._shared: set[str] = set()  # before a cut

    def prepare(self) -> list[CallKind]:
        """Make the inputs, import what is needed, and return the calls of an uncut run."""
        if self._kind.simulates:
            from fault_explorer.players import fork_players

            fork_players()
        self._kind.files(self._place.inputs)
        for words in self._kind.inputs(self._place):
            _require(self._forks.run(words), (0,))
        self._start_anew()
        self._forks.import_for(self._words())
        gc.collect()
        gc.freeze()  # or each fork would copy the pages of all objects
        self._start_anew()
        ended = self._forks.run(self._words())
        _require(ended, (0, 1))
        calls = self._control.calls()
        self._expected = read_tree(self._place.out)
        self._start_anew()
        _require(self._forks.run(self._words()), (ended.code,))
        problem = difference(self._expected, read_tree(self._place.out))
        if problem is not None or self._control.calls() != calls:
            raise SystemExit(
                f"{self._kind.name}: two uncut runs differ: {problem or 'their calls'}"
            )
        self._code = ended.code
        return calls

    @property
    def n_states(self) -> int:
        """Number of different states that were left so far."""
        return len(self._seen)

    def cut(self, fault: Fault, at: int) -> Cut:
        """Let one call fail, and run the command again."""
        self._start_anew()
        self._shared = _shared_memory()
        told = lost = None
        call = ""
        try:
            if fault is Fault.PAUSE:
                self._run_two(at)
            else:
                ended = self._forks.run(self._words(), fault, at)
                call = self._control.failed_call
                self._check_cut(ended, fault)
            told = self._go_on()
        except _LostError as error:
            lost = str(error)
        return Cut(fault, at, call, lost, told)

    def _go_on(self) -> str | None:
        """Run the command again; return the line of a refusal.

        From what an earlier cut has left already, it would do the same again.
        """
        state = self._state()
        if state not in self._seen:
            try:
                self._seen[state] = self._check_again(self._forks.run(self._words()))
                self._check_leavings()
            except _LostError as lost:
                self._seen[state] = lost
        known = self._seen[state]
        if isinstance(known, _LostError):
            raise known
        return known

    def _state(self) -> str:
        """Return a digest of all that the next run finds."""
        temporary = sorted(path.name[:_KIND_OF_NAME] for path in self._place.temporary.iterdir())
        tree = read_tree(self._place.out)
        return hashlib.sha256(repr((temporary, sorted(tree.items()))).encode()).hexdigest()

    def _words(self) -> Sequence[str | Path]:
        return self._kind.words(self._place)

    def _start_anew(self) -> None:
        shutil.rmtree(self._place.out, ignore_errors=True)
        if self._kind.start is None:
            self._place.out.mkdir()
        else:
            shutil.copytree(self._place.inputs / self._kind.start, self._place.out)
        self._forks.clear_temporary()

    def _check_cut(self, ended: Ended, fault: Fault) -> None:
        """Hold the cut run to what it is to do: die, or say in one line what is wrong."""
        if fault in (Fault.KILL, Fault.TORN):
            if not ended.was_killed and self._control.failed_call:
                raise _LostError(f"was not killed: {ended.code}")
            return
        self._check_end(ended, "the cut run")
        if ended.code == self._code:
            problem = difference(self._expected, read_tree(self._place.out))
            if problem is not None:
                raise _LostError(f"ended well, but {problem}")

    def _check_end(self, ended: Ended, who: str) -> None:
        if ended.hung:
            raise _LostError(f"{who} hangs")
        if "Traceback" in ended.said:
            raise _LostError(f"{who} ends with a traceback: {ended.last_line}")
        if ended.code not in _ENDS:
            raise _LostError(f"{who} ends with {ended.code}: {ended.last_line}")
        if ended.code == _TOLD and not ended.last_line.startswith("infthor-eval: "):
            raise _LostError(f"{who} does not say why it ends: {ended.last_line}")
        if ended.orphans:
            raise _LostError(f"{who} leaves {ended.orphans} processes")

    def _check_again(self, again: Ended) -> str | None:
        """Return the line of a refusal; None if all is as after an uncut run."""
        self._check_end(again, "the next run")
        if again.code == _TOLD and again.code != self._code:
            return again.last_line
        if again.code != self._code:
            raise _LostError(f"the next run ends with {again.code}: {again.last_line}")
        problem = difference(self._expected, read_tree(self._place.out))
        if problem is not None:
            raise _LostError(problem)
        return None

    def _check_leavings(self) -> None:
        left = sorted(path.name for path in self._place.temporary.iterdir())
        if left:
            raise _LostError(f"left in the temporary folder: {', '.join(left)}")
        left = _abandoned(_shared_memory() - self._shared)
        if left:
            raise _LostError(f"left in shared memory: {', '.join(left)}")

    def _run_two(self, at: int) -> None:
        """Run the command twice at once: one stands still at a call while the other goes."""
        said = [self._place.root / f"said-{number}.txt" for number in (1, 2)]
        first = self._forks.start(self._words(), said[0], Fault.PAUSE, at)
        paused = self._forks.wait_until_paused(first)
        second = self._forks.start(self._words(), said[1], is_watched=False)
        if paused:
            self._forks.wait_a_while(second, _BESIDE_S)
            os.kill(first, signal.SIGCONT)
        ended = self._forks.wait_all({first: said[0], second: said[1]})
        for each, who in zip(ended, ("the first", "the second"), strict=True):
            self._check_end(each, who)
        if self._code not in (each.code for each in ended):
            raise _LostError(f"of two, none ends well: {ended[0].last_line} / {ended[1].last_line}")


def _shared_memory() -> set[str]:
    return {path.name for path in Path("/dev/shm").iterdir()}


def _abandoned(names: set[str]) -> list[str]:
    """Return those in shared memory that no process has: what a cut run started has ended, so
    others are of other programs."""
    if not names:
        return []
    time.sleep(_PASSING_S)
    used = "".join(map(_maps, Path("/proc").glob("[0-9]*")))
    return sorted(name for name in names & _shared_memory() if f"/dev/shm/{name}" not in used)


def _maps(process: Path) -> str:
    try:
        return (process / "maps").read_text()
    except OSError:  # it has ended, or is another user's
        return ""


def _require(ended: Ended, codes: tuple[int, ...]) -> None:
    if ended.code not in codes or "Traceback" in ended.said:
        raise SystemExit(f"an uncut run ended with {ended.code}: {ended.said[-2000:]}")


def explore(
    kind: Kind, place: Place, control: Control, faults: Sequence[Fault], most: int | None = None
) -> Iterator[Exploration]:
    """Cut a kind of run; yields what is known so far after each cut.

    Args:
        faults: the faults.
        most: cuts of each fault, at most, evenly over the calls; None for all.
    """
    began = time.monotonic()
    explorer = _Explorer(kind, place, control)
    result = Exploration(kind.name, explorer.prepare())
    points = [(fault, at) for fault in faults for at in _points(fault, result.calls, most)]
    result.n_points = len(points)
    result.n_possible = sum(len(_points(fault, result.calls, None)) for fault in Fault)
    for fault, at in points:
        result.cuts.append(explorer.cut(fault, at))
        result.n_states = explorer.n_states
        result.seconds = time.monotonic() - began
        yield result


def _points(fault: Fault, calls: Sequence[CallKind], most: int | None) -> list[int]:
    """Return the numbers of the calls that a fault comes at."""
    points = [at for at, call in enumerate(calls, 1) if fault.suits(call)]
    limits = [limit for limit in (most, _SPARSE.get(fault)) if limit is not None]
    return _evenly(points, min(limits, default=len(points)))


def _evenly(points: list[int], most: int) -> list[int]:
    if len(points) <= most:
        return points
    return [points[number * len(points) // most] for number in range(most)]
