"""Success over the radius of the hand's sphere, from the journals of runs with different radii."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.episodes.shared_units import SharedUnits
from infthor_eval.errors import UsageError
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.recorded.runs import ArmRun, shared_episodes, task_kinds
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.rates import Rate, clustered_rate
from infthor_eval.runs import UnitRecord

Record = UnitRecord[ArmRecord]
Points = tuple[tuple[float, Rate], ...]


@dataclass(frozen=True)
class RadiusLine:
    """One model in episodes of one kind.

    Attributes:
        is_bound: whether it is the planner, which bounds the others.
        is_embedded: whether its numbers are from the embedded simulator.
        points: share of successes by radius in metres, ascending.
    """

    label: str
    kind: ManipulationKind
    is_bound: bool
    is_embedded: bool
    points: Points


@dataclass(frozen=True)
class SuccessByRadius:
    """Success of several models.

    Attributes:
        lines: lines by kind, then in the order of the runs, the planner's last.
        floor: share of pick-ups whose object is in the sphere at the start, by radius: successes
            without a movement. Empty if there are no pick-ups.
    """

    task: str
    lines: tuple[RadiusLine, ...]
    floor: Points
    n_trajectories: int
    notes: tuple[str, ...]


def success_by_radius(runs: Sequence[ArmRun], tasks: str | None = None) -> SuccessByRadius:
    """Compute the success of models by radius, on the episodes that all runs have.

    Runs of one label are one model with several radii. Episodes that a run excludes are left out of
    all of them.

    Args:
        runs: at least one run.
        tasks: names of the tasks, separated by commas; None for all that the runs share.
    """
    shared = shared_episodes(runs, tasks, one_radius=False)
    kinds = task_kinds(runs, shared.tasks)
    lines = [line for kind, task in kinds.items() for line in _lines(kind, task, runs, shared)]
    return SuccessByRadius(
        task=" and ".join(shared.tasks),
        lines=tuple(lines),
        floor=_floor(kinds.get(ManipulationKind.PICKUP), runs, shared),
        n_trajectories=len(shared.trajectories),
        notes=shared.notes,
    )


def _lines(
    kind: ManipulationKind, task: str, runs: Sequence[ArmRun], shared: SharedUnits[ArmRecord]
) -> list[RadiusLine]:
    models: dict[str, dict[float, tuple[ArmRun, list[Record]]]] = {}
    for number, run in enumerate(runs):
        radius = run.config.tasks[task].radius
        radii = models.setdefault(run.label, {})
        if radius in radii:
            raise UsageError(
                f"two runs are called {run.label} and have a radius of {radius:g} m; leave one of "
                "them out"
            )
        radii[radius] = run, _records_of(task, shared, number)
    lines = [_line(label, kind, radii) for label, radii in models.items()]
    return sorted((line for line in lines if line.points), key=lambda line: line.is_bound)


def _line(
    label: str, kind: ManipulationKind, radii: Mapping[float, tuple[ArmRun, list[Record]]]
) -> RadiusLine:
    runs = [run for run, _ in radii.values()]
    by_radius = {radius: records for radius, (_, records) in radii.items()}
    return RadiusLine(
        label=label,
        kind=kind,
        is_bound=all(run.is_planner for run in runs),
        is_embedded=any(run.is_embedded for run in runs),
        points=_points(by_radius, lambda record: record.payload.done),
    )


def _floor(task: str | None, runs: Sequence[ArmRun], shared: SharedUnits[ArmRecord]) -> Points:
    """Return the share of pick-ups that begin in the sphere, by radius.

    The first run that acted in an episode says whether it does.
    """
    if task is None:
        return ()
    radii: dict[float, dict[str, Record]] = {}
    for number, run in enumerate(runs):
        episodes = radii.setdefault(run.config.tasks[task].radius, {})
        for record in _records_of(task, shared, number):
            episodes.setdefault(record.id, record)
    by_radius = {radius: list(episodes.values()) for radius, episodes in radii.items()}
    return _points(by_radius, lambda record: record.payload.starts_inside)


def _records_of(task: str, shared: SharedUnits[ArmRecord], run: int) -> list[Record]:
    return [record for records in shared.records[run] for record in records if record.task == task]


def _points(radii: Mapping[float, Sequence[Record]], holds: Callable[[Record], bool]) -> Points:
    """Return by radius the share of records for which something holds."""
    points = []
    for radius, records in sorted(radii.items()):
        outcomes = [float(holds(record)) for record in records]
        rate = clustered_rate(outcomes, [record.cluster for record in records])
        if rate is not None:
            points.append((radius, rate))
    return tuple(points)
