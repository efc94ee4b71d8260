"""The actors of a subject: a model that is prompted as the task says, a person, or a baseline."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.actors.model import ModelActor
from infthor_eval.plans.actors.person import PersonActor
from infthor_eval.plans.actors.protocols import PlanActor, PlanBaseline
from infthor_eval.plans.task import PlansTask
from model_adapters import Model, PersonModel, Subject, identity_of


@dataclass(frozen=True)
class ActorFactory:
    """Creates the actors of a subject.

    Attributes:
        sees: whether they look at frames.
        trained_words: words of plans and actions that the subject was trained on; None if it does
            not say.
    """

    sees: bool
    create: Callable[[PlansTask, Trajectory], PlanActor]
    trained_words: str | None = None


def actor_factory(subject: Subject, trajectories: Sequence[Trajectory]) -> ActorFactory:
    """Return the factory of a model, or of a baseline, which is fitted; TypeError for others."""
    if isinstance(subject, PlanBaseline):
        subject.fit(trajectories)
        return ActorFactory(False, lambda task, trajectory: subject.actor(trajectory, task.words))
    if isinstance(subject, PersonModel):
        return ActorFactory(True, lambda task, _: PersonActor(subject, task.agent_config()))
    if isinstance(subject, Model):
        trained = identity_of(subject).get("trained_words")
        return ActorFactory(True, lambda task, _: ModelActor(subject, task.agent_config()), trained)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of plans")
