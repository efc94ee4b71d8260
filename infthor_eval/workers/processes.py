"""Workers as processes of this machine."""

import os
import signal
import sys
from collections.abc import Iterator
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from threading import Lock, Thread
from types import FrameType
from typing import Any

from infthor_eval.workers.devices import own_devices
from infthor_eval.workers.link import Connect, OpenWorker, WorkerLostError
from infthor_eval.workers.serving import Serving, portable

__all__ = ["ProcessLink", "processes"]

_STOP = "stop"
_PATIENCE_S = 10.0  # for a process that was told to end
# Spawned, not forked: a fork of a process with threads, a GPU or a simulator is none that works.
_SPAWN = get_context("spawn")


def processes(open_worker: OpenWorker, count: int) -> Connect:
    """Links to processes of this machine, each with its share of processors and GPUs.

    Args:
        open_worker: makes a worker; must be picklable.
        count: how many there will be.
    """
    return lambda number: ProcessLink(open_worker, number, count)


class ProcessLink:
    """A worker in a process of its own; see `Link`."""

    def __init__(self, open_worker: OpenWorker, number: int, count: int) -> None:
        self._open_worker = open_worker
        self._number = number
        self._count = count
        self._changing = Lock()  # it is opened by one thread and closed by another
        self._process: Any = None  # of multiprocessing's spawn context, whose class has no public name
        self._connection: Connection[Any, Any] | None = None

    def open(self) -> Any:
        """See `Link`."""
        self.close()
        with self._changing:
            self._start()
        self._send(self._open_worker)
        return self._received()[1]

    def do(self, job: Any) -> Iterator[Any]:
        """See `Link`."""
        self._send(job)
        while True:
            more, value = self._received()
            if not more:
                return
            yield value

    def stop(self) -> None:
        """See `Link`."""
        if self._connection is not None:
            self._send(_STOP)

    def close(self) -> None:
        """See `Link`. The connection stays: a thread may be reading it, and is to find it at its end."""
        with self._changing:
            if self._process is None:
                return
            self._process.terminate()
            self._process.join(_PATIENCE_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()

    def _start(self) -> None:
        self._connection, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(
            target=_serve, args=(theirs, self._number, self._count), name=f"worker-{self._number}", daemon=True
        )
        self._process.start()
        theirs.close()

    def _send(self, message: Any) -> None:
        assert self._connection is not None
        try:
            self._connection.send(message)
        except (BrokenPipeError, ConnectionResetError) as error:
            raise self._lost() from error

    def _received(self) -> tuple[bool, Any]:
        """Whether the job goes on, and what came; raises what the worker raised."""
        assert self._connection is not None
        try:
            message = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(message, Exception):
            raise message
        more, value = message
        return more, value

    def _lost(self) -> WorkerLostError:
        self._process.join(_PATIENCE_S)
        return WorkerLostError(f"worker {self._number} died (exit status {self._process.exitcode})")


def _serve(connection: "Connection[Any, Any]", number: int, count: int) -> None:
    """The worker's process: opens the worker that it is sent, and does jobs until the driver is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends Ctrl-C to all; the driver says what follows
    signal.signal(signal.SIGTERM, _end)
    own_devices(number, count)  # before anything is imported that looks at them once
    Thread(target=_end_with_driver, daemon=True).start()
    try:
        serving = Serving(connection.recv(), number)
    except Exception as error:  # noqa: BLE001 - told to the driver, whatever it is
        _told(connection, portable(error))
        return
    try:
        _told(connection, (True, serving.greeting))
        while (job := _next_job(connection)) is not None:
            _do(serving, job, connection)
    finally:
        serving.close()


def _do(serving: Serving, job: Any, connection: "Connection[Any, Any]") -> None:
    try:
        for result in serving.do(job):
            connection.send((True, result))
            if connection.poll():
                assert connection.recv() == _STOP  # nothing else is said while a job is in hand
                serving.stop()
        connection.send((False, None))
    except (BrokenPipeError, ConnectionResetError):
        sys.exit(1)  # the driver is gone
    except Exception as error:  # noqa: BLE001 - told to the driver, whatever it is
        _told(connection, portable(error))


def _next_job(connection: "Connection[Any, Any]") -> Any | None:
    """The next job; None where the driver is gone."""
    try:
        while (message := connection.recv()) == _STOP:  # said as the last job ended
            pass
    except (EOFError, OSError):
        return None
    return message


def _told(connection: "Connection[Any, Any]", message: Any) -> None:
    try:
        connection.send(message)
    except (BrokenPipeError, ConnectionResetError):
        sys.exit(1)  # the driver is gone


def _end(_number: int, _frame: FrameType | None) -> None:
    sys.exit(143)


def _end_with_driver() -> None:
    """A driver that was killed says nothing: its worker would go on with a unit that nobody waits for."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)
