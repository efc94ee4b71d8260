"""Manipulation set up for a run: which episodes of which trajectories, and the doing of them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

import msgspec

from infthor_eval.episodes.retries import with_retries
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.errors import InfthorError, SceneError
from infthor_eval.formats.floor_plans import floor_plans_digest
from infthor_eval.manipulation.actors import ArmActor, ArmBaseline, PolicyActor
from infthor_eval.manipulation.episodes import ArmStage, described
from infthor_eval.manipulation.history import Errand, UnfitEpisodeError, history_of
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.task import ArmCourse, ManipulationTask
from infthor_eval.runs import (
    Group,
    Session,
    Skipped,
    TaskRequest,
    Unit,
    UnitKey,
    UnitRecord,
    UnitSample,
    Workload,
)
from infthor_eval.runs.run_config import episode_fingerprint
from model_adapters import Policy, Subject

__all__ = ["ArmUnit", "BoundManipulation", "ManipulationEvaluation"]

_Camera = tuple[int, float]  # pixels of its frames, degrees of its view


@dataclass(frozen=True)
class ArmUnit(Unit[ArmRecord]):
    """A unit that is an episode.

    Attributes:
        course: its trajectory.
        errand: what it is about.
    """

    course: ArmCourse
    errand: Errand

    @classmethod
    def of(cls, task: ManipulationTask, course: ArmCourse, errand: Errand) -> "ArmUnit":
        """The unit of a task's episode."""
        key = UnitKey(task.name, f"{course.traj_id}/{errand.index:04d}")
        return cls(key, course.traj_id, described(task, errand), course, errand)


