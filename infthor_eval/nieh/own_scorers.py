"""Scorers that are not this package's: a function in a user's file, or in another package.

A scorer is given a whole reply and the gold answers, and returns its score, or several by name.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Answer
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.plugins import PluginTable
from infthor_eval.quantities import require_number
from infthor_eval.questions.asking import MetricError, wrap_metric_errors
from infthor_eval.runs import UnitKey, UnitRecord
from model_adapters.adapter_identity import package_identity
from model_adapters.own_file import file_identity, load_from_file, name_in_file, names_a_file

_SCORERS = PluginTable("scorer", "infthor_eval.scorers", {}, "docs/own-tasks.md")

ScoreReply = Callable[[str, Sequence[Answer]], float | Mapping[str, float]]


class _Scorer(Protocol):
    """What another package's scorer must have: nothing but that it can be called."""

    def __call__(self, reply: str, answers: Sequence[Answer]) -> float | Mapping[str, float]: ...


@dataclass(frozen=True)
class OwnScores:
    """The scores of a scorer of one's own.

    Attributes:
        names: its metrics.
        by_unit: scores of each reply by metric, or why there are none.
    """

    names: tuple[str, ...]
    by_unit: Mapping[UnitKey, dict[str, float] | MetricError]


@dataclass(frozen=True)
class OwnScorer:
    """A scorer of one's own.

    Attributes:
        name: its name, which is that of its metric if it returns a number.
        function: called with a reply and the gold answers.
        source: what distinguishes its code from other versions of it, as JSON values.
    """

    name: str
    function: ScoreReply
    source: Mapping[str, Any]

    def score_all(
        self, records: Sequence[UnitRecord[NiehAnswer]], reserved: Sequence[str]
    ) -> OwnScores:
        """Return the scores of all records, each with a reply.

        The first reply that is scored has the names of the metrics. A reply with others fails.

        Args:
            records: the records.
            reserved: names that are no metric's of its own.
        """
        names: tuple[str, ...] = ()
        by_unit: dict[UnitKey, dict[str, float] | MetricError] = {}
        for record in records:
            try:
                scores = self._score(record, names)
            except MetricError as error:
                by_unit[record.key] = error
            else:
                by_unit[record.key], names = scores, names or tuple(scores)
        names = names or (self.name,)
        taken = next((name for name in names if name in reserved), None)
        if taken is not None:
            raise UsageError(
                f"--scorer {self.name}: calls its metric {taken}, as one of ours is called; rename "
                "it"
            )
        return OwnScores(names, by_unit)

    def _score(self, record: UnitRecord[NiehAnswer], names: Sequence[str]) -> dict[str, float]:
        with wrap_metric_errors(f"{self.name} fails"):  # the record has the question
            result = self.function(record.payload.reply or "", record.payload.answers)
            scores = result if isinstance(result, Mapping) else {self.name: result}
            if not scores or (names and set(scores) != set(names)):
                raise ValueError(
                    f"it gives {', '.join(map(str, scores)) or 'nothing'}, not {', '.join(names)}"
                )
            for name in scores:
                str(name).encode()  # it is in the run's config
            return {str(name): require_number(str(name), scores[name]) for name in names or scores}


def find_scorer(name: str) -> OwnScorer:
    """Return the scorer FILE.py:NAME, or an entry point `infthor_eval.scorers` of that name."""
    if names_a_file(name):
        scorer = OwnScorer(
            name_in_file(name), load_from_file(name, "function"), file_identity(name)
        )
    elif name in _SCORERS.names:
        source = package_identity(_SCORERS.entry_points()[name])
        scorer = OwnScorer(name, _SCORERS.load(name, _Scorer), source)
    else:
        installed = (
            f"there are {', '.join(_SCORERS.names)}" if _SCORERS.names else "no package has any"
        )
        raise UsageError(
            f"unknown scorer {name!r}; write FILE.py:NAME, or the name of a package's ({installed})"
        )
    if not callable(scorer.function):
        raise UsageError(
            f"--scorer {name}: is not a function of a reply and the gold answers; make it one"
        )
    return scorer
