"""Repeated answers as a table: how far the answers to one question agree."""

from collections.abc import Sequence

from infthor_eval.nieh.results.gains import name_of
from infthor_eval.nieh.results.summary import NiehSummary, main_metric
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, answered_cell

_NUMBERS = (
    "asked",
    "questions",
    "mean",
    "95 %",
    "drawing",
    "consensus",
    "agreement",
    "always",
    "sometimes",
    "never",
    "within",
    "between",
)
_NOTES = (
    "95 %: interval over other trajectories, with all that drawing adds. drawing: what the mean "
    "moves by if the same questions are asked again (95 %). consensus: score of each question's "
    "commonest answer; agreement: share of its answers that say it.",
    "always, sometimes, never: questions with full marks in all, some, none of their answers. "
    "within, between: standard deviation of the scores of one question, and of the questions' true "
    "means, in points.",
)


def repeat_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of runs with repeated answers; none if there are none."""
    rows = []
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        for name, of_task in run.summary.repeats.items():
            task = run.summary.tasks[name]
            score = task.total.scores[main_metric(task)]  # repeats are summed up from answers alone
            interval = (
                "-"
                if score.low is None or score.high is None
                else f"{_percent(score.low)}–{_percent(score.high)}"
            )
            shares = (
                of_task.consensus,
                of_task.agreement,
                of_task.always,
                of_task.sometimes,
                of_task.never,
            )
            spreads = (of_task.variance_within**0.5, of_task.variance_between**0.5)
            cells = (
                f"{of_task.n_repeats}x",
                str(of_task.n_questions),
                answered_cell(_percent(of_task.mean), of_task.n_questions, task.n),
                interval,
                f"±{_percent(of_task.drawing)}",
                *map(_percent, shares),
                *map(_percent, spreads),
            )
            rows.append(Row((name_of(run), name, *cells)))
    if not rows:
        return []
    columns = (Column("model", False), Column("task", False), *map(Column, _NUMBERS))
    return [Table("Answers that repeat, %, strict scorer", columns, tuple(rows), _NOTES)]


def _percent(value: float) -> str:
    return f"{100 * value:.1f}"
