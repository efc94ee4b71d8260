"""Workers that share jobs: processes of this machine, or actors of a Ray cluster. Nothing here
knows evaluations."""

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
