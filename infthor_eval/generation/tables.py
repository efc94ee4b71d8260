"""What came of making and replaying trajectories, as tables on the terminal."""

from rich import box
from rich.table import Table

from infthor_eval.generation.generate_set import GenerationSummary
from infthor_eval.generation.replay_summary import ReplaySummary

__all__ = ["actions_table", "overlaps_table", "tasks_table"]


def tasks_table(summary: GenerationSummary) -> Table:
    """The tasks tried and accepted: a row per type."""
    table = Table("task", "tried", "accepted", box=box.SIMPLE_HEAD)
    for name, counts in summary.tasks.items():
        table.add_row(name, str(counts.tried), str(counts.accepted))
    return table


def actions_table(summary: ReplaySummary) -> Table:
    """The actions carried out and refused: a row per name."""
    table = Table("action", "accepted", "refused", "share", box=box.SIMPLE_HEAD)
    for name, counts in summary.actions.items():
        share = counts.accepted / (counts.accepted + counts.refused)
        table.add_row(name, str(counts.accepted), str(counts.refused), f"{share:.1%}")
    return table


def overlaps_table(summary: ReplaySummary) -> Table | None:
    """How well boxes meet the recorded ones: a row per action, then per object type; None without any box."""
    if not summary.iou:
        return None
    table = Table("action, object type", "boxes", "median IoU", "mean IoU", box=box.SIMPLE_HEAD)
    for name, overlap in {**summary.iou_by_action, **summary.iou}.items():
        table.add_row(name, str(overlap.count), f"{overlap.median:.2f}", f"{overlap.mean:.2f}")
    return table
