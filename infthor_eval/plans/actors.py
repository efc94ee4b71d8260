"""What acts in a trajectory: an agent enters it, begins a plan, and acts until the plan is over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.environment import Observation, PlanEnvironment, StepOutcome
from infthor_eval.plans.plan import Plan
from model_adapters import Reply, Subject

__all__ = ["Act", "Actor", "Baseline", "Situation"]


@dataclass(frozen=True)
class Act:
    """One action, as it is asked for.

    Attributes:
        action: its text, or a call of AI2-THOR's.
        reply: of the model that said it; None where none did.
    """

    action: str | Mapping[str, Any]
    reply: Reply | None = None


@dataclass(frozen=True)
class Situation:
    """A plan that is begun.

    Attributes:
        environment: brought to it.
        plan: which one.
        seed: for whatever is random in it.
        observation: what is seen.
    """

    environment: PlanEnvironment
    plan: Plan
    seed: str
    observation: Observation


class Actor(Protocol):
    """Carries out plans of one trajectory."""

    def begin(self, situation: Situation) -> None:
        """A plan begins.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take the history.
        """
        ...

    def act(self) -> Act:
        """The next action.

        Raises:
            DataError: as `begin`.
            ModelError: the model cannot reply.
        """
        ...

    def saw(self, outcome: StepOutcome) -> None:
        """What came of the last action, where the plan goes on."""
        ...


@runtime_checkable
class Baseline(Subject, Protocol):
    """What acts without looking at a frame."""

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """Read all the trajectories of the run, once, before the first plan."""
        ...

    def actor(self, trajectory: Trajectory) -> Actor:
        """What carries out the plans of a trajectory."""
        ...
