"""A person as an actor: a model's prompts, and beside them what a model is not told."""

from infthor_eval.plans.actors.model import AgentConfig, ModelActor
from infthor_eval.plans.actors.protocols import Act, PlanSituation
from infthor_eval.plans.environment import StepOutcome
from infthor_eval.thor.actions import applicable_actions
from model_adapters import Notice, PersonModel


class PersonActor(ModelActor):
    """Asks a person for actions; tells goal, plan, rewards, and the actions that are possible."""

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
