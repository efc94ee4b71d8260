"""What runs scored, a value for each run and task: all that the opening of the page is made of."""

from collections.abc import Iterator
from dataclasses import dataclass
from statistics import fmean

from infthor_eval.rates import Rate
from infthor_eval.run import Run
from infthor_eval.runs import UnitCounts, Usage


@dataclass(frozen=True)
class TaskResult:
    """What a run scored in a task. Shares are 0 to 1.

    Attributes:
        run: label of the run, with a mark if it is not whole.
        suite: heading of the suite.
        measure: what the score measures ("questions right").
        finding: the score as the predicate of a sentence ("gets {} of the questions right").
        rate: the score; None if no unit was answered.
        chance: what `blind` scores on the same units; None if it is not known.
        is_baseline: whether the subject is a baseline.
        units: numbers of units by state.
        n_tokens: mean tokens of what is read for a unit; None if they are not counted.
        seconds: mean time of a unit; None if none was attempted.
        cost: cost of all units in US dollars; None without prices.
        link: address of what is known of the run.
    """

    run: str
    suite: str
    task: str
    measure: str
    finding: str
    rate: Rate | None
    chance: float | None
    is_baseline: bool
    units: UnitCounts
    n_tokens: float | None
    seconds: float | None
    cost: float | None
    link: str = ""

    @property
    def n_all(self) -> int:
        """Number of units that were to have a result."""
        return self.units.answered + self.units.failed + self.units.not_asked


def task_results(run: Run, link: str = "") -> Iterator[TaskResult]:
    """Yield what a run scored in each of its tasks."""
    summary = run.summary.summary
    rates = run.suite.primary_metrics(summary)
    presenter = run.presenter
    for task in run.tasks:
        records = [record for record in run.records if record.task == task]
        attempted = [record for record in records if record.state in ("answered", "failed")]
        tokens = [
            record.tokens.context for record in attempted if record.tokens.context is not None
        ]
        yield TaskResult(
            run=run.label,
            suite=presenter.title or run.suite.name,
            task=task,
            measure=presenter.measure_of(task, summary),
            finding=presenter.finding_of(task, summary),
            rate=rates.get(task),
            chance=presenter.chance(task, summary, records),
            is_baseline=run.is_baseline,
            units=run.summary.units[task],
            n_tokens=fmean(tokens) if tokens else None,
            seconds=fmean(record.seconds for record in attempted) if attempted else None,
            cost=Usage.total(record.usage for record in records).cost,
            link=link,
        )
