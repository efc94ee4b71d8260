"""Recorded episodes of an arm replayed; see `infthor_eval.episodes.replaying`."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
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
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, arm_of
from infthor_eval.manipulation.expert import ExpertStates, replay_expert
from infthor_eval.manipulation.geometry import point_of
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.recorded.observing import ArmObserver
from infthor_eval.manipulation.recorded.replay_frames import ArmFrame, ArmObservation, EpisodeTitle
from infthor_eval.manipulation.recorded.runs import ArmRun
from infthor_eval.manipulation.recorded.wording import describe_request
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.task import ArmTaskSettings
from infthor_eval.manipulation.trajectories import ArmTrajectory, read_arm_trajectory
from infthor_eval.runs import UnitRecord
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.simulator import Simulator

Record = UnitRecord[ArmRecord]
_TOLERANCE = 1e-4  # metres; positions are recorded to a thousandth of a millimetre
_ENDED_BY_WORLD = {ArmEnded.DONE, ArmEnded.ELSEWHERE}  # not by a limit, or by an actor that gave up


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

    Raises:
        UsageError: there is no such task or trajectory, or none is given where there are several.
        DataError: it is not a run of manipulation, or has no record yet.
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
            requests=tuple(describe_request(last)) if last is not None else (),
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
        self._observer = ArmObserver(begun.view, [step.hand for step in payload.steps], named)

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
