"""A task of plans: the settings of its file, and its trajectories."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

from infthor_eval.episodes.task_settings import task_settings, with_options
from infthor_eval.episodes.tasks import EpisodeTask
from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import Words
from infthor_eval.plans.actors.model import AgentConfig
from infthor_eval.plans.config import PlansTaskConfig
from infthor_eval.plans.environment import MAX_STEPS
from infthor_eval.plans.history.forms import LastTokens, history_named
from infthor_eval.plans.history.recalled import MemoryChoice, RecalledHistory
from infthor_eval.plans.history.retrieved import require_retrieved
from infthor_eval.plans.options import (
    AfterFailure,
    History,
    PlansOptions,
    Protocol,
    Rewards,
    WordsName,
)
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.published.final_protocol import MAX_STEPS as MAX_FINAL_STEPS
from infthor_eval.plans.published.final_protocol import FinalForm, chat_form, final_form
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.trajectories import PlanTrajectory, read_plan_trajectory
from infthor_eval.plans.twins.looking import worlds_together
from infthor_eval.quantities import Total
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.limiting import limit_items
from infthor_eval.settings import Setting


@dataclass(frozen=True, kw_only=True)
class PlanTaskSettings:
    """`dataset_kwargs` of a task file."""

    plans: Annotated[
        str,
        Setting(
            help='"all" plans, or those of the "final" long-horizon task.',
            choices=("all", "final"),
        ),
    ] = "all"
    bundled: Annotated[
        str | None, Setting(help="Name of a set of trajectories in the package.")
    ] = None
    rewards: Rewards = "default"
    words: WordsName = Words.PUBLISHED
    history: History = "full"
    protocol: Protocol = "default"
    after_failure: AfterFailure = "continue"
    max_steps: Annotated[Total, Setting(help="Maximum number of steps of one plan.")] = MAX_STEPS
    preamble: Annotated[str, Setting(help="Text before everything else that a model is given.")] = (
        ""
    )


def check_task_file(file: TaskFile) -> None:
    """Check a task file's settings; raises DataError if one is unknown or its value not allowed."""
    file.require("dataset_kwargs")
    task_settings(file, PlanTaskSettings)


class PlansTask(EpisodeTask[PlanTaskSettings, PlanTrajectory]):
    """A task file that was read, with its trajectories.

    Attributes:
        rules: the rules of rewards.
        words: the words of plans and actions.
        history: the part of the history that a model is given.
        counting: the option that needs a model that counts tokens; None without one.
        final_form: the published form of final tasks; None for the default protocol.
        evaluated_trajectories: trajectories that are evaluated.
    """

    def __init__(self, file: TaskFile, request: TaskRequest[PlansOptions]) -> None:
        """Check the file and find its trajectories."""
        file.require("dataset_kwargs", "generation_kwargs")
        self._options = request.options
        settings = with_options(task_settings(file, PlanTaskSettings), self._options)
        rules = reward_rules(settings.rewards)
        self.rules = rules.forcing() if self._options.force_action else rules
        self.words = Words(settings.words)
        kwargs = file.settings["generation_kwargs"]
        if self._options.greedy and isinstance(kwargs, Mapping):
            kwargs = {**kwargs, "do_sample": False, "temperature": 0.0}
        self.decoding = decoding_of(kwargs, request.seed, file.name)
        self.history = history_named(settings.history, self._memory_choice())
        windowed = isinstance(self.history, LastTokens)
        self.counting = "--history last:N" if windowed else self._options.budget and "--budget"
        self.final_form = self._final_form(settings)
        self._form = self.final_form or chat_form(self.history)
        if self._form is not None:
            self.history = self._form.history
            self.decoding = self._form.decoding(request.seed)
        super().__init__(file, request, settings, partial(read_plan_trajectory, words=self.words))
        having_plans = [one for one in self.trajectories.trajectories if self.plans(one)]
        worlds = worlds_together(having_plans)
        chosen = limit_items(worlds, lambda pair: pair[0].traj_id, request.seed, request.limit)
        self.evaluated_trajectories = [world for pair in chosen for world in pair]
        if not self.evaluated_trajectories:
            raise UsageError(
                f"{self.name}: no trajectory there has a final task; make some with --test-set"
            )
        if settings.history.startswith("retrieved:"):
            require_retrieved((one.data for one in self.evaluated_trajectories), self.name)

    def _memory_choice(self) -> MemoryChoice:
        options = self._options
        blank = options.frames == "blank"
        return MemoryChoice(
            options.memory, options.memory_args, options.budget, options.retriever, blank
        )

    def _final_form(self, settings: PlanTaskSettings) -> FinalForm | None:
        """Return the published form of final tasks; None without it."""
        if settings.protocol == "default":
            return None
        if settings.plans != "final":
            raise UsageError("--protocol published is for final tasks; take --tasks infthor_final")
        return final_form(self.history, settings.history)

    def plans(self, trajectory: PlanTrajectory) -> list[Plan]:
        """Return the plans of a trajectory that are evaluated."""
        wanted = [
            plan for plan in trajectory.plans if plan.is_final or self.settings.plans == "all"
        ]
        return [plan for plan in wanted if plan.in_task]

    @property
    def max_steps(self) -> int:
        """Number of actions after which a plan is over."""
        own = self.settings.max_steps
        return own if self.final_form is None else max(own, MAX_FINAL_STEPS)

    def agent_config(self) -> AgentConfig:
        """Return how a model is prompted."""
        return AgentConfig(
            decoding=self.decoding,
            history=self.history,
            words=self.words,
            form=self._form,
            preamble=self.settings.preamble,
            constrained=self._options.constrained,
            blank=self._options.frames == "blank",
        )

    def config(self) -> PlansTaskConfig:
        """See `EpisodeTask`."""
        return PlansTaskConfig(
            **self._shared_config(self.evaluated_trajectories),
            words=self.words,
            history=self.settings.history,
            recall=self.history.identity() if isinstance(self.history, RecalledHistory) else None,
            protocol=self.settings.protocol,
            after_failure=self.settings.after_failure,
            rewards=self.rules.document(),
            decoding=self.decoding.document(),
        )
