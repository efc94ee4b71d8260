"""Leading an actor through a trajectory, plan by plan (Algorithm 2)."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import msgspec

from infthor_eval.agents.actors import Act, Situation
from infthor_eval.agents.cast import Cast
from infthor_eval.agents.environment import PlanEnvironment, StepOutcome
from infthor_eval.agents.frames import FrameFolder, NoFrames
from infthor_eval.agents.plans import Plan
from infthor_eval.agents.records import PlanRecord, StepRecord
from infthor_eval.agents.task import PlansTask
from infthor_eval.agents.trajectories import Course
from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.runs import Tokens
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.simulators import Simulators

__all__ = ["Episode", "Played", "described", "episode"]

_T = TypeVar("_T")
_TRIALS = 3  # of one plan, where the simulator fails
_DIGITS = 6  # of rewards: what is beyond is rounding


@dataclass(frozen=True)
class Played:
    """What came of one plan.

    Attributes:
        record: for the journal.
        tokens: that its requests took: the length of the last one, of which so many were cached, and all replies.
        faults: of the simulator, survived on the way.
        seconds: time that it took.
    """

    record: PlanRecord
    tokens: Tokens
    seconds: float
    faults: tuple[str, ...] = ()


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
    """

    begun: PlanRecord | None = None

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
        played, faults = self._survived(lambda: self._played(plan))
        return replace(played, faults=tuple(faults))

    def pass_over(self, plan: Plan) -> None:
        """See whether a plan could have been come to at all: what nobody can do counts for nobody.

        Raises:
            ExpertRefusedError: as `play`.
            SimulatorError: as `play`.
        """
        self._survived(lambda: self._entered().expert_actions(plan.index))

    def _survived(self, do: Callable[[], _T]) -> tuple[_T, list[str]]:
        """What comes of something, and the faults of the simulator on the way."""
        faults: list[str] = []
        while True:
            restarts = self._simulator.restarts
            try:
                made = do()
            except SceneError:
                raise
            except SimulatorError as error:
                self._environment = None
                faults.append(str(error))
                if len(faults) == _TRIALS:
                    raise
            else:
                if self._simulator.restarts > restarts:
                    faults.append(f"simulator started again: {self._simulator.restarts - restarts}")
                return made, faults

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
            acts.append((act, environment.step(act.action)))
        return Played(_record(self.begun, acts), _tokens([act for act, _ in acts]), time.perf_counter() - began)

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


def _tokens(acts: Sequence[Act]) -> Tokens:
    replies = [act.reply for act in acts if act.reply is not None]
    if not replies:
        return Tokens()
    written = [reply.n_reply_tokens for reply in replies]
    return Tokens(
        context=replies[-1].n_context_tokens,
        cached=replies[-1].n_cached_tokens,
        reply=None if None in written else sum(count for count in written if count is not None),
    )
