"""`infthor-eval plan`: what a run will take, before it begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from infthor_eval.cli.options import FiniteRange, Whole
from infthor_eval.cli.run_options import run_options

if TYPE_CHECKING:
    from infthor_eval.runs import RunRequest, Suite

__all__ = ["command"]


@click.command("plan")
@click.option("--measure", type=Whole(1), default=6, show_default=True, help="Units of each task.")
@click.option(
    "--price-per-hour", type=FiniteRange(min=0), metavar="USD", help="Of the machine that a worker has, for its cost."
)
@run_options("measure", "price_per_hour")
def command(requests: list[tuple[RunRequest, Suite]], measure: int, price_per_hour: float | None) -> int:
    """Estimate what a run would take: requests, tokens, frames, memory, time and money.

    Takes the options of `run`. A few units of each task are done to tell, and nothing of them is kept.
    """
    from infthor_eval.cli.planning import plan

    return max([plan(*request, measure, price_per_hour) for request in requests], default=0)
