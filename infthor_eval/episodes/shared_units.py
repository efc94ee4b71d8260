"""Which units several runs have in common, so that their rewards can be held against each other."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from infthor_eval.errors import UsageError, unknown_name
from infthor_eval.runs.records import UnitRecord

__all__ = ["SharedUnits", "differing", "one_of", "shared_units", "sharing_notes"]

P = TypeVar("P")
Units = Mapping[str, Mapping[Any, UnitRecord[P]]]  # by trajectory, then by what orders them in time


@dataclass(frozen=True)
class SharedUnits(Generic[P]):
    """What runs have in common.

    Attributes:
        trajectories: names of those that all runs have in full.
        records: by run, then by trajectory: those of the units that count in every run, in time order.
        n_every: how many trajectories some run has.
        n_excluded: units of shared trajectories that are left out, as some run excludes them.
    """

    trajectories: tuple[str, ...]
    records: tuple[tuple[tuple[UnitRecord[P], ...], ...], ...]
    n_every: int
    n_excluded: int


def shared_units(units: Sequence[Units[P]], digests: Sequence[Mapping[str, str]]) -> SharedUnits[P]:
    """Find the units of trajectories that all runs have in full.

    Args:
        units: of each run.
        digests: of each run: those of its trajectories, by name.
    """
    every = sorted({*(key for known in digests for key in known), *(key for item in units for key in item)})
    excluded = {key: _excluded(item[key] for item in units if key in item) for key in every}
    shared = [key for key in every if _is_shared(key, digests, units) and units[0][key].keys() - excluded[key]]
    records = tuple(
        tuple(tuple(item[key][place] for place in sorted(item[key].keys() - excluded[key])) for key in shared)
        for item in units
    )
    return SharedUnits(tuple(shared), records, len(every), sum(len(excluded[key]) for key in shared))


def sharing_notes(found: SharedUnits[P], excluded: str) -> list[str]:
    """What must be said of the choice, a line each.

    Args:
        found: what the runs share.
        excluded: what is left out where some run excludes it, in words.
    """
    notes = []
    n_shared = len(found.trajectories)
    if n_shared < found.n_every:
        notes.append(f"{n_shared} of {found.n_every} trajectories are drawn: those that all of these runs have in full")
    if n_shared == 1:
        notes.append("of one trajectory there is no interval")
    if found.n_excluded:
        notes.append(f"{excluded}: {found.n_excluded}")
    return notes


def differing(what: str, labels: Sequence[str], values: Sequence[object]) -> list[str]:
    """A line where runs differ in something, each with its own; nothing where they do not."""
    if len({str(value) for value in values}) < 2:
        return []
    told = ", ".join(f"{value} ({label})" for value, label in zip(values, labels, strict=True))
    return [f"the runs differ in the {what}: {told}"]


def one_of(what: str, option: str, name: str | None, known: Sequence[str]) -> str:
    """The one that is named, or the only one that a run has.

    Args:
        what: what it is ("trajectory").
        option: that names it.
        name: as typed; None where it was not.
        known: what the run has.

    Raises:
        UsageError: the run has none of that name, or none is given and there are several.
    """
    if name is None and len(known) > 1:
        raise UsageError(f"the run has more than one {what}; give one of them with {option}: {', '.join(known)}")
    if name is not None and name not in known:
        raise unknown_name(f"{what} of this run", name, known)
    return name or known[0]


def _excluded(trajectory: Iterable[Mapping[Any, UnitRecord[P]]]) -> set[Any]:
    """Units of a trajectory that some run excludes."""
    return {place for units in trajectory for place, record in units.items() if record.excluded is not None}


def _is_shared(key: str, digests: Sequence[Mapping[str, str]], units: Sequence[Units[P]]) -> bool:
    """Whether all runs have the same trajectory of that name, with the same units: none stopped amid it."""
    if any(key not in item for item in units) or len({known.get(key) for known in digests}) > 1:
        return False
    return all(item[key].keys() == units[0][key].keys() for item in units)
