"""The options of commands whose work several workers can share."""

import click

from infthor_eval.cli.options.values import default_option, together
from infthor_eval.workers import WorkerSettings

_MAX_WORKERS = 4096

# The options of workers; a command passes them to `parse_worker_settings`.
worker_options = together(
    default_option(
        "--workers",
        click.IntRange(1, _MAX_WORKERS),
        default=1,
        help="Processes that share the work; the results are the same.",
    ),
    click.option(
        "--ray-address",
        metavar="ADDRESS",
        help='Run the workers on this Ray cluster ("auto": on this machine).',
    ),
    click.option(
        "--gpus-per-worker",
        type=click.FloatRange(0),
        help="GPUs that Ray reserves for each worker; default: one where the cluster has any.",
    ),
)


def parse_worker_settings(
    workers: int, ray_address: str | None, gpus_per_worker: float | None
) -> WorkerSettings:
    """Return the settings that the three options give.

    Raises:
        click.UsageError: --gpus-per-worker without --ray-address.
    """
    if gpus_per_worker is not None and ray_address is None:
        raise click.UsageError(
            "--gpus-per-worker is for --ray-address; processes of one machine share its GPUs"
        )
    return WorkerSettings(workers, ray_address, gpus_per_worker)
