"""Plans set up for a run: which plans of which trajectories, and the doing of it, a trajectory at a time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

import msgspec

from infthor_eval.episodes.simulators import Simulators
from infthor_eval.errors import InfthorError, SceneError, UsageError
from infthor_eval.formats.floor_plans import floor_plans_digest
from infthor_eval.plans.cast import Cast, cast_of
from infthor_eval.plans.episodes import Episode, described, episode
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.plan import Plan, UnfitPlanError
from infthor_eval.plans.records import NOT_ATTEMPTED, PlanRecord
from infthor_eval.plans.task import PlansTask
from infthor_eval.plans.trajectories import Course
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
from model_adapters import Subject

__all__ = ["BoundPlans", "PlanUnit", "PlansEvaluation"]


@dataclass(frozen=True)
class PlanUnit(Unit[PlanRecord]):
    """A unit that is a plan.

    Attributes:
        course: its trajectory.
        plan: which plan of it.
    """

    course: Course
    plan: Plan

    @classmethod
    def of(cls, task: str, course: Course, plan: Plan) -> "PlanUnit":
        """The unit of a task's plan."""
        key = UnitKey(task, f"{course.traj_id}/{plan.index:04d}")
        return cls(key, course.traj_id, described(course, plan), course, plan)


class PlansEvaluation:
    """Plans set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[PlansOptions]) -> None:
        """Read the tasks and their trajectories.

        Raises:
            UsageError: a task without its trajectories, or with no plan that it is about.
            DataError: a task file or all of its trajectories are not what they should be.
        """
        self._seed = request.seed
        self._options = request.options
        self._tasks = {file.name: PlansTask(file, request) for file in request.tasks}
        for task in self._tasks.values():
            if not task.limited:
                raise UsageError(f"{task.name}: no trajectory there has a final task; make some with --test-set")
        self._scenes = Path(self._options.scenes) if self._options.scenes is not None else None
        self._floor_plans = floor_plans_digest(self._scenes) if self._scenes is not None else None
        every = {course.traj_id: course for task in self._tasks.values() for course in task.courses.found}
        self._trajectories = [course.trajectory for course in every.values()]

    def outline(self) -> list[tuple[str, list[str]]]:
        """The trajectories that are gone through, by name, each with the texts of its plans."""
        return [
            (course.traj_id, [plan.text for plan in task.plans(course)])
            for task in self._tasks.values()
            for course in task.limited
        ]

    def bind(self, subject: Subject) -> "BoundPlans":
        """See `infthor_eval.runs.Evaluation.bind`."""
        cast = cast_of(subject, self._trajectories)
        workload = Workload(
            groups=[
                Group(
                    [PlanUnit.of(task.name, course, plan) for plan in task.plans(course)],
                    frames=len(course.trajectory.plan.low_actions),
                )
                for task in self._tasks.values()
                for course in task.limited
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
                "constrained": self._options.constrained,
                "frames": self._options.frames,
            },
        )
        return BoundPlans(workload, self._tasks, cast, self._simulators(cast.sees), self._seed)

    def _simulators(self, seen: bool) -> Simulators:
        """The simulators of episodes; frames that nobody looks at are not rendered."""
        in_words = seen and any(task.memory.needs_state for task in self._tasks.values())
        return Simulators(self._options.simulator, self._scenes, self._trajectories, image=seen, instances=in_words)


class BoundPlans:
    """Plans for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(
        self,
        workload: Workload[PlanUnit],
        tasks: Mapping[str, PlansTask],
        cast: Cast,
        simulators: Simulators,
        seed: int,
    ) -> None:
        """Take up what was prepared for the subject.

        Args:
            workload: all the work.
            tasks: the tasks by name.
            cast: gives the subject's actors.
            simulators: the simulators of its episodes; closed with this.
            seed: seed of the run.
        """
        self.workload = workload
        self._tasks, self._cast, self._simulators, self._seed = tasks, cast, simulators, seed

    def run(self, group: Group[PlanUnit], session: Session[PlanRecord]) -> Iterator[UnitRecord[PlanRecord]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        prints = {unit.key: self._fingerprint(unit) for unit in group.units}
        earlier = {unit.key: session.find_record(unit, prints[unit.key]) for unit in group.units}
        if all(record is not None for record in earlier.values()):
            yield from (record for record in earlier.values() if record is not None)
            return
        first = group.units[0]
        task = self._tasks[first.key.task]
        with episode(task, first.course, self._cast, self._simulators, self._seed) as stage:
            over = False
            for unit in group.units:
                record = earlier[unit.key]
                if record is None or (record.payload.ended == NOT_ATTEMPTED and not over):
                    record = _recorded(unit, prints[unit.key], stage, over)
                yield record
                failed = record.excluded is None and not record.payload.done
                over = over or (failed and task.settings.after_failure == "stop")

    def to_sample(self, record: UnitRecord[PlanRecord]) -> UnitSample:
        """See `infthor_eval.runs.BoundEvaluation.to_sample`."""
        payload, task = record.payload, self._tasks[record.task]
        return UnitSample(
            number=self._numbers[record.key],
            doc={"traj_id": record.cluster, "plan": payload.index, "kind": payload.kind, "goal": payload.goal},
            target=payload.plan,
            prompt=f"{payload.goal}\n{payload.plan}",
            settings=task.file.settings["generation_kwargs"],
            reply=", ".join(step.action or (step.reply or "") for step in payload.steps),
        )

    def close(self) -> None:
        """See `infthor_eval.runs.BoundEvaluation.close`."""
        self._simulators.close()

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Positions of the plans in their tasks."""
        units = [unit for group in self.workload.groups for unit in group.units]  # task by task
        by_task = groupby(units, key=lambda unit: unit.key.task)
        return {unit.key: number for _, same in by_task for number, unit in enumerate(same)}

    def _fingerprint(self, unit: PlanUnit) -> str:
        return episode_fingerprint(
            self.workload.config,
            unit.key.task,
            trajectory=unit.course.digest,
            plan=unit.plan.index,
            seed=self._seed,
        )


def _recorded(unit: PlanUnit, inputs: str, stage: Episode, over: bool) -> UnitRecord[PlanRecord]:
    """The record of a plan that is played now, or passed over where the episode is over."""
    try:
        if over:
            stage.pass_over(unit.plan)
            return unit.record(inputs, msgspec.structs.replace(unit.payload, ended=NOT_ATTEMPTED))
        played = stage.play(unit.plan)
    except (UnfitPlanError, SceneError) as error:
        return unit.excluded(str(error), inputs)
    except InfthorError as error:
        begun = stage.begun if stage.begun is not None and stage.begun.index == unit.plan.index else unit.payload
        return replace(unit, payload=begun).failed(str(error), inputs, usage=stage.usage)
    return unit.record(
        inputs,
        played.record,
        faults=played.faults,
        seconds=round(played.seconds, 4),
        tokens=played.tokens,
        usage=played.usage,
    )