class ManipulationEvaluation:
    """Manipulation set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[ManipulationOptions]) -> None:
        """Read the tasks and their trajectories.

        Raises:
            UsageError: a task without its trajectories, or an option that does not fit.
            DataError: a task file or all of its trajectories are not what they should be.
        """
        self._seed = request.seed
        self._options = request.options
        self._tasks = {file.name: ManipulationTask(file, request) for file in request.tasks}
        self._scenes = Path(self._options.scenes) if self._options.scenes is not None else None
        self._floor_plans = floor_plans_digest(self._scenes) if self._scenes is not None else None

    @property
    def units(self) -> list[ArmUnit]:
        """The episodes of all tasks, task by task, in the order of trajectories and time."""
        return [ArmUnit.of(task, course, errand) for task in self._tasks.values() for course, errand in task.episodes]

    def bind(self, subject: Subject) -> "BoundManipulation":
        """See `infthor_eval.runs.Evaluation.bind`.

        Raises:
            TypeError: the subject is neither a policy nor a baseline of manipulation; runs refuse it before.
        """
        blank = self._options.frames == "blank"
        if isinstance(subject, ArmBaseline):
            new_actor: Callable[[], ArmActor] = subject.arm_actor
        elif isinstance(subject, Policy):
            new_actor = partial(PolicyActor, subject, blank=blank)
        else:
            raise TypeError(f"{subject} is neither a policy nor a baseline of manipulation")
        units = self.units
        workload = Workload(
            groups=[
                Group(same, frames=len(same[0].course.trajectory.plan.low_actions))
                for same in _by_trajectory(units).values()
            ],
            skipped=[
                Skipped(UnitKey(task.name, place), reason)
                for task in self._tasks.values()
                for place, reason in task.courses.broken
            ],
            config={
                "tasks": {name: task.identity() for name, task in self._tasks.items()},
                "simulator": self._options.simulator,
                "ai2thor": version("ai2thor"),
                "floor_plans": self._floor_plans,
                "frames": self._options.frames,
            },
        )
        sees = isinstance(subject, Policy)
        cameras = {task.camera for task in self._tasks.values()}
        simulators = _ArmSimulators(self._options.simulator, self._scenes, units, cameras, sees=sees)
        return BoundManipulation(workload, self._tasks, _positions(units), new_actor, simulators, self._seed)


class _ArmSimulators:
    """The simulators of experts, whose frames are not rendered, and those of arms, by camera."""

    def __init__(
        self, name: str, scenes: Path | None, units: Sequence[ArmUnit], cameras: Iterable[_Camera], *, sees: bool
    ) -> None:
        every = {unit.cluster: unit.course.trajectory for unit in units}
        create = partial(Simulators, name, scenes, list(every.values()), instances=False)
        self.sees = sees
        self.arms = {
            (size, angle): create(image=sees, agentMode="arm", width=size, height=size, fieldOfView=angle)
            for size, angle in cameras
        }
        self.experts = create(image=False)

    def close(self) -> None:
        with ExitStack() as stack:
            for simulators in (*self.arms.values(), self.experts):
                stack.callback(simulators.close)


class BoundManipulation:
    """Manipulation for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(
        self,
        workload: Workload[ArmUnit],
        tasks: Mapping[str, ManipulationTask],
        numbers: Mapping[UnitKey, int],
        new_actor: Callable[[], ArmActor],
        simulators: _ArmSimulators,
        seed: int,
    ) -> None:
        """Take up what was prepared for the subject.

        Args:
            workload: all the work.
            tasks: the tasks by name.
            numbers: positions of the episodes in their tasks.
            new_actor: creates what drives an arm on one trajectory.
            simulators: the simulators of experts and arms; closed with this.
            seed: seed of the run.
        """
        self.workload = workload
        self._tasks, self._numbers, self._new_actor = tasks, numbers, new_actor
        self._simulators, self._seed = simulators, seed

    def run(self, group: Group[ArmUnit], session: Session[ArmRecord]) -> Iterator[UnitRecord[ArmRecord]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        prints = {unit.key: self._fingerprint(unit) for unit in group.units}
        earlier = {unit.key: session.find_record(unit, prints[unit.key]) for unit in group.units}
        yield from (record for record in earlier.values() if record is not None)
        by_camera: dict[_Camera, list[ArmUnit]] = {}
        for unit in group.units:
            if earlier[unit.key] is None:
                by_camera.setdefault(self._tasks[unit.key.task].camera, []).append(unit)
        for camera, same in by_camera.items():
            yield from self._played(same, prints, camera)

    def to_sample(self, record: UnitRecord[ArmRecord]) -> UnitSample:
        """See `infthor_eval.runs.BoundEvaluation.to_sample`."""
        payload, task = record.payload, self._tasks[record.task]
        return UnitSample(
            number=self._numbers[record.key],
            doc={"traj_id": record.cluster, "action": payload.index, "kind": payload.kind},
            target=payload.instruction,
            prompt=payload.instruction,
            settings={"max_steps": task.settings.max_steps},
            reply=payload.ended,
        )

    def close(self) -> None:
        """See `infthor_eval.runs.BoundEvaluation.close`."""
        self._simulators.close()

    def _played(
        self, units: list[ArmUnit], prints: dict[UnitKey, str], camera: _Camera
    ) -> Iterator[UnitRecord[ArmRecord]]:
        trajectory = units[0].course.trajectory
        try:
            with self._simulators.experts.one() as expert:
                history, faults = with_retries(expert, lambda: history_of(trajectory, expert), lambda: None)
        except SceneError as error:
            yield from (unit.excluded(str(error), prints[unit.key]) for unit in units)
            return
        with self._simulators.arms[camera].one() as simulator:
            sees, actor = self._simulators.sees, self._new_actor()
            stage = ArmStage(trajectory, history, simulator, actor, sees=sees, seed=self._seed)
            for unit in units:
                record = _recorded(unit, prints[unit.key], stage, self._tasks[unit.key.task])
                yield msgspec.structs.replace(record, faults=(*faults, *record.faults))
                faults = ()  # the expert's are told once

    def _fingerprint(self, unit: ArmUnit) -> str:
        return episode_fingerprint(
            self.workload.config,
            unit.key.task,
            trajectory=unit.course.digest,
            action=unit.errand.index,
            seed=self._seed,
        )


def _positions(units: Iterable[ArmUnit]) -> dict[UnitKey, int]:
    """Return the positions of units in their tasks, given task by task."""
    by_task = groupby(units, key=lambda unit: unit.key.task)
    return {unit.key: number for _, same in by_task for number, unit in enumerate(same)}


def _by_trajectory(units: Iterable[ArmUnit]) -> dict[str, list[ArmUnit]]:
    """Return the episodes of all tasks by trajectory, in time order: they share its history."""
    by_name: dict[str, list[ArmUnit]] = {}
    for unit in units:
        by_name.setdefault(unit.cluster, []).append(unit)
    return {name: sorted(same, key=lambda unit: (unit.errand.index, unit.key)) for name, same in by_name.items()}


def _recorded(unit: ArmUnit, inputs: str, stage: ArmStage, task: ManipulationTask) -> UnitRecord[ArmRecord]:
    try:
        played = stage.play(task, unit.errand)
    except (UnfitEpisodeError, SceneError) as error:
        return unit.excluded(str(error), inputs)
    except InfthorError as error:
        return unit.failed(str(error), inputs)
    return unit.record(inputs, played.record, faults=played.faults, seconds=round(played.seconds, 4))
