"""Recorded episodes carried out again, so that they can be looked at: a journal has every call, and no frame.

What is told (what was asked, refusals, distances, endings) is what the run recorded. What is seen is made anew: the
environment is reset to each episode and the recorded calls are made, which leads where it led then if the simulator is
deterministic.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.episodes.shared_units import only_name
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.episodes.trajectory_sets import find_again
from infthor_eval.errors import DataError, UsageError, wrap_errors
from infthor_eval.formats.digests import digest
from infthor_eval.formats.trajectory import TrajectorySource
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, Grasp, arm_of
from infthor_eval.manipulation.geometry import point_of
from infthor_eval.manipulation.history import History, errands_of, history_of
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.moments import ArmMoment, ArmSight, EpisodeTitle
from infthor_eval.manipulation.recorded_runs import ArmRun
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.seeing import Onlooker
from infthor_eval.manipulation.task import ArmCourse, TaskSettings
from infthor_eval.manipulation.wording import asked_in_words
from infthor_eval.runs import UnitRecord
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.simulator import Simulator

__all__ = ["ArmReplay", "RecordedEpisodes", "recorded_episodes", "replay_episodes"]

Record = UnitRecord[ArmRecord]
_Camera = tuple[int, float]  # pixels of its frames, degrees of its view
_ALIKE = 1e-4  # metres; places are recorded to a thousandth of a millimetre
_ENDED_BY_WORLD = {ArmEnded.DONE, ArmEnded.ELSEWHERE}  # not by a limit, or by who gave up


@dataclass(frozen=True)
class RecordedEpisodes:
    """What a run has of one trajectory.

    Attributes:
        run: the run.
        trajectory: its name.
        episodes: their records, in time order.
    """

    run: ArmRun
    trajectory: str
    episodes: tuple[Record, ...]

    def standing_for(self, actions: Sequence[int]) -> list[Record]:
        """The episodes of some of the expert's low-level actions, in time order.

        Raises:
            UsageError: the run has none of one of them.
        """
        known = [record.payload.index for record in self.episodes]
        for action in actions:
            if action not in known:
                there = ", ".join(map(str, known))
                raise UsageError(f"--episode {action}: the run has episodes {there:.300} of {self.trajectory}")
        return [record for record in self.episodes if record.payload.index in actions]


def recorded_episodes(run: ArmRun, task: str | None, trajectory: str | None) -> RecordedEpisodes:
    """What a run has of a trajectory.

    Args:
        run: the run.
        task: which task of it; None takes all of them.
        trajectory: its name; None takes the only one.

    Raises:
        UsageError: there is no such task or trajectory, or none is given where it must be.
        DataError: the identity is not that of a run of manipulation, or it has no record yet.
    """
    tasks = list(run.config.tasks)
    kinds = [about.kind for about in run.config.tasks.values()]
    if task is not None or len(set(kinds)) < len(kinds):
        tasks = [only_name("task", "--task", task, tasks)]
    found: dict[str, list[Record]] = {}
    for record in run.records:
        if record.task in tasks:
            found.setdefault(record.cluster, []).append(record)
    if not found:
        raise DataError(f"{run.label}: the run has no record of an episode yet; let it go on first")
    name = only_name("trajectory", "--trajectory", trajectory, sorted(found))
    return RecordedEpisodes(run, name, tuple(sorted(found[name], key=lambda record: record.payload.index)))


@contextmanager
def replay_episodes(recorded: RecordedEpisodes, data: str | None, scenes: Path | None) -> Iterator["ArmReplay"]:
    """The recording's trajectory in simulators like the run's, for as long as the context lasts.

    Args:
        recorded: what is carried out again.
        data: where the trajectories lie; None for those that come with the package.
        scenes: folder with recorded floor plans, for the embedded simulator.

    Raises:
        UsageError: the trajectories do not come with the package, and `data` is not given or not there.
        DataError: the trajectory is not among them, or is another than the run's.
        SimulatorError: the simulator has no such scene or fails.
    """
    task = recorded.episodes[0].task
    about = recorded.run.config.tasks[task]
    told = about.trajectories.get(recorded.trajectory)
    courses, course = find_again(task, recorded.trajectory, told, data, about.settings.get("bundled"), _course)
    with ExitStack() as stack:

        def opened(**options: Any) -> Simulator:
            # All trajectories, as in the run: the embedded simulator learns of floor plans from each.
            trajectories = [item.trajectory for item in courses.found]
            simulators = Simulators(recorded.run.config.simulator, scenes, trajectories, instances=False, **options)
            stack.callback(simulators.close)
            return stack.enter_context(simulators.one())

        yield ArmReplay(recorded, course, opened)


def _course(source: TrajectorySource) -> ArmCourse:
    trajectory = source.read()
    return ArmCourse(trajectory, tuple(errands_of(trajectory)), digest(source.raw.strip()))


class ArmReplay:
    """See `replay_episodes`. Simulators are started when the first episode is replayed.

    Attributes:
        n_episodes: number of recorded episodes of the trajectory.
    """

    def __init__(self, recorded: RecordedEpisodes, course: ArmCourse, opened: Callable[..., Simulator]) -> None:
        self.n_episodes = len(recorded.episodes)
        self._recorded, self._course, self._opened = recorded, course, opened
        self._environments: dict[_Camera, ArmEnvironment] = {}

    def frames(self, episodes: Sequence[Record]) -> Iterator[ArmMoment]:
        """The moments of some episodes, in time order: the start of each, then its steps.

        Raises:
            DataError: the identity is not that of a run of manipulation, or an episode cannot be begun here.
            SimulatorError: the simulator fails.
        """
        for record in episodes:
            yield from self._episode_moments(record) if record.payload.ended else [self._never_begun(record)]

    def _never_begun(self, record: Record) -> ArmMoment:
        """Of an episode that was left out or failed; there is nothing to see of it."""
        why = f"left out: {record.excluded}" if record.excluded else f"failed: {record.failure or 'for no reason'}"
        return ArmMoment(self._title(record), None, most=record.payload.max_reward, ending=why)

    def _episode_moments(self, record: Record) -> Iterator[ArmMoment]:
        stage = _Stage(record.payload)
        sight = stage.begin(self._settings(record), self)
        moment = ArmMoment(
            self._title(record),
            sight,
            distance=record.payload.start_distance,
            closest=record.payload.start_distance,
            most=record.payload.max_reward,
        )
        steps, told = record.payload.steps, False
        yield moment if steps else _at_end(moment, record.payload)
        for number, step in enumerate(steps, 1):
            note = stage.carry_out(step, is_last=number == len(steps))
            moment = _after(moment, step, number, stage.sight())
            # What follows in a world that differs differs too: the first time says it.
            note = f"action {record.payload.index}, step {number}: {note}" if note and not told else ""
            told = told or bool(note)
            moment = replace(moment, note=note)
            yield _at_end(moment, record.payload) if number == len(steps) else moment

    def _title(self, record: Record) -> EpisodeTitle:
        payload = record.payload
        return EpisodeTitle(
            number=self._recorded.episodes.index(record) + 1,
            n_episodes=len(self._recorded.episodes),
            action=payload.index,
            kind=KIND_NAMES[ManipulationKind(payload.kind)],
            instruction=payload.instruction,
            n_steps=len(payload.steps),
            radius=self._recorded.run.config.tasks[record.task].radius,
        )

    def _settings(self, record: Record) -> TaskSettings:
        about, label = self._recorded.run.config.tasks[record.task], self._recorded.run.label
        problem = f"{label}: settings of {record.task} that this version does not know"
        with wrap_errors(problem, "run the evaluation again", catch=msgspec.ValidationError):
            return replace(msgspec.convert(about.settings, TaskSettings), radius=about.radius)

    @cached_property
    def history(self) -> History:
        """What the expert did."""
        return history_of(self._course.trajectory, self._opened(image=False))

    @property
    def course(self) -> ArmCourse:
        """The trajectory."""
        return self._course

    def environment(self, settings: TaskSettings) -> ArmEnvironment:
        """The arm's world, with frames as the run had them."""
        camera = settings.image_size, settings.field_of_view
        if camera not in self._environments:
            size, field = camera
            simulator = self._opened(agentMode="arm", width=size, height=size, fieldOfView=field)
            self._environments[camera] = ArmEnvironment(self._course.trajectory, simulator)
        return self._environments[camera]


