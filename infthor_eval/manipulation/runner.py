"""Running an arm's episodes of one trajectory."""

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec

from infthor_eval.episodes.running import EpisodeResult, EpisodeRunner
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.manipulation.actors import ArmActor, ArmSituation, Step
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, arm_of
from infthor_eval.manipulation.expert import ExpertStates
from infthor_eval.manipulation.kinds import PutCriterion
from infthor_eval.manipulation.records import ArmEnded, ArmRecord, ArmStep
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.manipulation.trajectories import ArmEpisode
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.frames import FrameFolder, FrameKeeper, NoFrames
from infthor_eval.thor.simulator import Simulator
from model_adapters import ArmDelta

_DIGITS = 6  # of metres and rewards; more would be rounding noise


def arm_record(task: ManipulationTask, episode: ArmEpisode) -> ArmRecord:
    """Return the record of an episode before anybody acts."""
    return ArmRecord(
        index=episode.index,
        kind=str(episode.kind),
        instruction=task.instruction(episode),
        max_reward=task.settings.reward,
        put_criterion=PutCriterion(task.settings.put_criterion),
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
        sees: bool,
        seed: int,
    ) -> None:
        """Take a trajectory, the states that its episodes begin in, and a simulator with an arm."""
        super().__init__(simulator, lambda: ArmEnvironment(trajectory, simulator))
        self._states = states
        self._actor = actor
        self._sees = sees
        self._seed = f"{seed}/{trajectory.traj_id}"

    def run(self, task: ManipulationTask, episode: ArmEpisode) -> EpisodeResult[ArmRecord]:
        """Run an episode.

        Raises:
            InfeasibleError: this simulator refuses an action of the expert before it, or cannot
                restore its start.
            DataError: a frame cannot be written or read.
            ModelError: the policy fails.
            SimulatorError: the simulator fails.
        """
        start = self._states.before(episode)
        with self._frames() as frames:
            environment = self.environment
            outcome = environment.reset(
                episode, start, task.settings.conversion, task.settings.grasp, frames
            )
            self.begun = msgspec.structs.replace(
                arm_record(task, episode),
                object_id=start.object_id,
                receptacle_id=start.receptacle_id,
                starts_inside=environment.starts_inside,
                start_distance=round(outcome.distance, _DIGITS),
            )
            seed = f"{self._seed}/{task.name}/{episode.index}"
            self._actor.begin(
                ArmSituation(environment, self.begun.instruction, seed, task.settings.max_step)
            )
            steps, ended = self._act(environment, outcome, task.settings.max_steps)
        closest = min([outcome.distance, *(step.distance for step in steps)])
        record = msgspec.structs.replace(
            self.begun, steps=tuple(steps), closest=round(closest, _DIGITS), ended=str(ended)
        )
        reward = task.settings.reward if record.done else 0.0
        return EpisodeResult(msgspec.structs.replace(record, reward=reward))

    def _act(
        self, environment: ArmEnvironment, outcome: ArmOutcome, max_steps: int
    ) -> tuple[list[ArmStep], ArmEnded]:
        """Let the actor act until the episode is over, chunk by chunk of steps."""
        steps: list[ArmStep] = []
        chunk: list[Step] = []
        step: Step = ()
        while outcome.ended is None:
            if len(steps) >= max_steps:
                if isinstance(step, ArmDelta) and environment.closes_at_the_end:
                    closing = environment.closing_calls()
                    outcome = environment.step(closing)
                    steps.append(_arm_step(closing, outcome))
                return steps, outcome.ended or ArmEnded.LIMIT
            chunk = chunk or list(self._actor.act(outcome.frame))
            if not chunk:
                return steps, ArmEnded.GAVE_UP
            step = chunk.pop(0)
            outcome = environment.step(step)
            steps.append(_arm_step(step, outcome))
        return steps, outcome.ended

    @contextmanager
    def _frames(self) -> Iterator[FrameKeeper]:
        """Keep frames for the length of an episode."""
        if not self._sees:
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
