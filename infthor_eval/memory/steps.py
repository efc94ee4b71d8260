"""The base of memories that keep all steps of a trajectory."""

from collections.abc import Mapping
from typing import Any, ClassVar

from infthor_eval.memory.protocol import MemoryCapabilities, Observation, TrajectoryFacts


class StepMemory:
    """Keeps all steps; a class says what it recalls of them."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities()

    def __init__(self) -> None:
        self.facts = TrajectoryFacts(name="")
        self.past: list[Observation] = []

    def identity(self) -> Mapping[str, Any]:
        """See `Memory`."""
        return {}

    def begin(self, facts: TrajectoryFacts) -> None:
        """See `Memory`."""
        self.facts = facts
        self.past = []

    def observe(self, observation: Observation) -> None:
        """See `Memory`."""
        self.past.append(observation)
