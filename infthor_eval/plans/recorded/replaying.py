"""Recorded plans replayed; see `infthor_eval.episodes.replaying`."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.episodes.replaying import (
    EpisodeReplay,
    RecordedTrajectory,
    ending_of,
    records_of_trajectory,
    restore_trajectory,
)
from infthor_eval.episodes.shared_units import only_name
from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.object_ids import Words, object_type_of
from infthor_eval.household.scout import reachable_grid
from infthor_eval.plans.config import PlansTaskConfig
from infthor_eval.plans.environment import MAX_STEPS, PlanEnvironment, StepOutcome
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.recorded.replay_frames import (
    FloorPose,
    MapObject,
    PlanFrame,
    PlanObservation,
    PlanRewards,
    PlanTitle,
    Point,
    RoomMap,
)
from infthor_eval.plans.recorded.runs import PlansRun
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.plans.reward_rules import RewardRules
from infthor_eval.plans.trajectories import PlanTrajectory, read_plan_trajectory
from infthor_eval.runs import UnitRecord
from infthor_eval.thor.actions import text_of
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, ThorObject

Record = UnitRecord[PlanRecord]
_TOLERANCE = 1e-6  # rewards are recorded with six digits
_FLOOR = "Floor"  # object type of the room's own floor, which would cover the map


class RecordedPlans(RecordedTrajectory[PlansRun, PlanRecord]):
    """What a run recorded of the plans of one trajectory."""

    def between(self, first: int, last: int) -> list[Record]:
        """Return the records of plans by number, from 1, ends included; UsageError if lacking."""
        lowest = self.records[0].payload.index + 1
        highest = self.records[-1].payload.index + 1
        if not lowest <= first <= last <= highest:
            chosen = f"{first}" if first == last else f"{first}-{last}"
            raise UsageError(
                f"--plans {chosen}: the run has plans {lowest} to {highest} of {self.trajectory}; "
                "give some of these"
            )
        return [record for record in self.records if first <= record.payload.index + 1 <= last]


def recorded_plans(run: PlansRun, task: str | None, trajectory: str | None) -> RecordedPlans:
    """Find a run's records of a trajectory in a task; None for the only one."""
    tasks = [only_name("task", "--task", task, list(run.config.tasks))]
    return RecordedPlans(run, *records_of_trajectory(run, tasks, trajectory))


@contextmanager
def replay_plans(
    recorded: RecordedPlans, data: Path | None, scenes: Path | None
) -> Iterator["PlanReplay"]:
    """Open a session; see `restore_trajectory`."""
    words = _words(recorded.run.config.tasks[recorded.records[0].task])
    read = partial(read_plan_trajectory, words=words)
    with restore_trajectory(recorded, read, data, scenes) as (trajectory, start_simulator):
        yield PlanReplay(recorded, trajectory, start_simulator)


class PlanReplay(EpisodeReplay[PlanRecord, PlanFrame]):
    """A simulator in which recorded plans are replayed, started and restored for the first plan."""

    def __init__(
        self,
        recorded: RecordedPlans,
        trajectory: PlanTrajectory,
        start_simulator: Callable[..., Simulator],
    ) -> None:
        self._recorded = recorded
        self._trajectory = trajectory
        self._start_simulator = start_simulator
        self._world: tuple[PlanEnvironment, Simulator] | None = None

    @property
    def n_episodes(self) -> int:
        """Number of plans of the trajectory, recorded or not."""
        return len(self._trajectory.plans)

    def _begin(self, record: Record) -> "_PlanInReplay":
        if self._world is None:
            self._world = self._restore(record)
        return _PlanInReplay(*self._world, record.payload.index)

    def _restore(self, record: Record) -> tuple[PlanEnvironment, Simulator]:
        run = self._recorded.run
        config = run.config.tasks[record.task]
        problem = f"{run.label}: rewards that this version does not know"
        with wrap_errors(problem, "run the evaluation again", catch=msgspec.ValidationError):
            rules = msgspec.convert(config.rewards, RewardRules)
            max_steps = msgspec.convert(config.dataset_kwargs.get("max_steps", MAX_STEPS), int)
        simulator = self._start_simulator()
        environment = PlanEnvironment(
            self._trajectory.data,
            simulator,
            rules=rules,
            words=_words(config),
            max_steps=max_steps,
        )
        return environment, simulator

    def _describe_step(self, record: Record, number: int) -> str:
        return f"plan {record.payload.index + 1}, action {number}"

    def _frame(
        self, record: Record, number: int, observation: PlanObservation | None, note: str
    ) -> PlanFrame:
        payload = record.payload
        step = record.payload.steps[number - 1] if number else StepRecord()
        n_steps = len(payload.steps)
        is_end = 0 < number == n_steps
        return PlanFrame(
            title=PlanTitle(
                payload.index + 1,
                self.n_episodes,
                payload.plan,
                payload.goal,
                payload.n_expert_steps,
                n_actions=n_steps,
            ),
            observation=observation,
            number=number,
            ending=ending_of(record, number),
            done=is_end and payload.done,
            note=note,
            rewards=self._rewards(payload, number),
            action=_action_text(step),
            reply=step.reply if step.reply and step.reply.strip() != step.action else "",
            wrong=step.message,
            goal_reached=is_end and payload.goal_reached,
        )

    def _rewards(self, plan: PlanRecord, number: int) -> PlanRewards:
        """Return the rewards after some actions; excluded plans do not count."""
        steps = plan.steps[:number]
        earned = sum(step.reward for step in steps)
        counted = [r.payload for r in self._recorded.records if r.excluded is None]
        before = [other.reward for other in counted if other.index < plan.index]
        most = [other.max_reward or 0.0 for other in counted if other.index <= plan.index]
        return PlanRewards(
            step=steps[-1].reward if steps else None,
            plan=earned,
            max_of_plan=plan.max_reward,
            so_far=sum(before) + earned,
            max_so_far=sum(most),
        )