class _Stage:
    """An episode on its way again."""

    def __init__(self, payload: ArmRecord) -> None:
        self._payload, self._over = payload, False

    def begin(self, settings: TaskSettings, replay: ArmReplay) -> ArmSight:
        """Bring the world there.

        Raises:
            DataError: the trajectory has no such action, or nobody can act there now.
        """
        payload = self._payload
        errand = next((item for item in replay.course.errands if item.index == payload.index), None)
        if errand is None:
            raise DataError(
                f"{replay.course.traj_id}: action {payload.index} is no pick-up or put; restore the journal"
            )
        grasp = Grasp(
            radius=settings.radius,
            takes_all=settings.grasps == "all",
            at_palm=settings.hold == "palm",
            threshold=settings.gripper_threshold,
        )
        moment = replay.history.moment(errand)
        self._environment = replay.environment(settings)
        self._outcome = self._environment.reset(errand, moment, Conversion(), grasp, NoFrames())
        named = [name for name in (moment.object_id, moment.receptacle_id) if name is not None]
        self._onlooker = Onlooker(self._outcome.view, [step.hand for step in payload.steps], named)
        return self.sight()

    def carry_out(self, step: ArmStep, *, is_last: bool) -> str:
        """One step; nothing where the episode is over here already.

        Returns:
            How it went otherwise than recorded; empty where it did not.
        """
        if self._over:
            return ""
        self._outcome = self._environment.step(step.calls)
        self._over = self._outcome.ended is not None
        recorded = self._payload.ended if is_last and self._payload.ended in _ENDED_BY_WORLD else None
        return _difference(step, self._outcome, recorded)

    def sight(self) -> ArmSight:
        """What there is to be seen now."""
        return self._onlooker.sight(self._outcome.view)


