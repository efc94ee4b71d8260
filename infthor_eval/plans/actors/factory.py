"""The actors of a subject: a model that is prompted as the task says, a person, or a baseline."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.actors.model import AgentConfig, ModelActor
from infthor_eval.plans.actors.protocols import Act, PlanActor, PlanBaseline, PlanSituation
from infthor_eval.plans.environment import StepOutcome
from infthor_eval.plans.task import PlansTask
from infthor_eval.thor.actions import applicable_actions
from model_adapters import Model, Notice, PersonModel, Subject, identity_of


class _PersonActor(ModelActor):
    """Asks a person for actions, with what a model is not told: goal, rewards, possible actions."""

    def __init__(self, person: PersonModel, config: AgentConfig) -> None:
        super().__init__(person, config)
        self._person = person
        self._of_trajectory = self._of_plan = 0.0
        self._news = ""

    def begin(self, situation: PlanSituation) -> None:
        """See `PlanActor`."""
        super().begin(situation)
        environment = situation.environment
        plan = situation.plan
        self._title = f"Plan {plan.index + 1} of {len(environment.plans)}: {plan.text}"
        self._goal = environment.tasks[plan.task].text
        self._of_plan = 0.0

    def act(self) -> Act:
        """See `PlanActor`."""
        possible = applicable_actions(self._observation.view, self._config.words)
        facts = {
            "goal": self._goal,
            "reward in this plan": f"{self._of_plan:g}",
            "reward so far": f"{self._of_trajectory:g}",
        }
        replies = tuple(map(str, possible))
        self._person.show_notice(
            Notice(
                title=self._title,
                unit="plan",
                facts=tuple(facts.items()),
                news=self._news,
                replies=replies,
            )
        )
        return super().act()

    def observe(self, outcome: StepOutcome) -> None:
        """See `PlanActor`."""
        super().observe(outcome)
        self._add(outcome)
        self._news = ""

    def end(self, outcome: StepOutcome) -> None:
        """See `EndedActor`."""
        self._add(outcome)
        ended = f"{self._title}. {outcome.info.ended}".rstrip()
        self._news = f"{ended}, reward {self._of_plan:g}. {outcome.info.message}".rstrip()

    def _add(self, outcome: StepOutcome) -> None:
        self._of_plan = round(self._of_plan + outcome.reward, 6)
        self._of_trajectory = round(self._of_trajectory + outcome.reward, 6)


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
        return ActorFactory(True, lambda task, _: _PersonActor(subject, task.agent_config()))
    if isinstance(subject, Model):
        trained = identity_of(subject).get("trained_words")
        return ActorFactory(True, lambda task, _: ModelActor(subject, task.agent_config()), trained)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of plans")
