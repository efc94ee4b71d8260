"""Number and place of workers, as --workers and its companions give them.

Here are those that are processes of this machine, each with a share of its threads and GPUs.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from infthor_eval.errors import Terminated
from infthor_eval.process_settings import leave_safe_path, safe_path
from infthor_eval.workers.host import WorkerHost, to_portable_error
from infthor_eval.workers.link import Connect, OpenWorker, WorkerLostError

_STOP = "stop"
_TERMINATED = 143  # exit status
_EXIT_WAIT_S = 10.0  # for a process to end
_STOP_WAIT_S = 0.7  # for one that is stopped in the middle of something: Ctrl-C waits for nobody
# Spawned, not forked: a fork of a process with threads, a GPU or a simulator does not work.
_SPAWN = get_context("spawn")
_VISIBLE = "CUDA_VISIBLE_DEVICES"
_THREADS = "OMP_NUM_THREADS"
_DRIVER = Path("/proc/driver/nvidia/gpus")


@dataclass(frozen=True)
class WorkerSettings:
    """Number and place of workers; no result depends on it.

    Attributes:
        workers: number of workers; 1 without a cluster is this process itself.
        ray_address: address of a Ray cluster ("auto" for this machine's); None for processes of
            this machine.
        gpus_per_worker: GPUs that Ray reserves for each worker; None for one if the cluster has
            any.
    """

    workers: int = 1
    ray_address: str | None = None
    gpus_per_worker: float | None = None

    @property
    def is_local(self) -> bool:
        """True if this process does all the work."""
        return self.workers == 1 and self.ray_address is None

    def connect(self, open_worker: OpenWorker) -> Connect:
        """Return links to the workers."""
        if self.ray_address is None:
            return lambda number: _ProcessLink(open_worker, number, self.workers)
        from infthor_eval.workers.ray_cluster import ray_actors  # an extra, and slow to import

        return ray_actors(open_worker, self.ray_address, self.gpus_per_worker)


class _ProcessLink:
    """A worker in a process of this machine, with its share of processors and GPUs; see `Link`."""

    def __init__(self, open_worker: OpenWorker, number: int, count: int) -> None:
        self._open_worker = open_worker
        self._number = number
        self._count = count
        self._changing = Lock()  # one thread opens the link, another closes it
        # Of multiprocessing's spawn context, whose class has no public name.
        self._process: Any = None
        self._connection: Connection[Any, Any] | None = None
        self._is_busy = False

    def open(self) -> Any:
        """See `Link`."""
        self.close()
        with self._changing:
            self._start()
        with self._busy():
            self._send(self._open_worker)
            return self._receive()[1]

    def do(self, job: Any) -> Iterator[Any]:
        """See `Link`."""
        with self._busy():
            self._send(job)
            while True:
                more, value = self._receive()
                if not more:
                    return
                yield value

    def stop(self) -> None:
        """See `Link`."""
        if self._connection is not None:
            self._send(_STOP)

    def close(self) -> None:
        """See `Link`. The connection stays open: a thread that reads it must see its end."""
        with self._changing:
            if self._process is None:
                return
            self._process.terminate()
            self._process.join(_STOP_WAIT_S if self._is_busy else _EXIT_WAIT_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()

    @contextmanager
    def _busy(self) -> Iterator[None]:
        self._is_busy = True
        try:
            yield
        finally:
            self._is_busy = False

    def _start(self) -> None:
        self._connection, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(
            target=_serve,
            args=(theirs, self._number, self._count),
            name=f"worker-{self._number}",
            daemon=True,
        )
        with safe_path():
            self._process.start()
        theirs.close()

    def _send(self, message: Any) -> None:
        assert self._connection is not None
        try:
            self._connection.send(message)
        except (BrokenPipeError, ConnectionResetError) as error:
            raise self._lost_error() from error

    def _receive(self) -> tuple[bool, Any]:
        """Return whether the job goes on, and what the worker sent; raise what it raised."""
        assert self._connection is not None
        try:
            message = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._lost_error() from error
        if isinstance(message, Exception):
            raise message
        more, value = message
        return more, value

    def _lost_error(self) -> WorkerLostError:
        self._process.join(_EXIT_WAIT_S)
        return WorkerLostError(f"worker {self._number} died (exit status {self._process.exitcode})")


def _serve(connection: "Connection[Any, Any]", number: int, count: int) -> None:
    """Run a worker's process: create the worker it is sent; do jobs until the driver is gone."""
    leave_safe_path()
    # A terminal sends Ctrl-C to all processes; the driver decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _raise_terminated)
    _limit_devices(number, count)  # before imports that read them only once
    Thread(target=_end_with_driver, daemon=True).start()
    try:
        host = WorkerHost(connection.recv(), number)
    except Exception as error:  # noqa: BLE001 - sent to the driver, whatever it is
        _send(connection, to_portable_error(error))
        return
    try:
        _send(connection, (True, host.greeting))
        while (job := _next_job(connection)) is not None:
            _do(host, job, connection)
    finally:
        host.close()


def _raise_terminated(*_: object) -> None:
    raise Terminated(_TERMINATED)


def _do(host: WorkerHost, job: Any, connection: "Connection[Any, Any]") -> None:
    try:
        for result in host.do(job):
            connection.send((True, result))
            if connection.poll():
                assert connection.recv() == _STOP  # nothing else is sent during a job
                host.stop()
        connection.send((False, None))
    except (BrokenPipeError, ConnectionResetError):
        sys.exit(1)  # the driver is gone
    except Exception as error:  # noqa: BLE001 - sent to the driver, whatever it is
        _send(connection, to_portable_error(error))


def _next_job(connection: "Connection[Any, Any]") -> Any | None:
    """Return the next job, or None if the driver is gone."""
    try:
        while (message := connection.recv()) == _STOP:  # sent while the last job was ending
            pass
    except (EOFError, OSError):
        return None
    return message


def _send(connection: "Connection[Any, Any]", message: Any) -> None:
    try:
        connection.send(message)
    except (BrokenPipeError, ConnectionResetError):
        sys.exit(1)  # the driver is gone


def _end_with_driver() -> None:
    """End this process with its driver: a killed driver sends nothing, and its worker would go on
    for nobody."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)


def _visible_gpus() -> list[str]:
    """Return this process's GPUs, as CUDA names them, without torch, which would occupy them."""
    visible = os.environ.get(_VISIBLE)
    if visible is not None:
        return [name.strip() for name in visible.split(",") if name.strip()]
    return (
        [str(number) for number in range(len(list(_DRIVER.iterdir())))] if _DRIVER.is_dir() else []
    )


def _limit_devices(number: int, count: int) -> None:
    """Limit this process to the share of a worker (from 1) of `count`; a number of threads already
    set is kept."""
    os.environ.setdefault(_THREADS, str(max(1, (os.cpu_count() or 1) // count)))
    all_gpus = _visible_gpus()
    if all_gpus and count > 1:
        os.environ[_VISIBLE] = ",".join(all_gpus[(number - 1) % len(all_gpus) :: count])
