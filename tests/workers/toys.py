"""A worker that counts, and that does what tests tell it to: die, refuse, raise."""

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError, ModelError

from ..helpers.waiting import wait_until


@dataclass(frozen=True)
class Job:
    """Count to a number.

    Attributes:
        number: to count to.
        dies: after how many results the worker dies.
        once: a file that says that a worker has died of it already; None dies every time.
        stuck: after how many results it hangs, as in native code, in which no signal is heard.
        raises: what is raised in the end.
        slow: seconds before each result.
        meets: an empty folder in which each worker leaves its name before its first result, and
            waits for another's.
    """

    number: int
    dies: int | None = None
    once: Path | None = None
    stuck: int | None = None
    raises: Exception | None = None
    slow: float = 0.0
    meets: Path | None = None


@dataclass(frozen=True)
class OpenCounter:
    """Makes counters; some workers refuse, die, or greet otherwise.

    Attributes:
        refusing: numbers of workers that cannot be made.
        dying: numbers of workers that die as they are made.
    """

    refusing: tuple[int, ...] = ()
    dying: tuple[int, ...] = ()

    def __call__(self, number: int) -> "Counter":
        if number in self.refusing:
            raise ModelError(f"no room for worker {number}")
        if number in self.dying:
            os.kill(os.getpid(), signal.SIGKILL)
        return Counter(number)


class Counter:
    """Counts; see `infthor_eval.workers.Worker`."""

    def __init__(self, number: int) -> None:
        self.greeting = {
            "pid": os.getpid(),
            "number": number,
            "threads": os.environ["OMP_NUM_THREADS"],
            "gpus": os.environ.get("CUDA_VISIBLE_DEVICES"),
            "safe path": os.environ.get("PYTHONSAFEPATH"),
        }

    def do(self, job: Job) -> Iterator[tuple[int, int]]:
        if job.meets is not None:
            (job.meets / str(os.getpid())).touch()
            wait_until(lambda: len(list(job.meets.iterdir())) > 1)
        for count in range(job.number):
            time.sleep(job.slow)
            if count == job.stuck:
                signal.signal(signal.SIGTERM, signal.SIG_IGN)
                time.sleep(600)
            if count == job.dies and not (job.once and job.once.exists()):
                if job.once:
                    job.once.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            yield os.getpid(), count
        if job.raises is not None:
            raise job.raises

    def close(self) -> None:
        """Nothing is held."""


def broken() -> DataError:
    """An error for people."""
    return DataError("the abacus is broken; buy another")
