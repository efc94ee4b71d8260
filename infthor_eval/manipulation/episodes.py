"""Leading an arm through one episode."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import msgspec

from infthor_eval.episodes.retries import with_retries
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.manipulation.actors import ArmActor, ArmSituation, Step
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome
from infthor_eval.manipulation.geometry import point_of
from infthor_eval.manipulation.history import Errand, History
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.thor.frames import FrameFolder, FrameKeeper, NoFrames
from infthor_eval.thor.simulator import Simulator
from model_adapters import ArmDelta

__all__ = ["ArmStage", "Played", "described"]

_DIGITS = 6  # of metres and rewards: what is beyond is rounding


@dataclass(frozen=True)
class Played:
    """What came of an episode.

    Attributes:
        record: for the journal.
        seconds: time that it took.
        faults: of the simulator, survived on the way.
    """

    record: ArmRecord
    seconds: float
    faults: tuple[str, ...] = ()


def described(task: ManipulationTask, errand: Errand) -> ArmRecord:
    """What is known of an episode before anybody acts."""
    return ArmRecord(
        index=errand.index,
        kind=str(errand.kind),
        instruction=task.instruction(errand),
        max_reward=task.settings.reward,
    )


class ArmStage:
    """One trajectory with an arm in it. The scene is restored when the first episode is played."""

    def __init__(
        self, trajectory: Trajectory, history: History, simulator: Simulator, actor: ArmActor, *, sees: bool, seed: int
    ) -> None:
        self._trajectory, self._history, self._simulator, self._actor = trajectory, history, simulator, actor
        self._sees, self._seed = sees, f"{seed}/{trajectory.traj_id}"
        self._environment: ArmEnvironment | None = None

    def play(self, task: ManipulationTask, errand: Errand) -> Played:
        """One episode. Where the simulator fails for good it is begun anew, in a fresh one.

        Raises:
            UnfitEpisodeError: this simulator refuses an action of the expert before it, or cannot be brought there.
            DataError: a frame cannot be written or read.
            ModelError: the policy fails.
            SimulatorError: the simulator failed every time.
        """
        began = time.perf_counter()
        record, faults = with_retries(self._simulator, lambda: self._played(task, errand), self._begin_anew)
        return Played(record, time.perf_counter() - began, faults)

    def _begin_anew(self) -> None:
        self._environment = None

    def _played(self, task: ManipulationTask, errand: Errand) -> ArmRecord:
        moment = self._history.moment(errand)
        with self._frames() as frames:
            if self._environment is None:
                self._environment = ArmEnvironment(self._trajectory, self._simulator)
            environment = self._environment
            begun = environment.reset(errand, moment, task.conversion, task.grasp, frames)
            known = described(task, errand)
            record = msgspec.structs.replace(
                known,
                object_id=moment.object_id,
                receptacle_id=moment.receptacle_id,
                starts_inside=environment.inside,
                start_distance=round(begun.distance, _DIGITS),
            )
            seed = f"{self._seed}/{task.name}/{errand.index}"
            self._actor.begin(ArmSituation(environment, record.instruction, seed, task.settings.max_step))
            return self._led(record, begun, task.settings.max_steps, task.settings.reward)

    def _led(self, record: ArmRecord, begun: ArmOutcome, max_steps: int, reward: float) -> ArmRecord:
        assert self._environment is not None
        steps: list[ArmStep] = []
        outcome = begun
        waiting: list[Step] = []
        ended: ArmEnded | None = None
        while ended is None:
            waiting = waiting or list(self._actor.act(outcome.frame))
            if not waiting:
                ended = ArmEnded.GAVE_UP
                break
            step = waiting.pop(0)
            outcome = self._environment.step(step)
            steps.append(_step(step, outcome))
            ended = outcome.ended or (ArmEnded.LIMIT if len(steps) >= max_steps else None)
        closest = min([begun.distance, *(step.distance for step in steps)])
        return msgspec.structs.replace(
            record,
            steps=tuple(steps),
            closest=round(closest, _DIGITS),
            reward=reward if ended == ArmEnded.DONE else 0.0,
            ended=str(ended),
        )

    @contextmanager
    def _frames(self) -> Iterator[FrameKeeper]:
        """Where frames are kept for the length of an episode."""
        if not self._sees:
            yield NoFrames()
            return
        with ScratchFolder() as folder:
            yield FrameFolder(folder)


def _step(step: Step, outcome: ArmOutcome) -> ArmStep:
    arm = outcome.view.arm
    assert arm is not None  # the environment sees to that
    x, y, z = (round(value, _DIGITS) for value in point_of(arm.sphere_center))
    delta = None
    if isinstance(step, ArmDelta):
        delta = tuple(round(number, _DIGITS) for number in (*step.translation, *step.rotation, step.gripper))
    return ArmStep(
        delta=delta,
        calls=outcome.calls,
        hand=(x, y, z),
        distance=round(outcome.distance, _DIGITS),
        refusals=outcome.refusals,
    )
