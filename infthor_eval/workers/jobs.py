"""Jobs of one result each, done by workers, as commands do with --workers.

To add a command that shares its work: an `OpenWorker`, given to `run_jobs`.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Any

from infthor_eval.errors import InfthorError
from infthor_eval.workers.link import OpenWorker, WorkerLostError
from infthor_eval.workers.pool import JobFailed, JobResult, Pool, WorkerLost, WorkerWithdrawn
from infthor_eval.workers.settings import WorkerSettings


def run_jobs(
    open_worker: OpenWorker,
    jobs: Sequence[Any],
    worker_settings: WorkerSettings,
    notify: Callable[[str], None],
) -> Iterator[tuple[int, Any | InfthorError]]:
    """Yield each job's number with its result, or an error if worker after worker was lost at it.

    Args:
        open_worker: creates a worker, which gives one result for each job.
        worker_settings: number and place of the workers; a local one does the jobs in this process,
            in order.
        notify: called with a line when a worker is lost or cannot be started.

    Raises:
        Exception: a worker raised it; all workers are ended.
    """
    if worker_settings.is_local:
        yield from _run_here(open_worker, jobs)
        return
    n_workers = min(worker_settings.workers, max(1, len(jobs)))
    with closing(Pool(worker_settings.connect(open_worker), n_workers)) as pool:
        pool.open()
        for event in pool.run(len(jobs), lambda number: jobs[number]):
            if isinstance(event, JobResult):
                yield event.job, event.result
            elif isinstance(event, JobFailed):
                yield (
                    event.job,
                    WorkerLostError(f"worker after worker was lost at it ({event.reason})"),
                )
            elif isinstance(event, WorkerLost):
                notify(f"{event.reason}; its work goes to another")
            elif isinstance(event, WorkerWithdrawn):
                notify(f"worker {event.worker} cannot be started, the others go on: {event.reason}")


def _run_here(open_worker: OpenWorker, jobs: Sequence[Any]) -> Iterator[tuple[int, Any]]:
    with closing(open_worker(1)) as worker:
        for number, job in enumerate(jobs):
            for result in worker.do(job):
                yield number, result
