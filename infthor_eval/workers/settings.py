"""How many workers, and where: what every command that takes --workers is told."""

from dataclasses import dataclass

from infthor_eval.workers.link import Connect, OpenWorker
from infthor_eval.workers.processes import processes

__all__ = ["WorkerSettings"]


@dataclass(frozen=True)
class WorkerSettings:
    """How work is shared out; it changes no result.

    Attributes:
        workers: how many; 1 without a cluster is this process itself.
        ray_address: of a Ray cluster ("auto" for the one of this machine); None for processes of this machine.
        gpus_per_worker: that Ray sets aside for each; None takes one where the cluster has any.
    """

    workers: int = 1
    ray_address: str | None = None
    gpus_per_worker: float | None = None

    @property
    def is_local(self) -> bool:
        """Whether this process does it all."""
        return self.workers == 1 and self.ray_address is None

    def connect(self, open_worker: OpenWorker) -> Connect:
        """Links to the workers.

        Raises:
            UsageError: Ray is not installed, or there is no cluster at the address.
        """
        if self.ray_address is None:
            return processes(open_worker, self.workers)
        from infthor_eval.workers.ray_cluster import ray_actors  # an extra, and slow to import

        return ray_actors(open_worker, self.ray_address, self.gpus_per_worker)
