"""Leading an actor through a trajectory, plan by plan (Algorithm 2)."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from infthor_eval.episodes.retries import with_retries
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.plans.actors import Act, Situation
from infthor_eval.plans.cast import Cast
from infthor_eval.plans.environment import PlanEnvironment, StepOutcome
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.plans.task import PlansTask
from infthor_eval.plans.trajectories import Course
from infthor_eval.runs import NOTHING, Tokens, Usage
from infthor_eval.thor.frames import FrameFolder, NoFrames
from infthor_eval.thor.simulator import Simulator
from model_adapters import Reply

__all__ = ["Episode", "Played", "described", "episode"]

_DIGITS = 6  # of rewards: what is beyond is rounding


@dataclass(frozen=True)
class Played:
    """What came of one plan.

    Attributes:
        record: for the journal.
        tokens: that its requests took: the length of the last one, of which so many were cached, and all replies.
        seconds: time that it took.
        faults: of the simulator and of the model, survived on the way.
        usage: what all its requests took, with those of tries that the simulator did not survive.
    """

    record: PlanRecord
    tokens: Tokens
    seconds: float
    faults: tuple[str, ...] = ()
    usage: Usage = NOTHING


def described(course: Course, plan: Plan) -> PlanRecord:
    """What is known of a plan before anybody acts."""
    first, end = plan.low
    return PlanRecord(
        index=plan.index,
        kind=str(plan.kind),
        plan=plan.text,
        goal=course.tasks[plan.task].text,
        task=plan.task,
        first_step=first,
        n_expert_steps=end - first,
        is_final=plan.is_final,
    )


@contextmanager
def episode(task: PlansTask, course: Course, cast: Cast, simulators: Simulators, seed: int) -> Iterator["Episode"]:
    """A trajectory with an actor in it, in a simulator that is there for as long as the context lasts."""
    with simulators.one() as simulator, ScratchFolder() as folder:
        yield Episode(task, course, cast, simulator, folder, seed)


class Episode:
    """See `episode`. The scene is restored when the first plan is played.

    Attributes:
        begun: what is known of the plan last begun, with the most that it can earn.
        usage: what all requests for the plan that is played took so far.
    """

    begun: PlanRecord | None = None
    usage: Usage = NOTHING

    def __init__(
        self, task: PlansTask, course: Course, cast: Cast, simulator: Simulator, folder: Path, seed: int
    ) -> None:
        self._task, self._course, self._simulator = task, course, simulator
        self._actor = cast.actor(task, course.trajectory)
        self._frames = FrameFolder(folder) if cast.sees else NoFrames()
        self._in_words = cast.sees and task.memory.needs_state
        self._seed = f"{seed}/{task.name}/{course.traj_id}"
        self._environment: PlanEnvironment | None = None

    def play(self, plan: Plan) -> Played:
        """One plan. Where the simulator fails for good it is begun anew, in a fresh one.

        Raises:
            UnfitPlanError: this simulator refuses an action of the expert before the plan's end, or has not what the
                plan is about.
            DataError: a frame cannot be written or read.
            ModelError: the model fails.
            SceneError: the simulator has no such scene.
            SimulatorError: the simulator failed every time.
        """
        self.usage = NOTHING
        played, faults = with_retries(self._simulator, lambda: self._played(plan), self._begin_anew)
        return replace(played, faults=(*faults, *played.faults), usage=self.usage)

    def pass_over(self, plan: Plan) -> None:
        """See whether a plan could have been come to at all: what nobody can do counts for nobody.

        Raises:
            ExpertRefusedError: as `play`.
            SimulatorError: as `play`.
        """
        self.usage = NOTHING
        with_retries(self._simulator, lambda: self._entered().expert_actions(plan.index), self._begin_anew)

    def _begin_anew(self) -> None:
        self._environment = None

    def _played(self, plan: Plan) -> Played:
        began = time.perf_counter()
        environment = self._entered()
        observation, info = environment.reset(plan.index)
        known = described(self._course, plan)
        self.begun = msgspec.structs.replace(known, max_reward=round(info["max_reward"], _DIGITS))
        self._actor.begin(Situation(environment, plan, f"{self._seed}/{plan.index}", observation))
        acts: list[tuple[Act, StepOutcome]] = []
        while not acts or not (acts[-1][1].terminated or acts[-1][1].truncated):
            if acts:
                self._actor.saw(acts[-1][1])
            act = self._actor.act()
            if act.reply is not None:
                self.usage = Usage.total([self.usage, Usage.of([act.reply])])
            acts.append((act, environment.step(act.action)))
        replies = [act.reply for act, _ in acts if act.reply is not None]
        faults = tuple(fault for reply in replies for fault in reply.faults)
        return Played(_record(self.begun, acts), _tokens(replies), time.perf_counter() - began, faults)

    def _entered(self) -> PlanEnvironment:
        if self._environment is None:
            self._environment = PlanEnvironment(
                self._course.trajectory,
                self._simulator,
                rules=self._task.rules,
                max_steps=self._task.settings.max_steps,
                frames=self._frames,
                in_words=self._in_words,
            )
        return self._environment


def _record(begun: PlanRecord, acts: Sequence[tuple[Act, StepOutcome]]) -> PlanRecord:
    _, last = acts[-1]
    return msgspec.structs.replace(
        begun,
        steps=tuple(_step(act, outcome) for act, outcome in acts),
        reward=round(sum(outcome.reward for _, outcome in acts), _DIGITS),
        ended=str(last.info.ended),
        goal_reached=any(outcome.info.goal_reached for _, outcome in acts),
    )


def _step(act: Act, outcome: StepOutcome) -> StepRecord:
    info, reply = outcome.info, act.reply
    return StepRecord(
        reply=None if reply is None else reply.text,
        action=info.action,
        call=None if info.call is None else dict(info.call),
        message=info.message,
        reward=round(outcome.reward, _DIGITS),
        n_context_tokens=None if reply is None else reply.n_context_tokens,
    )


def _tokens(replies: Sequence[Reply]) -> Tokens:
    if not replies:
        return Tokens()
    written = [reply.n_reply_tokens for reply in replies]
    return Tokens(
        context=replies[-1].n_context_tokens,
        cached=replies[-1].n_cached_tokens,
        reply=None if None in written else sum(count for count in written if count is not None),
    )
