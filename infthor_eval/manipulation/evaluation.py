"""Manipulation set up for a run, and the run of each trajectory's episodes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial

import msgspec

from infthor_eval.episodes.evaluation import BoundEpisodes, EpisodeEvaluation, EpisodeUnit
from infthor_eval.episodes.retries import with_retries
from infthor_eval.episodes.running import EpisodeResult, EpisodeRunner
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.errors import SceneError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.grouping import grouped
from infthor_eval.manipulation.actors import ArmActor, ArmBaseline, ArmSituation, PolicyActor
from infthor_eval.manipulation.config import ManipulationConfig
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, Step, arm_of
from infthor_eval.manipulation.expert import ExpertStates, replay_expert
from infthor_eval.manipulation.kinds import PutCriterion, Senses
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.manipulation.trajectories import ArmEpisode, ArmTrajectory
from infthor_eval.runs import Group, RunHeader, Session, TaskRequest, UnitDoc, UnitKey, UnitRecord
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.frames import FrameFolder, FrameKeeper, NoFrames
from infthor_eval.thor.simulator import Simulator
from model_adapters import ArmDelta, Episode, FramePolicy, Policy, Subject

ArmUnit = EpisodeUnit[ArmRecord, ArmTrajectory, ArmEpisode]
Camera = tuple[int, float]  # see `ArmTaskSettings.camera`
_DIGITS = 6  # of metres and rewards; more would be rounding noise


class ManipulationEvaluation(EpisodeEvaluation[ManipulationOptions, ManipulationTask, ArmUnit]):
    """Manipulation set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[ManipulationOptions]) -> None:
        super().__init__(request, ManipulationTask)

    @property
    def units(self) -> list[ArmUnit]:
        """See `EpisodeEvaluation`."""
        return [
            ArmUnit.of(name, trajectory, episode, _arm_record(task, episode))
            for name, task in self.tasks.items()
            for trajectory, episode in task.episodes
        ]

    @property
    def config(self) -> ManipulationConfig:
        """See `EpisodeEvaluation`."""
        return ManipulationConfig(**self._shared_config)

    def bind(self, subject: Subject) -> "BoundManipulation":
        """See `runs.Evaluation.bind`; TypeError for neither a policy nor an arm's baseline."""
        if self.options.senses != Senses() and not isinstance(subject, Policy):
            raise UsageError(
                f"{subject.name} takes no more than a frame and an instruction; leave --cameras "
                "and --state out"
            )
        if isinstance(subject, ArmBaseline):
            create_actor: Callable[[], ArmActor] = subject.arm_actor
        elif isinstance(subject, Policy | FramePolicy):
            create_actor = partial(PolicyActor, subject, blank=self.options.frames == "blank")
        else:
            raise TypeError(f"{subject} is neither a policy nor a baseline of manipulation")
        return BoundManipulation(self, create_actor, subject)

    def arm_simulators(self, *, image: bool) -> dict[Camera, Simulators]:
        """Return simulators with an arm for each camera of the tasks; `image` if they draw."""
        by_camera = {
            task.settings.camera: task.settings.camera_options for task in self.tasks.values()
        }
        return {
            camera: self.simulators(image=image, instances=False, agentMode="arm", **options)
            for camera, options in by_camera.items()
        }

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
        subject: Subject,
    ) -> None:
        """Take the work, what creates a trajectory's actor, and the policy or baseline."""
        self._tasks = evaluation.tasks
        self._create_actor = create_actor
        self._sees = not isinstance(subject, ArmBaseline)
        self._senses = evaluation.options.senses
        # A policy of one frame is shown no history, so that none is drawn.
        remembers = isinstance(subject, Policy)
        self._tells_history = remembers and any(it.tells_history for it in self._tasks.values())
        self._experts = evaluation.simulators(image=self._tells_history, instances=False)
        self._arms = evaluation.arm_simulators(image=self._sees)
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
        asked = (unit for unit in group.units if known[unit.key] is None)
        by_camera = grouped((self._tasks[it.key.task].settings.camera, it) for it in asked)
        for camera, units in by_camera.items():
            yield from self._run_episodes(units, fingerprints, self._arms[camera], session)

    def _run_episodes(
        self,
        units: Sequence[ArmUnit],
        fingerprints: Mapping[UnitKey, str],
        arms: Simulators,
        session: Session[ArmRecord],
    ) -> Iterator[UnitRecord[ArmRecord]]:
        with _keep_frames(self._tells_history) as seen:
            history: list[FrameRef | None] = []
            trajectory = units[0].trajectory.data

            def replay(expert: Simulator) -> ExpertStates:
                history.clear()
                see = lambda view: history.append(seen.keep(view))  # noqa: E731
                return replay_expert(trajectory, expert, see)

            try:
                with self._experts.one() as expert:
                    states, faults = with_retries(expert, lambda: replay(expert), lambda: None)
            except SceneError as error:
                yield from (
                    unit.record_exclusion(str(error), fingerprints[unit.key]) for unit in units
                )
                return
            with arms.one() as simulator:
                runner = ArmRunner(
                    trajectory,
                    states,
                    simulator,
                    self._create_actor(),
                    senses=self._senses if self._sees else None,
                    seed=self.seed,
                    history=tuple(frame for frame in history if frame is not None),
                )
                for unit in units:
                    run = partial(runner.run, self._tasks[unit.key.task], unit.episode)
                    record = runner.record(unit, fingerprints[unit.key], run, session)
                    yield msgspec.structs.replace(record, faults=(*faults, *record.faults))
                    faults = ()  # those of the expert's simulator are recorded once


