"""A piece of work that takes its time: a bar on a terminal, elsewhere lines with its rate and the time left."""

import time

from rich.progress import Progress

from infthor_eval.cli.progress.pace import Pace
from infthor_eval.runs import NOTHING, Usage

__all__ = ["PacedBar", "StepBars"]


class PacedBar:
    """Tells how far a piece of work has come.

    Attributes:
        pace: how fast it goes.
    """

    def __init__(self, progress: Progress, name: str, total: int, n_found: int = 0) -> None:
        """Begin.

        Args:
            progress: draws the bar; its console is written to where it is no terminal.
            name: what is told of it.
            total: units.
            n_found: of them, by an earlier run, which are not counted one by one.
        """
        self.pace = Pace(total, time.monotonic(), n_found)
        self._name = name
        self._progress = progress
        self._bar = progress.add_task(name, total=total, completed=n_found)

    def advance(self, resumed: bool = False, *, usage: Usage = NOTHING, said: str = "") -> None:
        """A unit is done.

        Args:
            resumed: an earlier run had done it.
            usage: of models.
            said: what is told beside the pace.
        """
        now = time.monotonic()
        self.pace.count(usage, resumed, now)
        name = f"{self._name}: {said}" if said else self._name
        self._progress.update(self._bar, advance=1, description=f"{name}  {self.pace.speed(now)}")
        if not self._progress.console.is_terminal and self.pace.is_due(now):
            self._progress.console.print(f"{self._name}: {self.pace.line(now)}{f'; {said}' if said else ''}")


class StepBars:
    """A bar for each part of a training, from its first step on: nobody knows before how many there will be."""

    def __init__(self, progress: Progress) -> None:
        """Begin.

        Args:
            progress: draws the bars.
        """
        self._progress = progress
        self._bars: dict[str, PacedBar] = {}

    def advance(self, part: str, step: int, n_steps: int, said: str) -> None:
        """A step is done.

        Args:
            part: of the training.
            step: its number in the part, from 1 on; the first that is told of may be a later one.
            n_steps: of the part.
            said: what is told beside the pace.
        """
        if part in self._bars:
            self._bars[part].advance(said=said)
        else:  # when this one began is not known
            self._bars[part] = PacedBar(self._progress, part, n_steps, n_found=step)
