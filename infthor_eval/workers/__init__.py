"""Workers that share jobs: this machine's processes, or a Ray cluster's actors."""

from infthor_eval.workers.host import WorkerHost
from infthor_eval.workers.jobs import run_jobs
from infthor_eval.workers.link import Connect, Link, OpenWorker, Worker, WorkerLostError
from infthor_eval.workers.pool import Event, JobFailed, JobResult, Pool, WorkerLost, WorkerWithdrawn
from infthor_eval.workers.settings import WorkerSettings

__all__ = [
    "Connect",
    "Event",
    "JobFailed",
    "JobResult",
    "Link",
    "OpenWorker",
    "Pool",
    "Worker",
    "WorkerHost",
    "WorkerLost",
    "WorkerLostError",
    "WorkerSettings",
    "WorkerWithdrawn",
    "run_jobs",
]
