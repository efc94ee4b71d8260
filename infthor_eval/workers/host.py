"""The worker's end of a link, whatever carries it: the worker, its present job, and its errors."""

from collections.abc import Iterator
from threading import Event
from typing import Any

from infthor_eval.errors import InfthorError, describe_exception
from infthor_eval.workers.link import OpenWorker, Worker


class WorkerHost:
    """A worker whose job can be stopped."""

    def __init__(self, open_worker: OpenWorker, number: int) -> None:
        """Create the worker; raises what that raises."""
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
        """Stop the present job after its next result."""
        self._stopped.set()

    def close(self) -> None:
        """See `Worker`."""
        self._worker.close()


def to_portable_error(error: BaseException) -> Exception:
    """Return an error that the driver can unpickle: our own and the system's as they are, others as
    a description."""
    if isinstance(error, InfthorError):
        return type(error)(str(error))
    if isinstance(error, MemoryError):
        return MemoryError(str(error))
    if isinstance(error, OSError):
        return OSError(error.errno, error.strerror, error.filename)
    description = (
        describe_exception(error) if isinstance(error, Exception) else type(error).__name__
    )
    return InfthorError(
        f"a worker failed: {description}; fix the named code and run the same command again"
    )
