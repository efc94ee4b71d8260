"""A model's effective context length: the longest at which it keeps 85 % of its score on clues.

The rule is NoLiMa's (Modarressi et al. 2025), with the model's own score on the clue frames alone
as its base. It is applied to windows of growing size around the evidence (`nieh_haystack`), to the
last frames (`nieh_truncate_head`) and to whole trajectories by their length (`nieh_full`); to plain
scores and to those above blind.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from infthor_eval.nieh.results.cells import percent
from infthor_eval.nieh.results.facets import LENGTH
from infthor_eval.nieh.results.summary import NiehSummary, TaskSummary
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table

KEPT = 0.85  # share of the base that counts as kept
_SIZED = ("haystack", "truncate_head")


class _Point(NamedTuple):
    """Scores at one length, from 0 to 1; None if nothing was asked there."""

    length: str  # in thousand tokens
    score: float | None
    above: float | None


@dataclass(frozen=True)
class Series:
    """The scores of a model in one kind of context by its length, and on the clue frames."""

    model: str
    context: str
    scorer: str
    base: _Point
    points: Sequence[_Point]


def effective_lengths(runs: Sequence[RunSummary]) -> list[Table]:
    """Return a table by model, kind of context and scorer; none without a run on clues."""
    rows = []
    for series in find_series(runs):
        by_score = {point.length: point.score for point in series.points}
        by_above = {point.length: point.above for point in series.points}
        rows.append(
            Row(
                (
                    *(series.model, series.context, series.scorer),
                    *(percent(series.base.score), effective_length(series.base.score, by_score)),
                    *(percent(series.base.above), effective_length(series.base.above, by_above)),
                    ", ".join(f"{point.length}K {percent(point.score)}" for point in series.points),
                )
            )
        )
    if not rows:
        return []
    names = ("base", "effective length", "base above blind", "effective length above blind")
    heads = [Column(name, False) for name in ("model", "context", "scorer")]
    note = (
        f"Effective length: the longest context, in thousand tokens, up to which {KEPT:.0%} of the "
        "base, the score on the clue frames alone, is kept. A row of whole trajectories has their "
        "lengths in bins."
    )
    columns = (*heads, *map(Column, names), Column("scores by length", False))
    return [Table("Effective length of the context", columns, tuple(rows), (note,))]


def effective_length(base: float | None, scores: Mapping[str, float | None]) -> str:
    """Return the longest of some lengths, ascending, up to which the base is kept; `-` if there is
    no base above 0."""
    if base is None or base <= 0:
        return "-"
    lengths = [length for length, score in scores.items() if score is not None]
    kept = ""
    for length in lengths:
        score = scores[length]
        if score is None or _is_lost(score, base):
            return f"{kept}K" if kept else f"below {length}K"
        kept = length
    return f"{kept}K, all that were asked" if kept else "-"


def _is_lost(score: float, base: float) -> bool:
    # Means of questions are rounded.
    return score < KEPT * base and not math.isclose(score, KEPT * base)


def find_series(runs: Sequence[RunSummary]) -> Iterator[Series]:
    """Yield the series of each model that was also asked on the same set's clue frames."""
    by_subject: dict[str, list[tuple[RunSummary, str, TaskSummary]]] = {}
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        for name, task in run.summary.tasks.items():
            config = run.header.config
            subject = repr((config.model, config.frames, config.tasks[name].data))
            by_subject.setdefault(subject, []).append((run, name, task))
    for items in by_subject.values():
        base = next(
            (
                (run, task)
                for run, _, task in items
                if task.context == "clues" and task.total.scores
            ),
            None,
        )
        if base is None:
            continue
        run, on_clues = base
        for context, tasks in _lengths(items).items():
            for scorer in on_clues.metrics:
                points = [
                    point
                    for sized in tasks
                    if scorer in sized[1].metrics
                    for point in _points(sized, scorer)
                ]
                if points:
                    yield Series(
                        run.header.label, context, scorer, _point("", on_clues, scorer), points
                    )


def _lengths(
    items: Sequence[tuple[RunSummary, str, TaskSummary]],
) -> dict[str, list[tuple[float, TaskSummary]]]:
    """Return tasks by kind of context, with their thousand tokens (0: binned), ascending."""
    chosen: dict[str, list[tuple[float, TaskSummary]]] = {}
    for run, name, task in items:
        size = run.header.config.tasks[name].dataset_kwargs.get("ctx_size")
        if task.context in _SIZED and size:
            chosen.setdefault(task.context, []).append((float(size), task))
        elif task.context == "trajectory":
            chosen.setdefault(task.context, []).append((0.0, task))
    return {context: sorted(tasks, key=lambda sized: sized[0]) for context, tasks in chosen.items()}


def _points(sized: tuple[float, TaskSummary], scorer: str) -> Iterator[_Point]:
    size, task = sized
    if size:
        yield _point(f"{size:g}", task, scorer)
        return
    for name, cell in task.by[LENGTH.name].items():
        score = cell.scores.get(scorer)
        above = task.above_blind_by_length[name].get(scorer)
        yield _Point(name, score.mean if score else None, above)


def _point(length: str, task: TaskSummary, scorer: str) -> _Point:
    score = task.total.scores.get(scorer)
    above = task.above_blind.get(scorer)
    return _Point(length, score.mean if score else None, above.mean if above else None)