def _arm_record(task: ManipulationTask, episode: ArmEpisode) -> ArmRecord:
    """Return the record of an episode before anybody acts."""
    return ArmRecord(
        index=episode.index,
        kind=str(episode.kind),
        instruction=task.instruction(episode),
        max_reward=task.settings.reward,
        put_criterion=PutCriterion(task.settings.put_criterion),
        pair="" if episode.choice is None else episode.choice.pair,
        base="" if episode.choice is None else episode.choice.base,
    )


class ArmRunner(EpisodeRunner[ArmEnvironment, ArmRecord]):
    """A trajectory with an arm in it."""

    def __init__(
        self,
        trajectory: Trajectory,
        states: ExpertStates,
        simulator: Simulator,
        actor: ArmActor,
        *,
        senses: Senses | None,
        seed: int,
        history: tuple[FrameRef, ...] = (),
    ) -> None:
        """Take a trajectory, the states that its episodes begin in, and a simulator with an arm; no
        senses if the actor looks at nothing; and its frames, where episodes are about them."""
        super().__init__(simulator, lambda: ArmEnvironment(trajectory, simulator, senses))
        self._states = states
        self._actor = actor
        self._history = history
        self._sees = senses is not None
        self._seed = f"{seed}/{trajectory.traj_id}"

    def run(self, task: ManipulationTask, episode: ArmEpisode) -> EpisodeResult[ArmRecord]:
        """Run an episode."""
        start = self._states.before(episode)
        with _keep_frames(self._sees) as frames:
            environment = self.environment
            outcome = environment.reset(
                episode, start, task.settings.conversion, task.settings.grasp, frames
            )
            self.begun = msgspec.structs.replace(
                _arm_record(task, episode),
                object_id=start.object_id,
                receptacle_id=start.receptacle_id,
                starts_inside=environment.starts_inside,
                start_distance=round(outcome.distance, _DIGITS),
            )
            seed = f"{self._seed}/{task.name}/{episode.index}"
            history = self._history if task.tells_history else ()
            told = Episode(seed, self.begun.instruction, task.settings.max_steps, history)
            self._actor.begin(ArmSituation(environment, told, seed, task.settings.max_step))
            if isinstance(self._actor, PolicyActor) and outcome.observation is not None:
                self.request = self._actor.request(outcome.observation)
            steps, ended = self._act(environment, outcome, task.settings.max_steps)
            closest = min([outcome.distance, *(step.distance for step in steps)])
            record = msgspec.structs.replace(
                self.begun,
                steps=tuple(steps),
                closest=round(closest, _DIGITS),
                ended=str(ended),
                nears_other=environment.nears_other(),
            )
            self._actor.end(success=None if task.tells_history else record.done)
        reward = task.settings.reward if record.done else 0.0
        return EpisodeResult(msgspec.structs.replace(record, reward=reward))

    def _act(
        self, environment: ArmEnvironment, begun: ArmOutcome, max_steps: int
    ) -> tuple[list[ArmStep], ArmEnded]:
        """Let the actor act until the episode is over, chunk by chunk of steps."""
        steps: list[ArmStep] = []
        chunk: list[Step] = []
        outcome = begun
        while outcome.ended is None:
            chunk = chunk or list(self._actor.act(outcome.observation))
            if not chunk:
                return steps, ArmEnded.GAVE_UP
            for step, outcome in environment.step_within(chunk.pop(0), max_steps):
                steps.append(_arm_step(step, outcome))
        return steps, outcome.ended


@contextmanager
def _keep_frames(are_kept: bool) -> Iterator[FrameKeeper]:
    """Keep frames within the context, if at all."""
    if not are_kept:
        yield NoFrames()
        return
    with ScratchFolder() as folder:
        yield FrameFolder(folder)


def _arm_step(step: Step, outcome: ArmOutcome) -> ArmStep:
    hand = arm_of(outcome.view).sphere_center
    delta = None
    if isinstance(step, ArmDelta):
        delta = tuple(
            round(float(number), _DIGITS)
            for number in (*step.translation, *step.rotation, step.gripper)
        )
    return ArmStep(
        delta=delta,
        calls=outcome.calls,
        hand=(round(hand.x, _DIGITS), round(hand.y, _DIGITS), round(hand.z, _DIGITS)),
        distance=round(outcome.distance, _DIGITS),
        refusals=outcome.refusals,
    )
