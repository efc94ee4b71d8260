"""NIEH results as numbers: a pure function of a run's journal."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import yaml

from infthor_eval.errors import DataError
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.question import ABSENCE, clue_column
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import SCORERS, Scorer, score
from infthor_eval.report.answer_form import format_failures, yes_no
from infthor_eval.runs.journal import UnitRecord
from infthor_eval.statistics import Estimate, bootstrap_interval, clustered_mean

__all__ = [
    "CLUE_COLUMNS",
    "Accuracy",
    "PublishedRow",
    "PublishedTable",
    "accuracies",
    "published_table4",
    "record_score",
    "summarise",
]

CLUE_COLUMNS = ("1", "2", ">=3", "total")  # the columns of the paper's Table 4


@dataclass(frozen=True)
class Accuracy:
    """Mean scores of some questions.

    Attributes:
        n: questions asked; a failed one counts as wrong.
        n_failed: questions that the model could not answer.
        scores: mean score in [0, 1] by scorer, with its interval; empty where no question was asked.
        bootstrap: 95 % interval over resampled trajectories by scorer; empty with fewer than two trajectories.
    """

    n: int
    n_failed: int
    scores: dict[Scorer, Estimate]
    bootstrap: dict[Scorer, tuple[float, float]]


@dataclass(frozen=True)
class PublishedRow:
    """One model's row: its name here, and percentages by column."""

    model: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class PublishedTable:
    """A table of the paper: rows by the paper's name of the model, and where they stand."""

    source: str
    context: str
    scorer: Scorer
    columns: tuple[str, ...]
    rows: dict[str, PublishedRow]


def accuracies(records: Sequence[UnitRecord]) -> dict[str, Accuracy]:
    """Accuracy by column of Table 4, and of absence questions: apart from those with clues, and in the total."""
    names = (*CLUE_COLUMNS, ABSENCE)
    columns = {name: [record for record in records if clue_column(record.n_clues) == name] for name in names}
    return {name: _accuracy(records if name == "total" else columns[name]) for name in names}


def summarise(identity: dict[str, Any], records: Iterable[UnitRecord]) -> dict[str, Any]:
    """Everything that a run found, as JSON values; the same journal gives the same text.

    Times and cache hits are not in it: they differ between a run and the same run resumed.
    """
    kept = sorted(records, key=lambda record: record.key)
    return {"run": identity, "tasks": {task: _task(kept, task, about) for task, about in identity["tasks"].items()}}


def _task(records: Sequence[UnitRecord], task: str, identity: Mapping[str, Any]) -> dict[str, Any]:
    of_task = [record for record in records if record.task == task]
    return {
        "n": len(of_task),
        "by_clues": {name: _as_json(accuracy) for name, accuracy in accuracies(of_task).items()},
        "by_question_type": _grouped(of_task, lambda record: record.question_type or "untyped"),
        "by_variant": _grouped(of_task, lambda record: record.variant or "-"),
        "left_out": _left_out(of_task, identity["left_out"]),
        "yes_no": yes_no(of_task),
        "format_failures": format_failures(of_task, identity["config"]["generation_kwargs"]["max_gen_toks"]),
        "below_full_marks": {
            scorer: [_name(record) for record in of_task if record_score(record, scorer) < 1.0] for scorer in SCORERS
        },
        "failures": [{"question": _name(record), "reason": record.failure} for record in of_task if record.failure],
    }


def _name(record: UnitRecord) -> str:
    return f"{record.question_id} {record.variant}".strip()


def _left_out(records: Sequence[UnitRecord], left_out: Sequence[Mapping[str, str]]) -> dict[str, Any]:
    """What was not asked, by reason, and the means with it counted as wrong: the other denominator."""
    n = len(records) + len(left_out)
    means = {str(s): math.fsum(record_score(r, s) for r in records) / n if n else None for s in SCORERS}
    reasons = Counter(item["reason"] for item in left_out)
    return {"n": len(left_out), "by_reason": dict(sorted(reasons.items())), "mean_counting_them_wrong": means}


def _grouped(records: Sequence[UnitRecord], name_of: Callable[[UnitRecord], str]) -> dict[str, Any]:
    names = sorted({name_of(record) for record in records})
    return {name: _as_json(_accuracy([r for r in records if name_of(r) == name])) for name in names}


def _accuracy(records: Sequence[UnitRecord]) -> Accuracy:
    trajectories = [record.traj_id for record in records]
    scores: dict[Scorer, Estimate] = {}
    bootstrap: dict[Scorer, tuple[float, float]] = {}
    for scorer in SCORERS if records else ():
        found = [record_score(record, scorer) for record in records]
        scores[scorer] = clustered_mean(found, trajectories)
        if scores[scorer].n_clusters > 1:
            bootstrap[scorer] = bootstrap_interval(found, trajectories)
    return Accuracy(len(records), sum(record.failure is not None for record in records), scores, bootstrap)


def record_score(record: UnitRecord, scorer: Scorer) -> float:
    """The score of a recorded reply; 0 where there is none."""
    return score(last_line(record.reply), record.answers, scorer) if record.reply is not None else 0.0


def _as_json(accuracy: Accuracy) -> dict[str, Any]:
    scores: dict[str, Any] = {
        scorer: {
            "mean": e.mean,
            "stderr": e.stderr,
            "low": e.low,
            "high": e.high,
            "bootstrap": accuracy.bootstrap.get(scorer),
            "n_trajectories": e.n_clusters,
        }
        for scorer, e in accuracy.scores.items()
    }
    return {"n": accuracy.n, "n_failed": accuracy.n_failed, **scores}


@cache
def published_table4() -> PublishedTable:
    """The paper's Table 4.

    Raises:
        DataError: the installation's copy is not what it should be.
    """
    path = packaged_folder("results") / "published" / "nieh_table4.yaml"
    table = yaml.safe_load(path.read_text(encoding="utf-8"))
    rows = {name: PublishedRow(row["model"], tuple(map(float, row["values"]))) for name, row in table["rows"].items()}
    if tuple(table["columns"]) != CLUE_COLUMNS or any(len(row.values) != len(CLUE_COLUMNS) for row in rows.values()):
        raise DataError(f"{path}: the columns must be {', '.join(CLUE_COLUMNS)}")
    return PublishedTable(table["source"], table["context"], table["scorer"], CLUE_COLUMNS, rows)
