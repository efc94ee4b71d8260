"""Results that nobody measured."""

from infthor_eval.rates import Rate
from infthor_eval.report.headline.results import TaskResult
from infthor_eval.runs import UnitCounts


def make_result(run: str, mean: float | None, **changes) -> TaskResult:
    """The score of a run in a task; None for a run without any."""
    n = changes.pop("n", 40)
    n_all = changes.pop("n_all", n)
    rate = None if mean is None else Rate(mean, mean / 2, mean / 2 + 0.5, n).out_of(n_all)
    answered = 0 if mean is None else n
    fields = {
        "suite": "Questions",
        "task": "nieh_gt",
        "measure": "questions right",
        "finding": "gets {} of the questions right",
        "chance": 0.25,
        "is_baseline": False,
        "n_tokens": 100.0,
        "seconds": 0.5,
        "cost": None,
    }
    units = UnitCounts(answered=answered, failed=n_all - answered)
    return TaskResult(run=run, rate=rate, units=units, **{**fields, **changes})
