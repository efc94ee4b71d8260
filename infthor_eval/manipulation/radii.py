"""Success over the radius of the hand's sphere, from the journals of runs with different ones."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from infthor_eval.errors import UsageError
from infthor_eval.manipulation.curve_runs import ArmRun, SharedEpisodes, shared_episodes
from infthor_eval.manipulation.kinds import ErrandKind
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord

__all__ = ["RadiusLine", "SuccessByRadius", "success_by_radius"]

Record = UnitRecord[ArmRecord]
Points = tuple[tuple[float, Rate], ...]


@dataclass(frozen=True)
class RadiusLine:
    """One model in episodes of one kind.

    Attributes:
        label: what the model is called.
        kind: of the episodes.
        is_bound: whether it is the planner, which the others are held against.
        is_embedded: whether its numbers are of the embedded simulator.
        points: share of successes by radius in metres, ascending.
        n_failed: episodes of all radii on which the model failed; they are no successes.
    """

    label: str
    kind: ErrandKind
    is_bound: bool
    is_embedded: bool
    points: Points
    n_failed: int = 0


@dataclass(frozen=True)
class SuccessByRadius:
    """Several models.

    Attributes:
        task: the tasks.
        lines: by kind, then in the order of the runs; the planner's last.
        floor: share of pick-ups whose object lies in the sphere at the start, by radius: had without moving. Empty
            where there are no pick-ups.
        n_trajectories: that the episodes are of.
        notes: what must be said with them, a line each.
    """

    task: str
    lines: tuple[RadiusLine, ...]
    floor: Points
    n_trajectories: int
    notes: tuple[str, ...]


def success_by_radius(runs: Sequence[ArmRun], tasks: str | None = None) -> SuccessByRadius:
    """Success of models by radius, on the episodes that all runs have.

    Runs of one label are one model with several radii. Episodes that a run excludes are left out of all of them.

    Args:
        runs: at least one.
        tasks: which tasks of theirs, separated by commas; None takes all that they share.

    Raises:
        UsageError: two runs have one label and radius, and as in `shared_episodes`.
        DataError: as in `shared_episodes`.
    """
    shared = shared_episodes(runs, tasks, one_radius=False)
    lines = [line for kind in shared.tasks for line in _lines(kind, runs, shared)]
    return SuccessByRadius(
        task=shared.named,
        lines=tuple(lines),
        floor=_floor(runs, shared),
        n_trajectories=len(shared.trajectories),
        notes=shared.notes,
    )


def _lines(kind: ErrandKind, runs: Sequence[ArmRun], shared: SharedEpisodes) -> list[RadiusLine]:
    found: dict[str, dict[float, tuple[ArmRun, list[Record]]]] = {}
    for number, run in enumerate(runs):
        radius = run.about.tasks[shared.tasks[kind]].radius
        radii = found.setdefault(run.label, {})
        if radius in radii:
            raise UsageError(
                f"two runs are called {run.label} and have a radius of {radius:g} m; leave one of them out"
            )
        radii[radius] = run, _of_kind(kind, shared, number)
    lines = [_line(label, kind, radii) for label, radii in found.items()]
    return sorted((line for line in lines if line.points), key=lambda line: line.is_bound)


def _line(label: str, kind: ErrandKind, radii: dict[float, tuple[ArmRun, list[Record]]]) -> RadiusLine:
    runs = [run for run, _ in radii.values()]
    return RadiusLine(
        label=label,
        kind=kind,
        is_bound=all(run.is_planner for run in runs),
        is_embedded=any(run.about.is_embedded for run in runs),
        points=_points({radius: [(_success(r), r) for r in records] for radius, (_, records) in radii.items()}),
        n_failed=sum(record.failure is not None for _, records in radii.values() for record in records),
    )


def _floor(runs: Sequence[ArmRun], shared: SharedEpisodes) -> Points:
    """Of the episodes of each radius, as the first run that acted in one recorded it."""
    task = shared.tasks.get(ErrandKind.PICKUP)
    if task is None:
        return ()
    found: dict[float, dict[str, Record]] = {}
    for number, run in enumerate(runs):
        acted = (r for r in _of_kind(ErrandKind.PICKUP, shared, number) if r.failure is None)
        episodes = found.setdefault(run.about.tasks[task].radius, {})
        episodes.update({record.id: record for record in acted if record.id not in episodes})
    return _points({
        radius: [(float(r.payload.starts_inside), r) for r in episodes.values()] for radius, episodes in found.items()
    })  # fmt: skip


def _of_kind(kind: ErrandKind, shared: SharedEpisodes, run: int) -> list[Record]:
    return [record for records in shared.records[run] for record in records if record.payload.kind == kind]


def _success(record: Record) -> float:
    return float(record.failure is None and record.payload.done)


def _points(radii: dict[float, list[tuple[float, Record]]]) -> Points:
    rates = ((radius, _rate(values)) for radius, values in sorted(radii.items()))
    return tuple((radius, rate) for radius, rate in rates if rate is not None)


def _rate(values: Iterable[tuple[float, Record]]) -> Rate | None:
    found = list(values)
    return clustered_rate([value for value, _ in found], [record.cluster for _, record in found])
