"""Manipulation set up for a run: which episodes of which trajectories, and the doing of them."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Any

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
from infthor_eval.runs.identity import episode_fingerprint
from model_adapters import Policy, Subject

__all__ = ["ArmUnit", "ManipulationEvaluation"]

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
    """See `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest) -> None:
        """Read the tasks and their trajectories.

        Raises:
            UsageError: a task without its trajectories, or an option that does not fit.
            DataError: a task file or all of its trajectories are not what they should be.
        """
        self._seed = request.seed
        self._options: ManipulationOptions = request.options
        self._tasks = {file.name: ManipulationTask(file, request) for file in request.tasks}
        self._scenes = Path(self._options.scenes) if self._options.scenes is not None else None
        self._floor_plans = floor_plans_digest(self._scenes) if self._scenes is not None else None
        self._subject: Subject | None = None
        self._open = ExitStack()

    @property
    def units(self) -> list[ArmUnit]:
        """The episodes of all tasks, task by task, in the order of trajectories and time."""
        return [ArmUnit.of(task, course, errand) for task in self._tasks.values() for course, errand in task.episodes]

    def workload(self, subject: Subject) -> Workload:
        """See `infthor_eval.runs.Evaluation.workload`."""
        self._subject = subject
        self._experts, self._arms = self._described_simulators(isinstance(subject, Policy))
        self._identity: dict[str, Any] = {
            "tasks": {name: task.identity() for name, task in self._tasks.items()},
            "simulator": self._options.simulator,
            "ai2thor": version("ai2thor"),
            "floor_plans": self._floor_plans,
            "frames": self._options.frames,
        }
        return Workload(
            groups=[
                Group(units, frames=len(units[0].course.trajectory.plan.low_actions))
                for units in self._by_trajectory().values()
            ],
            skipped=[
                Skipped(UnitKey(task.name, place), reason)
                for task in self._tasks.values()
                for place, reason in task.courses.broken
            ],
            identity=self._identity,
        )

    def run(self, group: Group, session: Session) -> Iterator[UnitRecord[ArmRecord]]:
        """See `infthor_eval.runs.Evaluation.run`."""
        units: list[ArmUnit] = list(group.units)  # type: ignore[arg-type]  # its own groups
        prints = {unit.key: self._fingerprint(unit) for unit in units}
        known = {unit.key: session.known(unit, prints[unit.key]) for unit in units}
        yield from (record for record in known.values() if record is not None)
        left = [unit for unit in units if known[unit.key] is None]
        by_camera: dict[_Camera, list[ArmUnit]] = {}
        for unit in left:
            by_camera.setdefault(self._tasks[unit.key.task].camera, []).append(unit)
        for camera, same in by_camera.items():
            yield from self._played(same, prints, camera)

    def view(self, record: UnitRecord[ArmRecord]) -> UnitSample:
        """See `infthor_eval.runs.Evaluation.view`."""
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
        """See `infthor_eval.runs.Evaluation.close`."""
        self._open.close()

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Places of the episodes in their tasks."""
        by_task = groupby(self.units, key=lambda unit: unit.key.task)
        return {unit.key: number for _, same in by_task for number, unit in enumerate(same)}

    def _by_trajectory(self) -> dict[str, list[ArmUnit]]:
        """The episodes of all tasks by trajectory, in time order: they share its history."""
        found: dict[str, list[ArmUnit]] = {}
        for unit in self.units:
            found.setdefault(unit.cluster, []).append(unit)
        return {name: sorted(units, key=lambda unit: (unit.errand.index, unit.key)) for name, units in found.items()}

    def _played(
        self, units: list[ArmUnit], prints: dict[UnitKey, str], camera: _Camera
    ) -> Iterator[UnitRecord[ArmRecord]]:
        trajectory = units[0].course.trajectory
        try:
            with self._experts.one() as expert:
                history, faults = with_retries(expert, lambda: history_of(trajectory, expert), lambda: None)
        except SceneError as error:
            yield from (unit.excluded(str(error), prints[unit.key]) for unit in units)
            return
        sees = isinstance(self._subject, Policy)
        with self._arms[camera].one() as simulator:
            stage = ArmStage(trajectory, history, simulator, self._actor(), sees=sees, seed=self._seed)
            for unit in units:
                record = _recorded(unit, prints[unit.key], stage, self._tasks[unit.key.task])
                yield msgspec.structs.replace(record, faults=(*faults, *record.faults))
                faults = ()  # the expert's are told once

    def _actor(self) -> ArmActor:
        if isinstance(self._subject, ArmBaseline):
            return self._subject.arm_actor()
        if isinstance(self._subject, Policy):
            return PolicyActor(self._subject, blank=self._options.frames == "blank")
        raise TypeError(f"{self._subject} is neither a policy nor a baseline of manipulation")  # the run sees to that

    def _described_simulators(self, seen: bool) -> tuple[Simulators, dict[_Camera, Simulators]]:
        """Those of experts, which draw nothing, and those of arms by camera, which draw what somebody looks at."""
        every = {course.traj_id: course for task in self._tasks.values() for course, _ in task.episodes}
        trajectories = [course.trajectory for course in every.values()]

        def simulators(**options: Any) -> Simulators:
            made = Simulators(self._options.simulator, self._scenes, trajectories, instances=False, **options)
            self._open.callback(made.close)
            return made

        arms = {
            (size, angle): simulators(image=seen, agentMode="arm", width=size, height=size, fieldOfView=angle)
            for size, angle in {task.camera for task in self._tasks.values()}
        }
        return simulators(image=False), arms

    def _fingerprint(self, unit: ArmUnit) -> str:
        return episode_fingerprint(
            self._identity,
            unit.key.task,
            trajectory=unit.course.digest,
            action=unit.errand.index,
            seed=self._seed,
        )


def _recorded(unit: ArmUnit, inputs: str, stage: ArmStage, task: ManipulationTask) -> UnitRecord[ArmRecord]:
    try:
        played = stage.play(task, unit.errand)
    except (UnfitEpisodeError, SceneError) as error:
        return unit.excluded(str(error), inputs)
    except InfthorError as error:
        return unit.failed(str(error), inputs)
    return unit.record(inputs, played.record, faults=played.faults, seconds=round(played.seconds, 4))
