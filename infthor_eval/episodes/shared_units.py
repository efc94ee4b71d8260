"""The episodes that several runs have in common, so that their rewards can be compared."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.errors import DataError, UsageError, unknown_name
from infthor_eval.runs.journals.records import State, UnitRecord

P = TypeVar("P", bound=EpisodeRecord)
Units = Mapping[str, Mapping[Any, UnitRecord[P]]]  # by trajectory, then by their order in time


@dataclass(frozen=True)
class SharedUnits(Generic[P]):
    """What runs have in common.

    Attributes:
        trajectories: names of the trajectories that all runs have in full.
        records: by run, then by trajectory: records of the episodes with a result in every run,
            in time order.
        notes: what was left out, and how the runs differ, a line each.
    """

    tasks: tuple[str, ...]
    trajectories: tuple[str, ...]
    records: tuple[tuple[tuple[UnitRecord[P], ...], ...], ...]
    notes: tuple[str, ...]


def shared_tasks(runs: Sequence[RecordedRun[Any, Any]], chosen: Sequence[str] | None) -> list[str]:
    """Return the names of the tasks that all runs (at least one) have, in the first run's order.

    If some are chosen, return these.
    """
    first = runs[0]
    tasks_of_runs = [run.config.tasks.keys() for run in runs]
    of_all = set.intersection(*map(set, tasks_of_runs))
    shared = [name for name in first.config.tasks if name in of_all]
    if not shared:
        disjoint = (run for run in runs if not run.config.tasks.keys() & first.config.tasks.keys())
        other = next(disjoint, runs[-1])
        has = ", ".join(
            f"{run.label} has {' and '.join(run.config.tasks)}" for run in (first, other)
        )
        raise UsageError(
            f"{first.label} and {other.label} share no task ({has}); draw runs of the same task"
        )
    for name in chosen or ():
        if name not in shared:
            raise unknown_name("task of all these runs", name, shared)
    return shared if chosen is None else list(chosen)


def shared_units(
    runs: Sequence[RecordedRun[P, Any]],
    tasks: Sequence[str],
    excluded: str,
    differences: Iterable[str] = (),
) -> SharedUnits[P]:
    """Find the episodes of trajectories that all runs (at least one) have in full, in shared tasks.

    Args:
        excluded: description of episodes that some run excludes, for a note.
        differences: notes on how the runs differ; whether the simulators do is added.
    """
    units = [run.by_trajectory(tasks) for run in runs]
    digests = [run.digests(tasks) for run in runs]
    names = sorted(set().union(*digests, *units))
    excluded_of = {name: _in_state(name, units, {"excluded"}) for name in names}
    lost = {name: _in_state(name, units, {"failed", "not asked"}) for name in names}
    left_out = {name: excluded_of[name] | lost[name] for name in names}
    shared = [
        name
        for name in names
        if _is_shared(name, digests, units) and units[0][name].keys() - left_out[name]
    ]
    if not shared:
        which = " and ".join(tasks)
        lacks = [_lack(names, of_run, units) for of_run in units]
        known = [f"{run.label} has {lack}" for run, lack in zip(runs, lacks, strict=True) if lack]
        raise DataError(
            f"the runs share no trajectory of {which} that all of them have in full ("
            f"{', '.join(known) or 'they have other data, or each episode is left out in some'}); "
            "finish them, or draw runs on the same data"
        )
    records = []
    for of_run in units:
        counted = [_without(of_run[name], left_out[name]) for name in shared]
        records.append(tuple(counted))
    notes = []
    if len(shared) < len(names):
        notes.append(
            f"{len(shared)} of {len(names)} trajectories are drawn: those that all of these runs "
            "have in full"
        )
    if len(shared) == 1:
        notes.append("a mean over one trajectory has no interval")
    if n_excluded := sum(len(excluded_of[name]) for name in shared):
        notes.append(f"{excluded}: {n_excluded}")
    if n_lost := sum(len(lost[name] - excluded_of[name]) for name in shared):
        notes.append(f"left out, as they failed or were not asked in a run: {n_lost}")
    notes += difference_notes("simulator", runs, [run.config.simulator for run in runs])
    return SharedUnits(tuple(tasks), tuple(shared), tuple(records), (*notes, *differences))


def _lack(names: Sequence[str], of_run: Units[P], units: Sequence[Units[P]]) -> str:
    """Return how much a run has of the first trajectory that it has not in full; "" if none."""
    for name in names:
        n = len(of_run.get(name, {}))
        n_all = len({key for each in units for key in each.get(name, {})})
        if n < n_all:
            return f"{n} of {n_all} episodes of {name}"
    return ""


def _in_state(name: str, units: Sequence[Units[P]], states: Collection[State]) -> set[Any]:
    """Return which episodes of a trajectory some run has in a state, by their order in time."""
    of_runs = [of_run.get(name, {}) for of_run in units]
    return {
        order for of_run in of_runs for order, record in of_run.items() if record.state in states
    }


def _without(units: Mapping[Any, UnitRecord[P]], left_out: set[Any]) -> tuple[UnitRecord[P], ...]:
    return tuple(units[order] for order in sorted(units.keys() - left_out))


def difference_notes(
    setting: str, runs: Sequence[RecordedRun[Any, Any]], values: Sequence[object]
) -> list[str]:
    """Return a line with each run's value of a setting if they differ; else nothing."""
    if len({str(value) for value in values}) < 2:
        return []
    by_run = ", ".join(f"{value} ({run.label})" for run, value in zip(runs, values, strict=True))
    return [f"the runs differ in the {setting}: {by_run}"]


def only_name(what: str, option: str, name: str | None, known: Sequence[str]) -> str:
    """Return the name if it is given, or the only one that a run has.

    Args:
        what: kind of the name, for messages.
        option: option that gives it.
        name: the name, None if it is not given.
        known: names that the run has.
    """
    if name is None and len(known) > 1:
        raise UsageError(
            f"the run has more than one {what}; give one of them with {option}: {', '.join(known)}"
        )
    if name is not None and name not in known:
        raise unknown_name(f"{what} of this run", name, known)
    return name or known[0]


def _is_shared(name: str, digests: Sequence[Mapping[str, str]], units: Sequence[Units[P]]) -> bool:
    """Return whether all runs have the same trajectory of that name with the same episodes.

    A run that was stopped in the middle of a trajectory lacks episodes there.
    """
    if (
        any(name not in of_run for of_run in units)
        or len({known.get(name) for known in digests}) > 1
    ):
        return False
    return all(of_run[name].keys() == units[0][name].keys() for of_run in units)
