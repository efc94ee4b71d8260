"""Summary of a replayed set in numbers."""

import statistics
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence

import msgspec

from infthor_eval.generation.replay import Overlap, ReplayReport
from infthor_eval.generation.replay_set import ReplayedSet, ReplayFailure


class ActionCounts(msgspec.Struct):
    """Numbers of actions of one name."""

    accepted: int
    refused: int


class OverlapStatistics(msgspec.Struct):
    """Number of boxes, and median and mean overlap (IoU) of the rendered with the recorded ones."""

    count: int
    median: float
    mean: float


class Divergence(msgspec.Struct):
    """The first action of a trajectory that was refused."""

    traj_id: str
    step: int
    action: str
    error: str


class ReplaySummary(msgspec.Struct):
    """Numbers of a replayed set, as `--json` prints them.

    Attributes:
        trajectories: number of replayed trajectories, including those of earlier runs.
        resumed: number of trajectories that earlier runs replayed.
        failed: number of trajectories that could not be replayed.
        complete: number of trajectories without a refused action.
        floor_plans: number of scenes.
        actions: numbers of actions by name, the most frequent first.
        iou: overlaps of boxes by object type.
        iou_by_action: overlaps of boxes by action.
        seconds: wall time of this run.
        diverged: first refused action of each trajectory that has one.
        failures: trajectories that could not be replayed, with the reasons.
    """

    trajectories: int
    resumed: int
    failed: int
    complete: int = msgspec.field(name="whole")
    floor_plans: int
    actions: dict[str, ActionCounts]
    iou: dict[str, OverlapStatistics]
    iou_by_action: dict[str, OverlapStatistics]
    seconds: float
    diverged: list[Divergence]
    failures: list[ReplayFailure]


def summarise(replayed: ReplayedSet) -> ReplaySummary:
    """Return the numbers of a replayed set."""
    reports = replayed.reports
    overlaps = [overlap for report in reports for overlap in report.overlaps]
    return ReplaySummary(
        trajectories=len(reports),
        resumed=replayed.resumed,
        failed=len(replayed.failures),
        complete=sum(report.complete for report in reports),
        floor_plans=len({report.floor_plan for report in reports}),
        actions=_count_actions(reports),
        iou=_statistics(overlaps, lambda overlap: overlap.type),
        iou_by_action=_statistics(overlaps, lambda overlap: overlap.action),
        seconds=round(replayed.seconds, 2),
        diverged=[
            Divergence(report.traj_id, first.step, first.action, first.error)
            for report in reports
            for first in report.refusals[:1]
        ],
        failures=replayed.failures,
    )


def _count_actions(reports: Sequence[ReplayReport]) -> dict[str, ActionCounts]:
    accepted: Counter[str] = Counter()
    refused: Counter[str] = Counter()
    for report in reports:
        accepted.update(report.accepted)
        refused.update(refusal.action.split()[0] for refusal in report.refusals)
    names = sorted(accepted | refused, key=lambda name: (-(accepted[name] + refused[name]), name))
    return {name: ActionCounts(accepted[name], refused[name]) for name in names}


def _statistics(
    overlaps: Sequence[Overlap], by: Callable[[Overlap], str]
) -> dict[str, OverlapStatistics]:
    groups: defaultdict[str, list[float]] = defaultdict(list)
    for overlap in overlaps:
        groups[by(overlap)].append(overlap.iou)
    return {
        name: OverlapStatistics(
            len(values), round(statistics.median(values), 4), round(statistics.fmean(values), 4)
        )
        for name, values in sorted(groups.items())
    }
