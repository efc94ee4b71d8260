"""Jobs that each need a simulator, done by workers with one simulator each, and how far one is."""

import gc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from infthor_eval.errors import InfthorError
from infthor_eval.thor.simulator import Simulator


@dataclass(frozen=True)
class JobProgress:
    """How far a job is.

    Attributes:
        name: name of its trajectory.
        n_done: low-level actions so far.
        n_units: low-level actions in all, as far as that is known.
        detail: what was refused so far, in words; empty for nothing.
    """

    name: str
    n_done: int
    n_units: int
    detail: str = ""


OnProgress = Callable[[JobProgress], None]


def ignore_progress(_: JobProgress) -> None:
    """Do nothing."""


class _JobOutcome(Protocol):
    @property
    def is_resumed(self) -> bool:
        """True if the result is of an earlier run."""


T = TypeVar("T", bound=_JobOutcome)


class SimulatorWorker:
    """A worker with a simulator (`workers.Worker`); a `partial` of its first arguments opens it.

    Args:
        open_simulator: starts the simulator; pickled as `run_job` is.
        run_job: does one job in the simulator; it is pickled, so it must be a module's function or
            a `partial` of one.
        number: number of the worker.
    """

    greeting = None

    def __init__(
        self,
        open_simulator: Callable[[], Simulator],
        run_job: Callable[[Any, Simulator], Any],
        number: int,
    ) -> None:
        self._run_job = run_job
        self._simulator = open_simulator()

    def do(self, job: Any) -> Iterator[Any]:
        """Yield the outcome of a job."""
        yield self._run_job(job, self._simulator)

    def close(self) -> None:
        """Stop the simulator."""
        self._simulator.close()


def collect_outcomes(
    outcomes: Iterable[tuple[int, T | InfthorError]],
    failed: Callable[[int, InfthorError], T],
    advance: Callable[[bool], None],
) -> list[T]:
    """Return the outcomes in the order of the jobs.

    Args:
        outcomes: number and outcome of each job as they finish; an error if its workers were lost.
        failed: returns the outcome of a job that ended in an error.
        advance: called after each job, with True if its result is of an earlier run.
    """
    by_number: dict[int, T] = {}
    for number, outcome in outcomes:
        result = failed(number, outcome) if isinstance(outcome, InfthorError) else outcome
        by_number[number] = result
        advance(result.is_resumed)
    return [by_number[number] for number in sorted(by_number)]


@contextmanager
def freeze_existing_objects() -> Iterator[None]:
    """Exempt all existing objects, which are mainly those of libraries, from garbage collection.

    Each reply of the simulator decodes to thousands of objects, which trigger collections over all
    objects again and again: 40 % of the processor time of a long loop of steps
    (`benchmarks/generation_growth.py`).
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
