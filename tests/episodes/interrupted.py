"""Runs of episodes whose simulators die, and what is to be equal in them all the same."""

import os
import signal
from collections import Counter
from collections.abc import Iterable
from typing import Any

import msgspec
import pytest

from infthor_eval.runs import UnitRecord
from infthor_eval.thor.controller import SafeController

__all__ = ["SimulatorCalls", "drop_times", "simulator_calls"]


def drop_times(records: Iterable[UnitRecord[Any]]) -> list[UnitRecord[Any]]:
    """What is to be equal in two runs: all but times, attempts and faults."""
    return [
        msgspec.structs.replace(record, seconds=0.0, attempt=1, faults=()) for record in records
    ]


class SimulatorCalls:
    """The calls of simulators in this process: counted by agent mode, and processes killed before
    some of them.

    Attributes:
        n: how many there were so far, by mode: "arm" or "default".
        deadly: modes and numbers of those that come, before which the process is killed.
        killed: how often it was.
    """

    def __init__(self) -> None:
        self.n: Counter[str] = Counter()
        self.deadly: set[tuple[str, int]] = set()
        self.killed = 0

    def come(self, controller: SafeController) -> None:
        """Count a call that is about to be made."""
        process = controller.server and controller.server.unity_proc
        if controller.last_event is None or process is None:
            return  # at starting
        mode = "arm" if controller.last_event.metadata.get("arm") else "default"
        self.n[mode] += 1
        if (mode, self.n[mode]) in self.deadly:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            self.killed += 1

    def deadly_from_now(self, numbers: Iterable[int], mode: str = "default") -> None:
        """Kill before calls of a mode, numbered from those that were so far."""
        self.deadly = {(mode, self.n[mode] + number) for number in numbers}


@pytest.fixture
def simulator_calls(monkeypatch: pytest.MonkeyPatch, shared_simulators: None) -> SimulatorCalls:
    """The calls of the simulators that tests share."""
    calls = SimulatorCalls()
    step = SafeController.step

    def counted(controller: SafeController, action: Any = None, **arguments: Any) -> Any:
        calls.come(controller)
        return step(controller, action, **arguments)

    monkeypatch.setattr(SafeController, "step", counted)
    return calls
