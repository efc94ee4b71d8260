"""Number and place of workers, as --workers and its companions give them."""

from dataclasses import dataclass

from infthor_eval.workers.link import Connect, OpenWorker
from infthor_eval.workers.processes import processes


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
        """Return links to the workers.

        Raises:
            UsageError: Ray is not installed, or there is no cluster at the address.
        """
        if self.ray_address is None:
            return processes(open_worker, self.workers)
        from infthor_eval.workers.ray_cluster import ray_actors  # an extra, and slow to import

        return ray_actors(open_worker, self.ray_address, self.gpus_per_worker)
