"""The expert's actions of one trajectory, replayed as far as they are needed: the true history."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.sequence_text import action_text
from infthor_eval.household.state_summary import state_summaries
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.history.clue_steps import clue_step, object_logs
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.plans.plan import Plan, TrajectoryTask
from infthor_eval.thor.frames import FrameKeeper
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.recorder import Recorder
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator, SimulatorMark
from infthor_eval.thor.view import AgentPose, SimulatorView


class ExpertRefusedError(InfeasibleError):
    """This simulator refuses an action of the expert: there is no true history from its plan on."""


@dataclass(frozen=True)
class ExpertAction:
    """An action of the expert.

    Attributes:
        pose: pose of the agent after it.
        completes: whether the goal of the plan's task holds after it, and did not at the plan's
            start.
    """

    call: Mapping[str, Any]
    text: str
    pose: AgentPose
    completes: bool


@dataclass(frozen=True)
class PlanStart:
    """The true state before a plan.

    Attributes:
        frame: frame that the agent sees; None if frames are not kept.
        treatments: what was done to objects so far in the plan's task.
    """

    mark: SimulatorMark
    frame: FrameRef | None
    treatments: Treatments


class Replayed(NamedTuple):
    """An action of the expert that was replayed, and the world after it."""

    action: ExpertAction
    view: SimulatorView
    frame: FrameRef | None
    treatments: Treatments


class Expert:
    """Replays a trajectory's expert plan by plan; `grounding` has its objects' ids here."""

    def __init__(
        self,
        trajectory: Trajectory,
        plans: Sequence[Plan],
        tasks: Sequence[TrajectoryTask],
        simulator: Simulator,
        frames: FrameKeeper,
        words: Words,
        in_words: bool = False,
    ) -> None:
        """Restore the scene; raises SimulatorError if the simulator has no such scene or fails.

        `words` are those of actions; with `in_words` the past is also described in words.
        """
        self._trajectory = trajectory
        self._plans = plans
        self._tasks = tasks
        self._words = words
        self._watch: Callable[[Plan, Sequence[Replayed]], None] = lambda _, __: None
        self._simulator = simulator
        self._frames = frames
        restore(simulator, trajectory.scene)
        self.grounding = Grounding(simulator.view)
        self._starts = [PlanStart(simulator.mark(), frames.keep(simulator.view), Treatments())]
        self._actions: list[list[ExpertAction]] = []
        self._segments: list[PlanSegment] = []
        self._object_logs = object_logs(trajectory)
        self._refused: ExpertRefusedError | None = None
        self._log = Recorder() if in_words else None
        if self._log is not None:
            self._log.record(simulator.view)

    def watched_by(self, watch: "Callable[[Plan, Sequence[Replayed]], None]") -> None:
        """Have a function called with each plan when it has been replayed, and with its actions."""
        self._watch = watch

    def start(self, plan: int) -> PlanStart:
        """Return the true state before a plan; the plans before it are replayed the first time.

        The number of plans is the end of the trajectory. The simulator is in any state afterwards.

        Raises:
            ExpertRefusedError: an action before it is refused here.
            SimulatorError: the simulator fails.
        """
        while len(self._starts) <= plan:
            if self._refused is not None:
                raise self._refused
            self._replay(self._plans[len(self._starts) - 1])
        return self._starts[plan]

    def actions(self, plan: int) -> Sequence[ExpertAction]:
        """Return the expert's actions of a plan; raises as `start` of the next plan does."""
        self.start(plan + 1)
        return self._actions[plan]

    def past(self, plan: int) -> Past:
        """Return the history before a plan, if frames are kept; raises as `start` does."""
        segment = self._open_segment(plan)
        present = self._plans[plan]
        first = present.low[0]
        return Past(
            self._segments[:plan],
            segment,
            self._state(first) if self._log else "",
            self._object_logs[: first + 1],
            clue_step(self._object_logs, self._trajectory, present, first - 1),
            self._trajectory,
        )

    def _open_segment(self, plan: int) -> PlanSegment:
        """Return the segment of a plan, without a step."""
        present = self._plans[plan]
        begins_task = plan == 0 or self._plans[plan - 1].task != present.task
        frame = self.start(plan).frame
        assert frame is not None
        goal = self._tasks[present.task].text if begins_task else None
        return PlanSegment(present.text, goal, frame, in_task=present.in_task)

    def _state(self, n_actions: int) -> str:
        """Return the state after a number of actions, in words."""
        assert self._log is not None
        summaries = state_summaries(self._log.steps[: n_actions + 1], {n_actions - 1})
        return summaries.get(n_actions - 1, "")

    def _replay(self, plan: Plan) -> None:
        """Replay the next plan; nothing of it is kept unless all its actions succeed."""
        start = self._starts[-1]
        steps = list(self._steps(plan, start))
        mark = self._simulator.mark()
        last = steps[-1]
        if self._log is not None:
            for number, step in zip(range(*plan.low), steps, strict=True):
                self._log.record(step.view, step=number, action=step.action.text)
        if start.frame is not None:
            segment = self._open_segment(plan.index)
            after = [(step.action.text, step.frame) for step in steps if step.frame is not None]
            self._segments.append(replace(segment, steps=tuple(after)))
        self._actions.append([step.action for step in steps])
        self._watch(plan, steps)
        following = self._plans[plan.index + 1 : plan.index + 2]
        task_goes_on = [after.task for after in following] == [plan.task]
        treatments = last.treatments if task_goes_on else Treatments()
        self._starts.append(PlanStart(mark, last.frame, treatments))

    def _steps(self, plan: Plan, start: PlanStart) -> Iterator[Replayed]:
        view = self._simulator.rewind(start.mark, exactly=True)
        treatments = start.treatments
        task = self._tasks[plan.task].task
        task_open = not goal_holds(task, view, treatments)
        for number in range(*plan.low):
            call = self._call(plan, number, view)
            view = self._simulator.step(**call)
            if not view.success:
                raise self._refusal(plan, number, view.error or "refused without a message")
            treatments = treatments.after(call["action"], call.get("objectId"), view)
            completes = task_open and goal_holds(task, view, treatments)
            action = ExpertAction(call, self._text(number), view.agent, completes)
            yield Replayed(action, view, self._frames.keep(view), treatments)

    def _call(self, plan: Plan, number: int, view: SimulatorView) -> dict[str, Any]:
        try:
            return translate(self._trajectory.plan.low_actions[number], self.grounding, view)
        except MissingObjectError as error:
            raise self._refusal(plan, number, str(error)) from error

    def _text(self, number: int) -> str:
        api = self._trajectory.plan.low_actions[number].api_action
        return action_text(api, self._words)

    def _refusal(self, plan: Plan, number: int, why: str) -> ExpertRefusedError:
        self._refused = ExpertRefusedError(
            f"the expert's action {number} ({self._text(number)}, in plan {plan.index}) is refused "
            f"here: {why}"
        )
        return self._refused
