"""Recorded episodes of an arm replayed; see `infthor_eval.episodes.replaying`.

Replays show the frame, the arm and nearby objects in the agent's coordinates, and steps in words.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

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
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, arm_of
from infthor_eval.manipulation.expert import ExpertStates, replay_expert
from infthor_eval.manipulation.geometry import Point, middle_of, point_of, size_of
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.recorded.replay_frames import (
    ArmFrame,
    ArmObservation,
    EpisodeTitle,
    NearbyObject,
    Place,
    Reach,
)
from infthor_eval.manipulation.recorded.runs import ArmRun
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.task import ArmTaskSettings
from infthor_eval.manipulation.trajectories import ArmTrajectory, read_arm_trajectory
from infthor_eval.runs import UnitRecord
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

Record = UnitRecord[ArmRecord]
_TOLERANCE = 1e-4  # metres; positions are recorded to a thousandth of a millimetre
_ENDED_BY_WORLD = {ArmEnded.DONE, ArmEnded.ELSEWHERE}  # not by a limit, or by an actor that gave up
_LEFT_OUT = {"action", "returnToStart"}
_MARGIN = 0.1  # metres around what a picture must contain
_NEAR = 2.5  # metres from the agent within which objects are drawn
_NOT_DRAWN = {"Floor", "Wall", "Ceiling"}  # the room itself, as large as the picture


class RecordedEpisodes(RecordedTrajectory[ArmRun, ArmRecord]):
    """What a run recorded of an arm's episodes in one trajectory."""

    def at_actions(self, actions: Sequence[int]) -> list[Record]:
        """Return the records for some of the expert's actions; UsageError if the run lacks one."""
        known = [record.payload.index for record in self.records]
        for action in actions:
            if action not in known:
                there = ", ".join(map(str, known))
                raise UsageError(
                    f"--episode {action}: the run has episodes {there:.300} of {self.trajectory}"
                )
        return [record for record in self.records if record.payload.index in actions]


def recorded_episodes(run: ArmRun, task: str | None, trajectory: str | None) -> RecordedEpisodes:
    """Find a run's records of a trajectory; None for the only one.

    Args:
        task: name of the task; None for all of them, if they are of different kinds.
    """
    tasks = list(run.config.tasks)
    kinds = [config.kind for config in run.config.tasks.values()]
    if task is not None or len(set(kinds)) < len(kinds):
        tasks = [only_name("task", "--task", task, tasks)]
    return RecordedEpisodes(run, *records_of_trajectory(run, tasks, trajectory))


@contextmanager
def replay_episodes(
    recorded: RecordedEpisodes, data: Path | None, scenes: Path | None
) -> Iterator["ArmReplay"]:
    """Open a session; see `restore_trajectory`."""
    with restore_trajectory(recorded, read_arm_trajectory, data, scenes) as (
        trajectory,
        start_simulator,
    ):
        yield ArmReplay(recorded, trajectory, start_simulator)


