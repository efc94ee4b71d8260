"""Two runs on the same questions: by how much the second is better, and how surely."""

from collections.abc import Iterable
from dataclasses import dataclass

from infthor_eval.errors import DataError
from infthor_eval.nieh.scoring import SCORERS, Scorer
from infthor_eval.report.nieh_results import record_score
from infthor_eval.runs.journal import UnitRecord
from infthor_eval.statistics import Difference, paired_difference

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True)
class Comparison:
    """One task, one scorer.

    Attributes:
        task: the lm-eval task.
        scorer: which scorer.
        first: mean score of the first run on the shared questions.
        second: that of the second run.
        difference: second minus first, paired by question and clustered by trajectory.
        n_unshared: questions that only one of the runs asked; they are not compared.
    """

    task: str
    scorer: Scorer
    first: float
    second: float
    difference: Difference
    n_unshared: int


def compare(first: Iterable[UnitRecord], second: Iterable[UnitRecord]) -> list[Comparison]:
    """Compare two runs on the questions that both were asked, from the same gold answers.

    Raises:
        DataError: they share no question.
    """
    ours, theirs = ({record.key: record for record in records} for records in (first, second))
    shared = [key for key in ours if key in theirs]
    if not shared:
        raise DataError("the two runs share no question of the same task; compare runs on the same set")
    found = []
    for task in sorted({key[0] for key in shared}):
        keys = [key for key in shared if key[0] == task]
        unshared = sum(key[0] == task for key in ours.keys() ^ theirs.keys())
        for scorer in SCORERS:
            a = [record_score(ours[key], scorer) for key in keys]
            b = [record_score(theirs[key], scorer) for key in keys]
            difference = paired_difference(a, b, [ours[key].traj_id for key in keys])
            found.append(Comparison(task, scorer, sum(a) / len(a), sum(b) / len(b), difference, unshared))
    return found
