"""What runs in a worker, however its driver reaches it: the worker, the job in hand, and what goes wrong there."""

from collections.abc import Iterator
from threading import Event
from typing import Any

from infthor_eval.errors import InfthorError, describe_exception
from infthor_eval.workers.link import OpenWorker, Worker

__all__ = ["Serving", "portable"]


class Serving:
    """A worker with a way to leave off its job."""

    def __init__(self, open_worker: OpenWorker, number: int) -> None:
        """Make the worker; raises what that raises."""
        self._worker: Worker = open_worker(number)
        self._stopped = Event()

    @property
    def greeting(self) -> Any:
        """See `Worker`."""
        return self._worker.greeting

    def do(self, job: Any) -> Iterator[Any]:
        """See `Worker`; ends after the next result once `stop` was called."""
        self._stopped.clear()
        for result in self._worker.do(job):
            yield result
            if self._stopped.is_set():
                return

    def stop(self) -> None:
        """Leave off the job in hand after its next result."""
        self._stopped.set()

    def close(self) -> None:
        """See `Worker`."""
        self._worker.close()


def portable(error: BaseException) -> Exception:
    """An error as it is sent to the driver: errors for people and of the machine as they are, others in words."""
    if isinstance(error, InfthorError):
        return type(error)(str(error))
    if isinstance(error, MemoryError):
        return MemoryError(str(error))
    if isinstance(error, OSError):
        return OSError(error.errno, error.strerror, error.filename)
    told = describe_exception(error) if isinstance(error, Exception) else type(error).__name__
    return InfthorError(f"a worker failed: {told}; mend what is named and run the same command again")
