"""Leading an actor through a trajectory, plan by plan (Algorithm 2)."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from infthor_eval.episodes.records import NOT_ATTEMPTED
from infthor_eval.episodes.running import EpisodeResult, EpisodeRunner
from infthor_eval.plans.actors.factory import ActorFactory
from infthor_eval.plans.actors.protocols import Act, AskingActor, EndedActor, PlanSituation
from infthor_eval.plans.environment import PlanEnvironment, StepOutcome
from infthor_eval.plans.expert import ExpertRefusedError
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.plans.task import PlansTask
from infthor_eval.plans.trajectories import PlanTrajectory
from infthor_eval.plans.twins.looking import completed_twin, twin_record
from infthor_eval.runs import Tokens, Usage
from infthor_eval.thor.frames import FrameFolder, NoFrames
from infthor_eval.thor.simulator import Simulator
from model_adapters import Reply

_DIGITS = 6  # of rewards; more would be rounding noise


def plan_record(trajectory: PlanTrajectory, plan: Plan) -> PlanRecord:
    """Return the record of a plan before anybody acts."""
    first, end = plan.low
    clue = trajectory.clue(plan) if plan.is_final else None
    return PlanRecord(
        index=plan.index,
        kind=str(plan.kind),
        plan=plan.text,
        goal=trajectory.tasks[plan.task].text,
        task=plan.task,
        first_step=first,
        n_expert_steps=end - first,
        is_final=plan.is_final,
        clue_distance=None if clue is None else trajectory.first_frame(plan) - clue,
        twin=twin_record(trajectory, plan),
    )


class PlanRunner(EpisodeRunner[PlanEnvironment, PlanRecord]):
    """A trajectory with an actor in it."""

    def __init__(
        self,
        task: PlansTask,
        trajectory: PlanTrajectory,
        factory: ActorFactory,
        simulator: Simulator,
        folder: Path,
        seed: int,
    ) -> None:
        """Take a trajectory, its simulator, the actor's factory, and an empty folder for frames."""
        frames = FrameFolder(folder) if factory.sees else NoFrames()
        super().__init__(
            simulator,
            lambda: PlanEnvironment(
                trajectory.data,
                simulator,
                rules=task.rules,
                words=task.words,
                max_steps=task.max_steps,
                frames=frames,
                in_words=factory.sees and task.history.needs_state,
                in_one_go=task.final_form is not None,
            ),
        )
        self._trajectory = trajectory
        self._actor = factory.create(task, trajectory.data)
        self._seed = f"{seed}/{task.name}/{trajectory.traj_id}"

    def prepare(self, plans: Sequence[Plan]) -> None:
        """Have the expert pass plans that follow each other without a reset, as far as it can."""
        with suppress(ExpertRefusedError):
            for plan in plans:
                self.environment.expert_actions(plan.index)

    def run(self, plan: Plan, *, goes_on: bool = False) -> EpisodeResult[PlanRecord]:
        """Run a plan from its true start, or from where the plan before has left the world."""
        environment = self.environment
        begin = environment.go_on if goes_on else environment.reset
        observation, info = begin(plan.index)
        of_expert = info["expert_reward"]
        self.begun = msgspec.structs.replace(
            plan_record(self._trajectory, plan),
            max_reward=round(info["max_reward"], _DIGITS),
            expert_reward=None if of_expert is None else round(of_expert, _DIGITS),
        )
        seed = f"{self._seed}/{plan.index}"
        self._actor.begin(PlanSituation(environment, plan, seed, observation, goes_on))
        self.request = self._actor.request if isinstance(self._actor, AskingActor) else None
        self.begun = self._with_clue_tokens(self.begun, plan)
        acts: list[tuple[Act, StepOutcome]] = []
        while not acts or not (acts[-1][1].terminated or acts[-1][1].truncated):
            if acts:
                self._actor.observe(acts[-1][1])
            act = self._actor.act()
            if act.reply is not None:
                self.usage = Usage.total([self.usage, Usage.of([act.reply])])
            acts.append((act, environment.step(act.action)))
        if isinstance(self._actor, EndedActor):
            self._actor.end(acts[-1][1])
        replies = [act.reply for act, _ in acts if act.reply is not None]
        faults = tuple(fault for reply in replies for fault in reply.faults)
        completed = _completed_record(self.begun, acts)
        if completed.twin is not None and completed.twin.finds:
            item = environment.named_objects(plan.index)[0]
            outcomes = [outcome for _, outcome in acts]
            twin = completed_twin(completed.twin, self._trajectory, item, observation, outcomes)
            completed = msgspec.structs.replace(completed, twin=twin)
        return EpisodeResult(completed, _tokens(replies), faults)

    def _with_clue_tokens(self, begun: PlanRecord, plan: Plan) -> PlanRecord:
        """Return the record with the distance of a final plan's clue, in tokens of the history."""
        clue = self._trajectory.clue(plan) if plan.is_final else None
        if clue is None or not isinstance(self._actor, AskingActor):
            return begun
        tokens = self._actor.tokens_between(clue, self._trajectory.first_frame(plan))
        return msgspec.structs.replace(begun, clue_tokens=tokens)

    def pass_over(self, plan: Plan) -> EpisodeResult[PlanRecord]:
        """Leave out a plan after an earlier one ended the trajectory.

        The expert's actions are replayed nevertheless: an infeasible plan is excluded for every
        subject, attempted or not, so that all have the same denominator.
        """
        self.environment.expert_actions(plan.index)
        record = plan_record(self._trajectory, plan)
        return EpisodeResult(msgspec.structs.replace(record, ended=NOT_ATTEMPTED))


def _completed_record(begun: PlanRecord, acts: Sequence[tuple[Act, StepOutcome]]) -> PlanRecord:
    _, last = acts[-1]
    return msgspec.structs.replace(
        begun,
        steps=tuple(_step_record(act, outcome) for act, outcome in acts),
        reward=round(sum(outcome.reward for _, outcome in acts), _DIGITS),
        ended=str(last.info.ended),
        goal_reached=any(outcome.info.goal_reached for _, outcome in acts),
        conditions=last.info.conditions,
    )


def _step_record(act: Act, outcome: StepOutcome) -> StepRecord:
    info = outcome.info
    reply = act.reply
    return StepRecord(
        reply=None if reply is None else reply.text,
        action=info.action,
        call=None if info.call is None else dict(info.call),
        message=info.message,
        reward=round(outcome.reward, _DIGITS),
        n_context_tokens=None if reply is None else reply.n_context_tokens,
    )


def _tokens(replies: Sequence[Reply]) -> Tokens:
    """Return the context of the last request, which holds earlier ones, and all reply tokens."""
    if not replies:
        return Tokens()
    counts = [reply.n_reply_tokens for reply in replies]
    return Tokens(
        context=replies[-1].n_context_tokens,
        cached=replies[-1].n_cached_tokens,
        reply=None if None in counts else sum(count for count in counts if count is not None),
    )
