"""What the journals of runs say of themselves, for what draws several runs together or shows one again."""

from collections.abc import Sequence
from typing import Any, Generic, Protocol, TypeVar

import msgspec

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.runs.records import RunHeader

__all__ = ["About", "about", "shared_tasks"]

T = TypeVar("T")

_EMBEDDED = "embedded"  # as the option --simulator names it


class About(msgspec.Struct, Generic[T], frozen=True):
    """What the identity of a run in a simulator says.

    Attributes:
        model: the subject.
        simulator: what it acted in.
        tasks: by name, as the suite has them.
    """

    model: dict[str, Any]
    simulator: str
    tasks: dict[str, T]

    def is_baseline(self, name: str) -> bool:
        """Whether the subject is that baseline."""
        return bool(self.model.get("baseline") == name)

    @property
    def is_embedded(self) -> bool:
        """Whether its numbers are of the embedded simulator."""
        return self.simulator == _EMBEDDED


def about(label: str, header: RunHeader, kind: Any, suite: str) -> Any:
    """What a run's identity says.

    Args:
        label: what the run is called.
        header: who it is.
        kind: `About` of the suite's tasks.
        suite: in words.

    Raises:
        DataError: it is not that of a run of the suite.
    """
    with wrap_errors(f"{label}: not the identity of a run of {suite}", "start it anew", catch=msgspec.ValidationError):
        return msgspec.convert(header.identity, kind)


class _Told(Protocol):
    @property
    def label(self) -> str: ...

    @property
    def about(self) -> About[Any]: ...


def shared_tasks(runs: Sequence[_Told]) -> list[str]:
    """Names of the tasks that all runs have, in the order of the first.

    Raises:
        UsageError: there is none.
    """
    first = runs[0]
    shared = [name for name in first.about.tasks if all(name in run.about.tasks for run in runs)]
    if not shared:
        other = next((run for run in runs if not run.about.tasks.keys() & first.about.tasks.keys()), runs[-1])
        raise UsageError(f"{first.label} and {other.label} share no task; draw runs of the same task")
    return shared
