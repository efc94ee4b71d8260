"""What came of making and replaying trajectories, as tables."""

from infthor_eval.generation.generate_set import GenerationSummary
from infthor_eval.generation.replay_summary import ReplaySummary
from infthor_eval.tables import Column, Row, Table

__all__ = ["actions_table", "overlaps_table", "tasks_table"]


def tasks_table(summary: GenerationSummary) -> Table:
    """The tasks tried and accepted: a row per type."""
    rows = [Row((name, str(counts.tried), str(counts.accepted))) for name, counts in summary.tasks.items()]
    return Table("", (Column("task", False), Column("tried"), Column("accepted")), tuple(rows))


def actions_table(summary: ReplaySummary) -> Table:
    """The actions carried out and refused: a row per name."""
    rows = []
    for name, counts in summary.actions.items():
        share = counts.accepted / (counts.accepted + counts.refused)
        rows.append(Row((name, str(counts.accepted), str(counts.refused), f"{share:.1%}")))
    return Table("", (Column("action", False), *map(Column, ("accepted", "refused", "share"))), tuple(rows))


def overlaps_table(summary: ReplaySummary) -> Table | None:
    """How well boxes meet the recorded ones: a row per action, then per object type; None without any box."""
    if not summary.iou:
        return None
    rows = [
        Row((name, str(overlap.count), f"{overlap.median:.2f}", f"{overlap.mean:.2f}"))
        for name, overlap in {**summary.iou_by_action, **summary.iou}.items()
    ]
    columns = (Column("action, object type", False), *map(Column, ("boxes", "median IoU", "mean IoU")))
    return Table("", columns, tuple(rows))
