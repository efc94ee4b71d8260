"""Jobs of one result each, shared out: what generating, replaying and asking do with --workers."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from infthor_eval.errors import InfthorError
from infthor_eval.workers.link import OpenWorker, WorkerLostError
from infthor_eval.workers.pool import GivenUp, Lost, Made, Pool, Withdrawn
from infthor_eval.workers.settings import WorkerSettings

__all__ = ["shared_out"]


def shared_out(
    open_worker: OpenWorker, jobs: Sequence[Any], worker_settings: WorkerSettings, say: Callable[[str], None]
) -> Iterator[tuple[int, Any | InfthorError]]:
    """The result of each job with its number, as they come; an error where worker after worker was lost at it.

    Args:
        open_worker: makes a worker, which gives one result a job.
        jobs: what to do.
        worker_settings: who does it; alone, it is done in this process, in the order given.
        say: is told what becomes of workers, a line each.

    Raises:
        Exception: what a worker raises, which ends all of them.
    """
    if worker_settings.is_local:
        yield from _alone(open_worker, jobs)
        return
    pool = Pool(worker_settings.connect(open_worker), min(worker_settings.workers, max(1, len(jobs))))
    try:
        pool.open()
        for event in pool.run(len(jobs), lambda number: jobs[number]):
            if isinstance(event, Made):
                yield event.job, event.result
            elif isinstance(event, GivenUp):
                yield event.job, WorkerLostError(f"worker after worker was lost at it ({event.reason})")
            elif isinstance(event, Lost):
                say(f"{event.reason}; its work goes to another")
            elif isinstance(event, Withdrawn):
                say(f"worker {event.worker} cannot be started, the others go on: {event.reason}")
    finally:
        pool.close()


def _alone(open_worker: OpenWorker, jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    worker = open_worker(1)
    try:
        for number, job in enumerate(jobs):
            for result in worker.do(job):
                yield number, result
    finally:
        worker.close()