def _difference(step: ArmStep, outcome: ArmOutcome, ended: str | None) -> str:
    """In what a step differs from its record."""
    if bool(step.refusals) != bool(outcome.refusals):
        return f"{_told(outcome.refusals)} now, and {_told(step.refusals)} in the run"
    apart = math.dist(point_of(arm_of(outcome.view).sphere_center), step.hand)
    if apart > _ALIKE:
        return f"the hand is {100 * apart:.2g} cm from where it was in the run"
    if outcome.ended != ended:
        return f"the episode {_going(outcome.ended)} now, and {_going(ended)} in the run"
    return ""


def _told(refusals: Sequence[str]) -> str:
    return f"it is refused ({refusals[0]})" if refusals else "it is carried out"


def _going(ended: str | None) -> str:
    return "goes on" if ended is None else f"ends ({ended})"


def _after(before: ArmMoment, step: ArmStep, number: int, sight: ArmSight) -> ArmMoment:
    """The moment after a step."""
    closest = step.distance if before.closest is None else min(before.closest, step.distance)
    return replace(
        before,
        sight=sight,
        number=number,
        asked=tuple(asked_in_words(step)),
        actions=tuple(str(call.get("action", "")) for call in step.calls),
        refusals=step.refusals,
        distance=step.distance,
        closest=closest,
        n_collisions=before.n_collisions + step.n_collisions,
    )


def _at_end(moment: ArmMoment, payload: ArmRecord) -> ArmMoment:
    return replace(moment, ending=payload.ended, done=payload.done, reward=payload.reward)
