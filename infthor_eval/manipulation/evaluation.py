"""Manipulation set up for a run, and the run of its episodes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import msgspec

from infthor_eval.episodes.evaluation import BoundEpisodes, EpisodeEvaluation, EpisodeUnit
from infthor_eval.episodes.retries import with_retries
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.errors import SceneError
from infthor_eval.manipulation.actors import ArmActor, ArmBaseline, PolicyActor
from infthor_eval.manipulation.config import ManipulationConfig
from infthor_eval.manipulation.expert import replay_expert
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.runner import ArmRunner, arm_record
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.manipulation.trajectories import ArmEpisode, ArmTrajectory
from infthor_eval.runs import Group, RunHeader, Session, TaskRequest, UnitDoc, UnitKey, UnitRecord
from model_adapters import Policy, Subject

ArmUnit = EpisodeUnit[ArmRecord, ArmTrajectory, ArmEpisode]
_Camera = tuple[int, float]  # see `ArmTaskSettings.camera`


class ManipulationEvaluation(EpisodeEvaluation[ManipulationOptions, ManipulationTask, ArmUnit]):
    """Manipulation set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[ManipulationOptions]) -> None:
        super().__init__(request, ManipulationTask)

    @property
    def units(self) -> list[ArmUnit]:
        """See `EpisodeEvaluation`."""
        return [
            ArmUnit.of(name, trajectory, episode, arm_record(task, episode))
            for name, task in self.tasks.items()
            for trajectory, episode in task.episodes
        ]

    @property
    def config(self) -> ManipulationConfig:
        """See `EpisodeEvaluation`."""
        return ManipulationConfig(**self._shared_config)

    def bind(self, subject: Subject) -> "BoundManipulation":
        """See `runs.Evaluation.bind`; TypeError for neither a policy nor an arm's baseline."""
        if isinstance(subject, ArmBaseline):
            create_actor: Callable[[], ArmActor] = subject.arm_actor
        elif isinstance(subject, Policy):
            create_actor = partial(PolicyActor, subject, blank=self.options.frames == "blank")
        else:
            raise TypeError(f"{subject} is neither a policy nor a baseline of manipulation")
        return BoundManipulation(self, create_actor, sees=isinstance(subject, Policy))

    def to_doc(
        self, header: RunHeader[ManipulationConfig], record: UnitRecord[ArmRecord]
    ) -> UnitDoc:
        """See `infthor_eval.runs.Evaluation.to_doc`."""
        payload = record.payload
        settings = self.tasks[record.task].settings
        return UnitDoc(
            number=self._numbers[record.key],
            doc={"traj_id": record.cluster, "action": payload.index, "kind": payload.kind},
            target=payload.instruction,
            prompt=payload.instruction,
            settings={"max_steps": settings.max_steps},
            reply=payload.ended,
        )


class BoundManipulation(BoundEpisodes[ArmUnit, ArmRecord]):
    """Manipulation for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(
        self,
        evaluation: ManipulationEvaluation,
        create_actor: Callable[[], ArmActor],
        *,
        sees: bool,
    ) -> None:
        """Take the work, what creates a trajectory's actor, and whether actors look at frames."""
        self._tasks = evaluation.tasks
        self._create_actor = create_actor
        self._sees = sees
        self._experts = evaluation.simulators(image=False, instances=False)
        by_camera = {
            task.settings.camera: task.settings.camera_options for task in self._tasks.values()
        }
        self._arms = {
            camera: evaluation.simulators(image=sees, instances=False, agentMode="arm", **options)
            for camera, options in by_camera.items()
        }
        # The episodes of all tasks by trajectory, in time order: one replay of its expert serves
        # them all.
        by_trajectory: dict[str, list[ArmUnit]] = {unit.cluster: [] for unit in evaluation.units}
        for unit in sorted(evaluation.units, key=lambda unit: (unit.episode.index, unit.key)):
            by_trajectory[unit.cluster].append(unit)
        super().__init__(
            evaluation,
            evaluation.workload(by_trajectory.values()),
            [self._experts, *self._arms.values()],
        )

    def run(
        self, group: Group[ArmUnit], session: Session[ArmRecord]
    ) -> Iterator[UnitRecord[ArmRecord]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        fingerprints, known = self._find_records(group, session)
        yield from (record for record in known.values() if record is not None)
        by_camera: dict[_Camera, list[ArmUnit]] = {}
        for unit in group.units:
            if known[unit.key] is None:
                by_camera.setdefault(self._tasks[unit.key.task].settings.camera, []).append(unit)
        for camera, units in by_camera.items():
            yield from self._run_episodes(units, fingerprints, self._arms[camera], session)

    def _run_episodes(
        self,
        units: Sequence[ArmUnit],
        fingerprints: Mapping[UnitKey, str],
        arms: Simulators,
        session: Session[ArmRecord],
    ) -> Iterator[UnitRecord[ArmRecord]]:
        trajectory = units[0].trajectory.data
        try:
            with self._experts.one() as expert:
                states, faults = with_retries(
                    expert, lambda: replay_expert(trajectory, expert), lambda: None
                )
        except SceneError as error:
            yield from (unit.record_exclusion(str(error), fingerprints[unit.key]) for unit in units)
            return
        with arms.one() as simulator:
            runner = ArmRunner(
                trajectory, states, simulator, self._create_actor(), sees=self._sees, seed=self.seed
            )
            for unit in units:
                run = partial(runner.run, self._tasks[unit.key.task], unit.episode)
                record = runner.record(unit, fingerprints[unit.key], run, session)
                yield msgspec.structs.replace(record, faults=(*faults, *record.faults))
                faults = ()  # those of the expert's simulator are recorded once
