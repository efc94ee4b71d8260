"""Progress of long work: a bar on a terminal, elsewhere lines with its rate and the time left."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rich.progress import Progress

from infthor_eval.cli.progress.pace import Pace

if TYPE_CHECKING:
    from infthor_eval.generation.simulator_jobs import JobProgress


class PacedBar:
    """Shows the progress of one piece of work.

    Attributes:
        pace: how fast it goes.
    """

    def __init__(self, progress: Progress, name: str, total: int, n_resumed: int = 0) -> None:
        """Start a bar.

        Args:
            progress: draws the bar; its console gets lines where it is no terminal.
            name: name of the work.
            total: units in all.
            n_resumed: units that an earlier run had done and that `advance` is not called for.
        """
        self.pace = Pace(total, time.monotonic(), n_resumed)
        self._name = name
        self._progress = progress
        self._bar = progress.add_task(name, total=total, completed=n_resumed)

    def advance(
        self, resumed: bool = False, *, context: int = 0, cached: int = 0, detail: str = ""
    ) -> None:
        """Count a unit.

        Args:
            resumed: whether an earlier run had done it.
            context: tokens of its requests to a model.
            cached: tokens of these that were not encoded again.
            detail: text beside the pace.
        """
        now = time.monotonic()
        self.pace.count(resumed, now, context, cached)
        name = f"{self._name}: {detail}" if detail else self._name
        self._progress.update(self._bar, advance=1, description=f"{name}  {self.pace.rest(now)}")
        if self._progress.disable and self.pace.is_due(now):
            self._progress.console.print(
                f"{self._name}: {self.pace.line(now)}{f'; {detail}' if detail else ''}"
            )


class JobBar:
    """Shows how far the present one of several jobs is, below the bar of all of them."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._bar = progress.add_task("", visible=False)
        self._name = ""
        self._shown_at = time.monotonic()
        self._pace = Pace(0, self._shown_at)

    def show(self, job: JobProgress) -> None:
        """Show how far a job is; another name than before starts the bar anew."""
        if job.name != self._name:
            self._name = job.name
            self._pace = Pace(job.n_units, self._shown_at)
        self._shown_at = now = time.monotonic()
        self._pace.go_on(job.n_done, job.n_units)
        detail = f"; {job.detail}" if job.detail else ""
        self._progress.update(
            self._bar,
            completed=job.n_done,
            total=job.n_units,
            description=f"{job.name}  {self._pace.rest(now)}{detail}",
            visible=True,
        )
        if self._progress.disable and self._pace.is_due(now):
            self._progress.console.print(f"{job.name}: {self._pace.line(now)}{detail}")


class StepBars:
    """A bar for each part of a training, started at its first step, when its length is known."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._bars: dict[str, PacedBar] = {}

    def advance(self, part: str, step: int, n_steps: int, detail: str) -> None:
        """Count a step.

        Args:
            part: part of the training.
            step: number of the step in its part, from 1; a resumed training starts at a later one.
            n_steps: steps of the part.
            detail: text beside the pace.
        """
        if part in self._bars:
            self._bars[part].advance(detail=detail)
        else:  # the start of the first step is not known, so it does not count for the pace
            self._bars[part] = PacedBar(self._progress, part, n_steps, n_resumed=step)
