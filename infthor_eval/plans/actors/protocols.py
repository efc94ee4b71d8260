"""The protocols of actors and baselines: an actor begins a plan, and acts until it is over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.environment import Observation, PlanEnvironment, StepOutcome
from infthor_eval.plans.plan import Plan
from infthor_eval.runs import StoredRequest
from model_adapters import Reply, Subject


@dataclass(frozen=True)
class Act:
    """A chosen action, a text or a call of AI2-THOR's, and a model's reply (None: a baseline)."""

    action: str | Mapping[str, Any]
    reply: Reply | None = None


@dataclass(frozen=True)
class PlanSituation:
    """A plan that begins.

    Attributes:
        environment: the environment, reset to it.
        seed: seed of everything random.
        observation: first observation.
        goes_on: whether it follows the agent's own last plan, without a reset.
    """

    environment: PlanEnvironment
    plan: Plan
    seed: str
    observation: Observation
    goes_on: bool = False


class PlanActor(Protocol):
    """Acts in the plans of one trajectory."""

    def begin(self, situation: PlanSituation) -> None:
        """Begin a plan.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot take the history.
        """

    def act(self) -> Act:
        """Choose the next action.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the model cannot reply.
        """

    def observe(self, outcome: StepOutcome) -> None:
        """Take the outcome of the last action, if the plan goes on."""


@runtime_checkable
class AskingActor(PlanActor, Protocol):
    """An actor that asks a model, which may count tokens."""

    @property
    def request(self) -> StoredRequest | None:
        """What the model was given before the first action of the plan that has begun; each further
        request has the actions and frames since then."""

    def tokens_between(self, first: int, last: int) -> int | None:
        """Return the tokens of the history from one frame to another; None if not counted.

        Frames are numbered from the trajectory's first; the history is that before the plan that
        has begun.
        """


@runtime_checkable
class EndedActor(PlanActor, Protocol):
    """An actor that learns how its plan ended."""

    def end(self, outcome: StepOutcome) -> None:
        """Take the outcome of the plan's last action."""


@runtime_checkable
class PlanBaseline(Subject, Protocol):
    """A subject that acts without frames."""

    def fit(self, trajectories: Sequence[Trajectory]) -> None:
        """Take all trajectories of the run; called once, before the first plan."""

    def actor(self, trajectory: Trajectory, words: Words) -> PlanActor:
        """Create the actor of a trajectory, whose plans are in these words."""
