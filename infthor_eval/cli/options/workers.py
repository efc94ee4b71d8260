"""The options of every command whose work several workers can share."""

import functools
from collections.abc import Callable
from typing import Any

import click

from infthor_eval.workers import WorkerSettings

__all__ = ["worker_options"]

_MOST = 4096


def worker_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --workers and what goes with it to a command, which is given one `WorkerSettings` as `worker_settings`."""

    @click.option(
        "--workers",
        type=click.IntRange(1, _MOST),
        default=1,
        show_default=True,
        help="Processes that share the work; the results are the same.",
    )
    @click.option(
        "--ray-address",
        metavar="ADDRESS",
        help='Have the workers on this Ray cluster ("auto": the one of this machine).',
    )
    @click.option(
        "--gpus-per-worker",
        type=click.FloatRange(0),
        help="GPUs that Ray sets aside for each worker; else one where the cluster has any.",
    )
    @functools.wraps(command)
    def with_staffing(
        *args: Any, workers: int, ray_address: str | None, gpus_per_worker: float | None, **rest: Any
    ) -> Any:
        if gpus_per_worker is not None and ray_address is None:
            raise click.UsageError("--gpus-per-worker is for --ray-address; processes of one machine share its GPUs")
        return command(*args, worker_settings=WorkerSettings(workers, ray_address, gpus_per_worker), **rest)

    return with_staffing