class _PlanInReplay:
    """A plan that is being replayed."""

    def __init__(self, environment: PlanEnvironment, simulator: Simulator, plan: int) -> None:
        self._environment = environment
        observation, _ = environment.reset(plan)
        self._view = observation.view
        self._is_over = False
        self._walked = [_point(self._view.agent)]
        self._named = frozenset(environment.named_objects(plan))
        grid = reachable_grid(simulator)
        self._floor = tuple(grid.position(cell) for cell in sorted(grid.cells))
        self._goal: FloorPose | None = None
        if environment.plans[plan].kind == PlanKind.GOTO:
            self._goal = _floor_pose(environment.expert_actions(plan)[-1].pose)

    def repeat(self, step: StepRecord, *, is_last: bool) -> str:
        """See `EpisodeInReplay`; a reply that could not be executed has no call to repeat."""
        if step.call is None or self._is_over:
            return ""
        outcome = self._environment.step(step.call)
        self._view = outcome.observation.view
        self._is_over = outcome.terminated or outcome.truncated
        here = _point(self._view.agent)
        if here != self._walked[-1]:
            self._walked.append(here)
        return _difference(step, outcome, self._is_over, is_last)

    def observe(self) -> PlanObservation:
        """See `EpisodeInReplay`."""
        view = self._view
        if view.frame is None:
            raise DataError("the simulator sent no frame; use one that renders")
        drawn = map(self._map_object, filter(self._is_drawn, view.objects.values()))
        objects = tuple(each for each in drawn if each is not None)
        room = RoomMap(self._floor, objects, self._goal)
        held = tuple(map(object_type_of, view.inventory))
        return PlanObservation(view.frame, room, _floor_pose(view.agent), tuple(self._walked), held)

    def _is_drawn(self, thor_object: ThorObject) -> bool:
        if thor_object.is_picked_up or thor_object.object_type == _FLOOR:
            return False
        if thor_object.object_id in self._named:
            return True
        return not thor_object.pickupable and (thor_object.receptacle or thor_object.moveable)

    def _map_object(self, thor_object: ThorObject) -> MapObject | None:
        box = thor_object.axis_aligned_bounding_box
        if box is None:
            return None
        low = box.center.x - box.size.x / 2, box.center.z - box.size.z / 2
        high = box.center.x + box.size.x / 2, box.center.z + box.size.z / 2
        is_named = thor_object.object_id in self._named
        return MapObject(thor_object.object_type, low, high, is_named)


def _words(config: PlansTaskConfig) -> Words:
    assert config.words is not None  # only imported counts have none, and they are refused before
    return config.words


def _difference(step: StepRecord, outcome: StepOutcome, is_over: bool, is_last: bool) -> str:
    message = outcome.info.message
    if bool(step.message) != bool(message):
        then = _success_text(step.message)
        return f"{step.action} {_success_text(message)} now, and {then} in the run"
    if abs(outcome.reward - step.reward) > _TOLERANCE:
        return f"{step.action} earns {outcome.reward:g} now, and {step.reward:g} in the run"
    if is_over != is_last:
        return (
            f"the plan {'ends' if is_over else 'goes on'} now, and "
            f"{'goes on' if is_over else 'ends'} in the run"
        )
    return ""


def _success_text(message: str) -> str:
    return f"is refused ({message})" if message else "succeeds"


def _action_text(step: StepRecord) -> str:
    """Return the action in words; the record of a call has its name alone."""
    object_id = (step.call or {}).get("objectId")
    if isinstance(object_id, str) and step.call is not None and step.action == step.call["action"]:
        return str(text_of(step.action, object_id))
    return step.action


def _point(pose: AgentPose) -> Point:
    return pose.position.x, pose.position.z


def _floor_pose(pose: AgentPose) -> FloorPose:
    return FloorPose(_point(pose), pose.rotation)
