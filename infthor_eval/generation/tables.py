"""Tables of generated and replayed trajectories."""

from collections.abc import Sized

from infthor_eval.generation.generate_set import GenerationSummary
from infthor_eval.generation.replay_summary import OverlapStatistics, ReplaySummary
from infthor_eval.tables import Column, Row, Table

_MAX_REASONS = 3  # in a line
_EXACT = 0.995  # an IoU that is shown as 1.00


def tasks_table(summary: GenerationSummary) -> Table:
    """Return the numbers of tasks tried and accepted, one row per task type."""
    rows = [
        Row((name, str(counts.tried), str(counts.accepted)))
        for name, counts in summary.tasks.items()
    ]
    tried = sum(counts.tried for counts in summary.tasks.values())
    accepted = sum(counts.accepted for counts in summary.tasks.values())
    rows.append(Row(("all", str(tried), str(accepted))))
    return Table("", (Column("task", False), Column("tried"), Column("accepted")), tuple(rows))


def final_tasks_table(summary: GenerationSummary) -> Table:
    """Return when the objects of each trajectory's final task were seen, by fifths of its steps."""
    when = {True: "one in the first fifth alone, one in the last alone", False: "elsewhere, too"}
    rows = [Row((name, when[memory])) for name, memory in summary.final_tasks.items()]
    columns = Column("trajectory", False), Column("objects of its final task were seen", False)
    return Table("", columns, tuple(rows))


def generation_notes(summary: GenerationSummary) -> list[str]:
    """Return lines on a run's failures, its dead ends, and the pools of tasks that began again."""
    n_not_executed = sum(summary.not_executed.values())
    notes = [
        (
            n_not_executed,
            f"{n_not_executed} sampled tasks not executed: {_most_frequent(summary.not_executed)}",
        ),
        (len(summary.refusals), f"tried and failed: {_most_frequent(summary.refusals)}"),
        (len(summary.roll_backs), f"dropped at dead ends: {'; '.join(summary.roll_backs)}"),
        (
            summary.pool_restarts,
            f"all tasks had been drawn, and were drawn again: {summary.pool_restarts} times",
        ),
        (summary.kept, f"gave up and were kept as far as they got: {summary.kept}"),
    ]
    return [note for number, note in notes if number]


def _most_frequent(reasons: dict[str, int]) -> str:
    first = list(reasons.items())[:_MAX_REASONS]
    return "; ".join(f"{reason} ({count})" for reason, count in first)


def refusals_table(summary: ReplaySummary) -> Table | None:
    """Return the numbers of actions that were ever refused, a row per name; None without any."""
    rows = []
    for name, counts in summary.actions.items():
        share = counts.accepted / (counts.accepted + counts.refused)
        if counts.refused:
            rows.append(Row((name, str(counts.accepted), str(counts.refused), f"{share:.1%}")))
    columns = (Column("action", False), *map(Column, ("accepted", "refused", "share")))
    return Table("", columns, tuple(rows)) if rows else None


def overlaps_table(summary: ReplaySummary) -> Table | None:
    """Return the overlaps of boxes that differ, by action and type; None without any."""
    rows = [
        Row((name, str(overlap.count), f"{overlap.median:.2f}", f"{overlap.mean:.2f}"))
        for name, overlap in {**summary.iou_by_action, **summary.iou}.items()
        if not _is_exact(overlap)
    ]
    numbers = map(Column, ("boxes", "median IoU", "mean IoU"))
    columns = (Column("action, object type", False), *numbers)
    return Table("", columns, tuple(rows)) if rows else None


def regular_numbers(summary: ReplaySummary) -> str:
    """Return one line on the actions and boxes that are as recorded, which the tables leave out."""
    accepted = [counts.accepted for counts in summary.actions.values() if not counts.refused]
    exact = [overlap.count for overlap in summary.iou_by_action.values() if _is_exact(overlap)]
    parts = []
    if accepted:
        which = _all_or_other(accepted, summary.actions)
        parts.append(f"{which}{sum(accepted)} actions accepted")
    if exact:
        which = _all_or_other(exact, summary.iou_by_action)
        parts.append(f"{which}{sum(exact)} boxes as recorded (IoU 1.00)")
    return (
        f"{', '.join(parts) or 'nothing as recorded'} (--json has the numbers by action and object "
        "type)"
    )


def _all_or_other(regular: Sized, everything: Sized) -> str:
    return "all " if len(regular) == len(everything) else "other "


def _is_exact(overlap: OverlapStatistics) -> bool:
    return min(overlap.median, overlap.mean) >= _EXACT
