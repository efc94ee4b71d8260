"""Runs of episodes that are disturbed, and what is to be equal in them all the same."""

from collections.abc import Iterable
from typing import Any, Protocol

import msgspec
import pytest

from infthor_eval.runs import UnitRecord
from infthor_eval.thor.controller import SafeController

__all__ = ["CallCounter", "drop_times", "watch_calls"]


class CallCounter(Protocol):
    """What is told of every call of a simulator in this process."""

    def come(self, controller: SafeController) -> None:
        """A call is about to be made."""


def drop_times(records: Iterable[UnitRecord[Any]]) -> list[UnitRecord[Any]]:
    """What is to be equal in two runs: all but times, attempts and faults."""
    return [
        msgspec.structs.replace(record, seconds=0.0, attempt=1, faults=()) for record in records
    ]


def watch_calls(monkeypatch: pytest.MonkeyPatch, calls: CallCounter) -> None:
    """Tell a counter of every call of a simulator in this process."""
    step = SafeController.step

    def counted(controller: SafeController, action: Any = None, **arguments: Any) -> Any:
        calls.come(controller)
        return step(controller, action, **arguments)

    monkeypatch.setattr(SafeController, "step", counted)
