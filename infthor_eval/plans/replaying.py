"""Recorded plans carried out again, so that they can be looked at: a journal has every action, and no frame.

What is told (actions, rewards, endings) is what the run recorded. What is seen is made anew: the environment is reset
to each plan and the recorded calls are stepped, which leads where it led then if the simulator is deterministic.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

from infthor_eval.episodes.shared_units import only_name
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.episodes.trajectory_sets import find_again
from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.household.scout import reachable_grid
from infthor_eval.plans.environment import MAX_STEPS, PlanEnvironment, StepOutcome
from infthor_eval.plans.moments import Moment, PlanTitle, Point, Pose, Rewards, Room, Sight, Thing
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.recorded_runs import PlansRun
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.plans.rewards import RewardRules
from infthor_eval.plans.trajectories import Course, read_course
from infthor_eval.runs import UnitRecord
from infthor_eval.thor.actions import object_type_of, text_of
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, ThorObject

__all__ = ["Record", "Recorded", "Replay", "recorded_plans", "replay"]

Record = UnitRecord[PlanRecord]
_ALIKE = 1e-6  # rewards are recorded with six digits
_GROUND = "Floor"  # the room's own; it would cover the map


@dataclass(frozen=True)
class Recorded:
    """What a run has of one trajectory.

    Attributes:
        run: the run.
        task: the task.
        trajectory: its name.
        plans: records of its plans, in time order.
    """

    run: PlansRun
    task: str
    trajectory: str
    plans: tuple[Record, ...]

    def between(self, first: int, last: int) -> list[Record]:
        """Those of plans by their number, from 1 on, both ends included.

        Raises:
            UsageError: the run has not all of them.
        """
        lowest, highest = (self.plans[place].payload.index + 1 for place in (0, -1))
        if not lowest <= first <= last <= highest:
            asked = f"{first}" if first == last else f"{first}-{last}"
            raise UsageError(
                f"--plans {asked}: the run has plans {lowest} to {highest} of {self.trajectory}; give some of these"
            )
        return [record for record in self.plans if first <= record.payload.index + 1 <= last]

    def earned_before(self, plan: Record) -> float:
        """What the plans before one gave."""
        return sum(record.payload.reward for record in self._counted if record.payload.index < plan.payload.index)

    def most_up_to(self, plan: Record) -> float:
        """The most that the rules allow for all plans up to the end of one."""
        counted = (record.payload for record in self._counted if record.payload.index <= plan.payload.index)
        return sum(payload.max_reward or 0.0 for payload in counted)

    @property
    def _counted(self) -> Iterator[Record]:
        return (record for record in self.plans if record.excluded is None)


def recorded_plans(run: PlansRun, task: str | None, trajectory: str | None) -> Recorded:
    """What a run has of a trajectory.

    Args:
        run: the run.
        task: which task of it; None takes the only one.
        trajectory: its name; None takes the only one.

    Raises:
        UsageError: there is no such task or trajectory, or none is given and there are several.
        DataError: the identity is not that of a run of plans.
    """
    task = only_name("task", "--task", task, list(run.config.tasks))
    plans: dict[str, list[Record]] = {}
    for record in run.records:
        if record.task == task:
            plans.setdefault(record.cluster, []).append(record)
    if not plans:
        raise DataError(f"{run.label}: the run has no record of a plan yet; let it go on first")
    name = only_name("trajectory", "--trajectory", trajectory, sorted(plans))
    return Recorded(run, task, name, tuple(sorted(plans[name], key=lambda record: record.payload.index)))


@contextmanager
def replay(recorded: Recorded, data: str | None, scenes: Path | None) -> Iterator["Replay"]:
    """The recording's trajectory in a simulator like the run's, for as long as the context lasts.

    Args:
        recorded: what is carried out again.
        data: where the trajectories lie; None for those that come with the package.
        scenes: folder with recorded floor plans, for the embedded simulator.

    Raises:
        UsageError: the trajectories do not come with the package, and `data` is not given or not there.
        DataError: the trajectory is not among them, or is another than the run's.
        SimulatorError: the simulator has no such scene or fails.
    """
    digest = recorded.run.config.tasks[recorded.task].trajectories.get(recorded.trajectory)
    bundled = _settings(recorded).get("bundled")
    courses, course = find_again(recorded.task, recorded.trajectory, digest, data, bundled, read_course)
    name = recorded.run.config.simulator
    # All of them, as in the run: the embedded simulator learns of floor plans from each.
    simulators = Simulators(name, scenes, [item.trajectory for item in courses.found], instances=False)
    with closing(simulators), simulators.one() as simulator:
        yield Replay(recorded, course, simulator)


def _settings(recorded: Recorded) -> Mapping[str, object]:
    found = recorded.run.config.tasks[recorded.task].config.get("dataset_kwargs")
    return found if isinstance(found, Mapping) else {}


class Replay:
    """See `replay`. The scene is restored when the first plan is asked for.

    Attributes:
        n_episodes: number of plans of the trajectory.
    """

    def __init__(self, recorded: Recorded, course: Course, simulator: Simulator) -> None:
        self._recorded, self._course, self._simulator = recorded, course, simulator
        self._environment: PlanEnvironment | None = None
        self.n_episodes = len(course.plans)

    def frames(self, plans: Sequence[Record]) -> Iterator[Moment]:
        """The moments of some plans, in time order: the start of each, then its actions.

        Raises:
            DataError: the identity is not that of a run of plans, or the simulator refuses the expert.
            SimulatorError: the simulator fails.
        """
        for plan in plans:
            yield from self._plan_moments(plan) if plan.payload.steps else [self._never_begun(plan)]

    def _never_begun(self, plan: Record) -> Moment:
        """Of a plan that was left out, failed or was not come to; there is nothing to see of it."""
        why = plan.excluded or plan.failure
        ending = f"{'left out' if plan.excluded else 'failed'}: {why}" if why else plan.payload.ended
        return Moment(self._title(plan), None, self._rewards(plan, 0), ending=ending)

    def _plan_moments(self, plan: Record) -> Iterator[Moment]:
        stage = _Stage(self._entered(), self._simulator, plan.payload.index)
        title = self._title(plan)
        yield Moment(title, stage.sight(), self._rewards(plan, 0))
        steps, told = plan.payload.steps, False
        for number, step in enumerate(steps, 1):
            is_end = number == len(steps)
            note = stage.carry_out(step, is_last=is_end)
            yield Moment(
                title,
                stage.sight(),
                self._rewards(plan, number),
                number=number,
                action=_action(step),
                reply=_reply(step),
                wrong=step.message,
                ending=plan.payload.ended if is_end else "",
                done=is_end and plan.payload.done,
                goal_reached=is_end and plan.payload.goal_reached,
                # What follows in a world that differs differs too: the first time says it.
                note=f"plan {title.number}, action {number}: {note}" if note and not told else "",
            )
            told = told or bool(note)

    def _title(self, plan: Record) -> PlanTitle:
        payload = plan.payload
        number, n_actions = payload.index + 1, len(payload.steps)
        return PlanTitle(number, self.n_episodes, payload.plan, payload.goal, payload.n_expert_steps, n_actions)

    def _rewards(self, plan: Record, number: int) -> Rewards:
        """After so many actions."""
        steps = plan.payload.steps[:number]
        earned = sum(step.reward for step in steps)
        return Rewards(
            step=steps[-1].reward if steps else None,
            plan=earned,
            most_of_plan=plan.payload.max_reward,
            so_far=self._recorded.earned_before(plan) + earned,
            most=self._recorded.most_up_to(plan),
        )

    def _entered(self) -> PlanEnvironment:
        if self._environment is None:
            about = self._recorded.run.config.tasks[self._recorded.task]
            problem = f"{self._recorded.run.label}: rewards that this version does not know"
            with wrap_errors(problem, "run the evaluation again", catch=msgspec.ValidationError):
                rules = msgspec.convert(about.rewards, RewardRules)
                max_steps = msgspec.convert(_settings(self._recorded).get("max_steps", MAX_STEPS), int)
            self._environment = PlanEnvironment(
                self._course.trajectory, self._simulator, rules=rules, max_steps=max_steps
            )
        return self._environment


class _Stage:
    """One plan in which recorded actions are carried out."""

    def __init__(self, environment: PlanEnvironment, simulator: Simulator, plan: int) -> None:
        self._environment = environment
        observation, _ = environment.reset(plan)
        self._view, self._over = observation.view, False
        self._walked = [_point(self._view.agent)]
        self._named = frozenset(environment.named(plan))
        grid = reachable_grid(simulator)
        self._floor = tuple(grid.position(cell) for cell in sorted(grid.cells))
        is_way = environment.plans[plan].kind == PlanKind.GOTO
        self._goal = _pose(environment.expert_actions(plan)[-1].pose) if is_way else None

    def carry_out(self, step: StepRecord, *, is_last: bool) -> str:
        """One action; nothing where it was none that could be tried, or the plan is over here already.

        Returns:
            How it ended otherwise than recorded; empty where it did not.
        """
        if step.call is None or self._over:
            return ""
        outcome = self._environment.step(step.call)
        self._view = outcome.observation.view
        self._over = outcome.terminated or outcome.truncated
        here = _point(self._view.agent)
        if here != self._walked[-1]:
            self._walked.append(here)
        return _difference(step, outcome, self._over, is_last)

    def sight(self) -> Sight:
        """What there is to be seen now."""
        view = self._view
        if view.frame is None:
            raise DataError("the simulator sent no frame; use one that renders")
        drawn = (item for item in view.objects.values() if self._is_drawn(item))
        room = Room(self._floor, tuple(filter(None, map(self._thing, drawn))), self._goal)
        held = tuple(map(object_type_of, view.inventory))
        return Sight(view.frame, room, _pose(view.agent), tuple(self._walked), held)

    def _is_drawn(self, item: ThorObject) -> bool:
        if item.is_picked_up or item.object_type == _GROUND:
            return False
        return item.object_id in self._named or (not item.pickupable and (item.receptacle or item.moveable))

    def _thing(self, item: ThorObject) -> Thing | None:
        box = item.axis_aligned_bounding_box
        if box is None:
            return None
        x, z, wide, deep = box.center.x, box.center.z, box.size.x / 2, box.size.z / 2
        return Thing(item.object_type, (x - wide, z - deep), (x + wide, z + deep), item.object_id in self._named)


def _difference(step: StepRecord, outcome: StepOutcome, over: bool, is_last: bool) -> str:
    message = outcome.info.message
    if bool(step.message) != bool(message):
        return f"{step.action} {_told(message)} now, and {_told(step.message)} in the run"
    if abs(outcome.reward - step.reward) > _ALIKE:
        return f"{step.action} earns {outcome.reward:g} now, and {step.reward:g} in the run"
    if over != is_last:
        return f"the plan {'ends' if over else 'goes on'} now, and {'goes on' if over else 'ends'} in the run"
    return ""


def _told(message: str) -> str:
    return f"is refused ({message})" if message else "is carried out"


def _action(step: StepRecord) -> str:
    """In words; of an action that was given as a call, the expert's, the record has the name alone."""
    object_id = (step.call or {}).get("objectId")
    if isinstance(object_id, str) and step.call is not None and step.action == step.call["action"]:
        return str(text_of(step.action, object_id))
    return step.action


def _reply(step: StepRecord) -> str:
    said = step.reply or ""
    return "" if said.strip() == step.action else said


def _point(pose: AgentPose) -> Point:
    return pose.position.x, pose.position.z


def _pose(pose: AgentPose) -> Pose:
    return Pose(_point(pose), pose.rotation)