class ArmReplay(EpisodeReplay[ArmRecord, ArmFrame]):
    """Simulators in which recorded episodes are replayed, started for the first episode."""

    def __init__(
        self,
        recorded: RecordedEpisodes,
        trajectory: ArmTrajectory,
        start_simulator: Callable[..., Simulator],
    ) -> None:
        self._recorded = recorded
        self._trajectory = trajectory
        self._start_simulator = start_simulator
        # By camera, see `ArmTaskSettings.camera`.
        self._environments: dict[tuple[int, float], ArmEnvironment] = {}

    @property
    def n_episodes(self) -> int:
        """Number of recorded episodes."""
        return len(self._recorded.records)

    @cached_property
    def _expert_states(self) -> ExpertStates:
        return replay_expert(self._trajectory.data, self._start_simulator(image=False))

    def _begin(self, record: Record) -> "_EpisodeInReplay":
        payload = record.payload
        by_index = {episode.index: episode for episode in self._trajectory.episodes}
        if payload.index not in by_index:
            raise DataError(
                f"{self._trajectory.traj_id}: action {payload.index} is no pick-up or put; restore "
                "the journal"
            )
        settings = self._settings(record)
        episode = by_index[payload.index]
        start = self._expert_states.before(episode)
        environment = self._environment(settings)
        # Calls are repeated as recorded, so nothing is converted; frames are taken from the view.
        begun = environment.reset(episode, start, Conversion(), settings.grasp, NoFrames())
        return _EpisodeInReplay(environment, begun, payload)

    def _settings(self, record: Record) -> ArmTaskSettings:
        run = self._recorded.run
        config = run.config.tasks[record.task]
        problem = f"{run.label}: settings of {record.task} that this version does not know"
        with wrap_errors(problem, "run the evaluation again", catch=msgspec.ValidationError):
            settings = msgspec.convert(config.dataset_kwargs, ArmTaskSettings)
        return replace(settings, radius=config.radius)

    def _environment(self, settings: ArmTaskSettings) -> ArmEnvironment:
        """Return the environment whose frames are like the run's."""
        if settings.camera not in self._environments:
            simulator = self._start_simulator(agentMode="arm", **settings.camera_options)
            self._environments[settings.camera] = ArmEnvironment(self._trajectory.data, simulator)
        return self._environments[settings.camera]

    def _describe_step(self, record: Record, number: int) -> str:
        return f"action {record.payload.index}, step {number}"

    def _frame(
        self, record: Record, number: int, observation: ArmObservation | None, note: str
    ) -> ArmFrame:
        payload = record.payload
        steps = payload.steps[:number]
        distances = [payload.start_distance] if payload.attempted else []
        distances += [step.distance for step in steps]
        is_end = payload.attempted and number == len(payload.steps)
        last = steps[-1] if steps else None
        calls = last.calls if last is not None else ()
        return ArmFrame(
            title=self._title(record),
            observation=observation,
            number=number,
            ending=ending_of(record, number),
            done=is_end and payload.done,
            note=note,
            requests=tuple(_describe_request(last)) if last is not None else (),
            actions=tuple(str(call.get("action", "")) for call in calls),
            refusals=last.refusals if last is not None else (),
            distance=distances[-1] if distances else None,
            closest=min(distances, default=None),
            n_collisions=sum(step.n_collisions for step in steps),
            reward=payload.reward if is_end else 0.0,
            max_reward=payload.max_reward,
        )

    def _title(self, record: Record) -> EpisodeTitle:
        payload = record.payload
        return EpisodeTitle(
            number=self._recorded.records.index(record) + 1,
            n_episodes=self.n_episodes,
            action=payload.index,
            kind=KIND_NAMES[ManipulationKind(payload.kind)],
            instruction=payload.instruction,
            n_steps=len(payload.steps),
            radius=self._recorded.run.config.tasks[record.task].radius,
        )


class _EpisodeInReplay:
    """An episode that is being replayed."""

    def __init__(self, environment: ArmEnvironment, begun: ArmOutcome, payload: ArmRecord) -> None:
        self._environment = environment
        self._outcome = begun
        self._payload = payload
        start = environment.start
        named = [start.object_id, *([start.receptacle_id] if start.receptacle_id else [])]
        self._observer = _ArmObserver(begun.view, [step.hand for step in payload.steps], named)

    def repeat(self, step: ArmStep, *, is_last: bool) -> str:
        """See `EpisodeInReplay`."""
        if self._outcome.ended is not None:
            return ""
        self._outcome = self._environment.step(step.calls)
        ended = self._payload.ended
        recorded = ended if is_last and ended in _ENDED_BY_WORLD else None
        return _difference(step, self._outcome, recorded)

    def observe(self) -> ArmObservation:
        """See `EpisodeInReplay`."""
        return self._observer.observe(self._outcome.view)


def _difference(step: ArmStep, outcome: ArmOutcome, ended: str | None) -> str:
    """Return how the outcome of a step differs from its record; empty if it does not."""
    if bool(step.refusals) != bool(outcome.refusals):
        return (
            f"{_success_text(outcome.refusals)} now, and {_success_text(step.refusals)} in the run"
        )
    apart = math.dist(point_of(arm_of(outcome.view).sphere_center), step.hand)
    if apart > _TOLERANCE:
        return f"the hand is {100 * apart:.2g} cm from where it was in the run"
    if outcome.ended != ended:
        return (
            f"the episode {_ending_text(outcome.ended)} now, and {_ending_text(ended)} in the run"
        )
    return ""


def _success_text(refusals: Sequence[str]) -> str:
    return f"it is refused ({refusals[0]})" if refusals else "it succeeds"


def _ending_text(ended: str | None) -> str:
    return "goes on" if ended is None else f"ends ({ended})"


def _describe_request(step: ArmStep) -> Iterator[str]:
    """Yield a policy's request in centimetres and degrees, then the simulator's calls, by line."""
    if step.delta is not None:
        x, y, z, roll, pitch, yaw, gripper = step.delta
        moved = f"x {100 * x:+.1f}, y {100 * y:+.1f}, z {100 * z:+.1f}"
        turned = (("roll", roll), ("pitch", pitch), ("yaw", yaw))
        angles = ", ".join(f"{name} {math.degrees(value):+.0f}" for name, value in turned)
        yield f"delta: {moved} cm; {angles} deg; gripper {gripper:.2f}"
    yield "; ".join(map(_describe_call, step.calls)) or "(no call: the arm stands still)"


