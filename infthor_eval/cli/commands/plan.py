"""`infthor-eval plan`: estimate time, memory and cost of a run."""

import resource
import sys
from collections.abc import Sequence
from typing import Any

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.run import RunOptions, run_options
from infthor_eval.cli.options.values import FiniteFloat, WholeNumber, default_option
from infthor_eval.cli.progress.notes import NOTES, print_note, prints_as_notes
from infthor_eval.cli.progress.pace import format_duration
from infthor_eval.cli.progress.runs import check_others, print_workload
from infthor_eval.errors import ModelError
from infthor_eval.reasons import count_reasons
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.runs import RunRequest, Suite, TaskEstimate, estimate_run, prepare_all
from infthor_eval.tables import Column, Row, Table
from infthor_eval.terminal import progress_bar

_COLUMNS = ("units", "measured", "frames", "requests", "tokens read", "encoded", "written", "time")


@example_command("plan", "infthor-eval plan --model qwen2.5-vl --tasks nieh --price-per-hour 2.5")
@default_option("--measure", WholeNumber(1), 6, "Units of each task to measure.")
@click.option(
    "--price-per-hour",
    type=FiniteFloat(min=0),
    metavar="USD",
    help="Price of a worker's machine, for the cost.",
)
@run_options
def command(measure: int, price_per_hour: float | None, **params: Any) -> int:
    """Estimate what a run would take: requests, tokens, frames, memory, time and money.

    Takes the options of `run`. A few units of each task are evaluated to measure, and not kept.
    """
    requests = RunOptions.from_click(params).requests()
    check_others(prepare_all(requests))
    return max([plan(*request, measure, price_per_hour) for request in requests])


def plan(request: RunRequest, suite: Suite, measure: int, price_per_hour: float | None) -> int:
    """Print the estimate of one run.

    Args:
        measure: units of each task to measure.
        price_per_hour: price of a worker's machine in US dollars; None for no such cost.

    Returns:
        Exit code: 1 if a measured sample failed, else 0.
    """
    with progress_bar(NOTES) as progress, prints_as_notes():
        bar = progress.add_task(f"{request.label}: measuring", total=None)
        estimate = estimate_run(request, suite, measure, lambda: progress.advance(bar))
    print_workload(estimate.workload)
    for task, reason, n in count_reasons(estimate.failures):
        print_note(f"{task}: {n} measured sample(s) failed: {reason}", "red")
    if not estimate.tasks:
        raise ModelError(f"{request.label}: every measured sample failed; fix the failures above")
    console = table_console()
    print_table(_table(request, estimate.tasks), console)
    for line in _totals(request, estimate.tasks, price_per_hour):
        console.print(line)
    return int(bool(estimate.failures))


def _table(request: RunRequest, tasks: Sequence[TaskEstimate]) -> Table:
    title = (
        f"Estimate for {request.label}, from {sum(task.n_measured for task in tasks)} measured "
        "samples"
    )
    return Table(title, (Column("task", False), *map(Column, _COLUMNS)), tuple(map(_row, tasks)))


def _row(task: TaskEstimate) -> Row:
    total = task.total
    counts = [task.n_units, task.n_measured, task.frames, total.requests]
    counts += [total.read, total.encoded, total.written]
    cells = (f"{round(count):,}" for count in counts)
    return Row((task.task, *cells, format_duration(total.seconds)))


def _totals(
    request: RunRequest, tasks: Sequence[TaskEstimate], price_per_hour: float | None
) -> list[str]:
    seconds = sum(task.total.seconds for task in tasks)
    workers = request.worker_settings.workers
    by_all = f", {format_duration(seconds / workers)} by {workers} workers" if workers > 1 else ""
    lines = [f"time: {format_duration(seconds)} of one worker{by_all}, loading not counted"]
    lines.append(f"memory: {_peak_megabytes():,} MB at most while measuring{_gpu_memory()}")
    cost = sum(task.total.cost for task in tasks)
    if cost:
        lines.append(f"money: {cost:.2f} US dollars, by the prices of the model")
    if price_per_hour is not None:
        price = seconds / 3600 * price_per_hour
        lines.append(f"money: {price:.2f} US dollars of machines at {price_per_hour:g} an hour")
    return lines


def _peak_megabytes() -> int:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # in kilobytes, but for macOS
    return peak // (1024 * 1024 if sys.platform == "darwin" else 1024)


def _gpu_memory() -> str:
    torch = sys.modules.get("torch")  # loaded by the model, where it needs it
    if torch is None or not torch.cuda.is_available():
        return ""
    return f", {torch.cuda.max_memory_allocated() // 2**20:,} MB of the GPU"
