"""Workers as actors of a Ray cluster, on the nodes that it has now or gets later."""

import contextlib
from collections.abc import Iterator
from typing import Any

from infthor_eval.errors import InfthorError, UsageError, in_one_line
from infthor_eval.workers.host import WorkerHost, to_portable_error
from infthor_eval.workers.link import Connect, OpenWorker, WorkerLostError

_CLOSE_WAIT_S = 5.0  # for an actor to release its resources


def ray_actors(open_worker: OpenWorker, address: str, gpus_per_worker: float | None) -> Connect:
    """Return links to actors of a cluster.

    The package must be installed on every node, and the folders of data and results must be the
    same on all of them.

    Args:
        open_worker: creates a worker.
        address: address of the cluster, for `ray.init`.
        gpus_per_worker: GPUs of each worker; None for one if the cluster has any.
    """
    try:
        import ray
    except ImportError as error:
        raise UsageError("--ray-address needs Ray; pip install 'infthor-eval[ray]'") from error
    try:
        if not ray.is_initialized():
            ray.init(address=address, log_to_driver=False, logging_level="error")
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise UsageError(
            f"--ray-address {address}: no Ray cluster there ({in_one_line(error)}); start one"
        ) from error
    if gpus_per_worker is None:
        gpus_per_worker = 1.0 if ray.cluster_resources().get("GPU", 0) else 0.0
    # Two calls at a time: a job, and the call that stops it.
    actor = ray.remote(max_concurrency=2, num_cpus=1, num_gpus=gpus_per_worker)(_Actor)
    return lambda number: RayLink(actor, open_worker, number)


class _Actor:
    """A worker on a node of the cluster."""

    def __init__(self, open_worker: OpenWorker, number: int) -> None:
        self._open_worker = open_worker
        self._number = number
        self._host: WorkerHost | None = None

    def open(self) -> Any:
        try:
            self._host = WorkerHost(self._open_worker, self._number)
        except Exception as error:  # noqa: BLE001 - sent to the driver, whatever it is
            return to_portable_error(error)
        return self._host.greeting

    def do(self, job: Any) -> Iterator[Any]:
        assert self._host is not None
        try:
            yield from self._host.do(job)
        except Exception as error:  # noqa: BLE001 - sent to the driver, whatever it is
            yield to_portable_error(error)

    def stop(self) -> None:
        if self._host is not None:
            self._host.stop()

    def close(self) -> None:
        if self._host is not None:
            self._host.close()


class RayLink:
    """A worker that is a Ray actor; see `Link`."""

    def __init__(self, actor: Any, open_worker: OpenWorker, number: int) -> None:
        self._actor_class = actor
        self._open_worker = open_worker
        self._number = number
        self._actor: Any = None

    def open(self) -> Any:
        """See `Link`; waits until a node has room for the worker."""
        self.close()
        self._actor = self._actor_class.remote(self._open_worker, self._number)
        return self._resolve(self._actor.open.remote())

    def do(self, job: Any) -> Iterator[Any]:
        """See `Link`."""
        for reference in self._actor.do.options(num_returns="streaming").remote(job):
            yield self._resolve(reference)

    def stop(self) -> None:
        """See `Link`."""
        if self._actor is not None:
            self._actor.stop.remote()

    def close(self) -> None:
        """See `Link`."""
        import ray

        if self._actor is not None:
            # It is gone, or busy; it is killed in either case.
            with contextlib.suppress(ray.exceptions.RayError):
                ray.get(self._actor.close.remote(), timeout=_CLOSE_WAIT_S)
            ray.kill(self._actor)

    def _resolve(self, reference: Any) -> Any:
        import ray

        try:
            value = ray.get(reference)
        except (ray.exceptions.RayActorError, ray.exceptions.ObjectLostError) as error:
            raise WorkerLostError(
                f"worker {self._number} is lost ({in_one_line(error)})"
            ) from error
        except ray.exceptions.RayError as error:
            raise InfthorError(
                f"worker {self._number} failed ({in_one_line(error)}); see Ray's logs"
            ) from error
        if isinstance(value, Exception):
            raise value
        return value