def _describe_call(call: Mapping[str, Any]) -> str:
    """Return a call of AI2-THOR's, shortened: numbers with three digits, objects by their types."""
    arguments = (_argument(name, value) for name, value in call.items() if name not in _LEFT_OUT)
    return " ".join([str(call.get("action", "?")), *filter(None, arguments)])


def _argument(name: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return name if value else ""
    if isinstance(value, Mapping):
        return " ".join(_argument(str(key), part) for key, part in value.items())
    if isinstance(value, int | float):
        return f"{name} {value:.3g}"
    if isinstance(value, list | tuple):
        return ", ".join(object_type_of(str(part)) for part in value)
    return str(value)


class _ArmObserver:
    """Observes one episode; all its pictures have the same bounds."""

    def __init__(self, begun: SimulatorView, hands: Iterable[Point], named: Sequence[str]) -> None:
        """Set the bounds by the world at the start, and the sphere's centres in it.

        Args:
            named: ids of the objects that the instruction names.
        """
        self._agent = begun.agent
        self._named = frozenset(named)
        self._path = [self._hand(begun)]
        points = [
            *self._path,
            *map(self._to_agent, hands),
            *self._joints(begun),
            (0.0, 0.0, self._path[0][2]),
        ]
        for nearby in self._objects(begun):
            if nearby.is_named:
                points += [(*corner, nearby.low) for corner in nearby.corners]
                points += [(*corner, nearby.high) for corner in nearby.corners]
        radius = arm_of(begun).sphere_radius
        right, ahead, up = self._path[0]
        points += [(right + offset, ahead + offset, up + offset) for offset in (-radius, radius)]
        self._low = _corner(points, min, -_MARGIN)
        self._high = _corner(points, max, _MARGIN)

    def observe(self, view: SimulatorView) -> ArmObservation:
        """Return what is seen in the next view of the episode; DataError if it has no frame."""
        if view.frame is None:
            raise DataError("the simulator sent no frame; use one that renders")
        arm = arm_of(view)
        hand = self._hand(view)
        if hand != self._path[-1]:
            self._path.append(hand)
        reach = Reach(
            joints=tuple(self._joints(view)),
            hand=hand,
            radius=arm.sphere_radius,
            path=tuple(self._path),
            objects=tuple(self._objects(view)),
            low=self._low,
            high=self._high,
        )
        return ArmObservation(view.frame, reach, tuple(map(object_type_of, arm.held)))

    def _hand(self, view: SimulatorView) -> Place:
        return self._to_agent(point_of(arm_of(view).sphere_center))

    def _joints(self, view: SimulatorView) -> Iterator[Place]:
        return (self._to_agent(point_of(joint.position)) for joint in arm_of(view).joints)

    def _objects(self, view: SimulatorView) -> Iterator[NearbyObject]:
        return (self._nearby(each) for each in view.objects.values() if self._is_drawn(each))

    def _is_drawn(self, thor_object: ThorObject) -> bool:
        if thor_object.object_id in self._named:
            return True
        if (
            thor_object.object_type in _NOT_DRAWN
            or thor_object.pickupable
            or thor_object.axis_aligned_bounding_box is None
        ):
            return False
        right, ahead, _ = self._to_agent(middle_of(thor_object))
        return (thor_object.receptacle or thor_object.moveable) and math.hypot(right, ahead) < _NEAR

    def _nearby(self, thor_object: ThorObject) -> NearbyObject:
        x, y, z = middle_of(thor_object)
        width, height, depth = size_of(thor_object)
        signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        corners = (self._to_agent((x + i * width / 2, y, z + j * depth / 2))[:2] for i, j in signs)
        is_named = thor_object.object_id in self._named
        return NearbyObject(
            thor_object.object_type, tuple(corners), y - height / 2, y + height / 2, is_named
        )

    def _to_agent(self, point: Point) -> Place:
        """Return a point in the agent's coordinates; its rotation goes from +z towards +x."""
        x = point[0] - self._agent.position.x
        z = point[2] - self._agent.position.z
        turn = math.radians(self._agent.rotation)
        right = x * math.cos(turn) - z * math.sin(turn)
        return right, x * math.sin(turn) + z * math.cos(turn), point[1]


def _corner(
    points: Sequence[Place], choose: Callable[[Iterable[float]], float], margin: float
) -> Place:
    right, ahead, up = zip(*points, strict=True)
    return choose(right) + margin, choose(ahead) + margin, choose(up) + margin
