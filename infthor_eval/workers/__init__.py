"""Several workers at one piece of work: processes of this machine, or a Ray cluster's. It knows no evaluation."""

from infthor_eval.workers.link import Connect, Link, OpenWorker, Worker, WorkerLostError
from infthor_eval.workers.pool import Event, GivenUp, Lost, Made, Pool, Withdrawn
from infthor_eval.workers.serving import Serving
from infthor_eval.workers.settings import WorkerSettings
from infthor_eval.workers.sharing import shared_out

__all__ = [
    "Connect",
    "Event",
    "GivenUp",
    "Link",
    "Lost",
    "Made",
    "OpenWorker",
    "Pool",
    "Serving",
    "Withdrawn",
    "Worker",
    "WorkerLostError",
    "WorkerSettings",
    "shared_out",
]
