"""Episodes of one trajectory, run by baselines outside a run: its expert is replayed once."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.manipulation.actors import ArmActor, ArmSituation, Step
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, Grasp
from infthor_eval.manipulation.evaluation import ArmRunner
from infthor_eval.manipulation.expert import replay_expert
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.manipulation.trajectories import ArmEpisode, arm_episodes
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.simulator import Simulator


def task_of(
    data: Path, options: ManipulationOptions | None = None, **settings: Any
) -> ManipulationTask:
    """A task on these trajectories, with these `dataset_kwargs`."""
    file = TaskFile("a_task", "manipulation", Path("a_task.yaml"), {"dataset_kwargs": settings})
    return ManipulationTask(file, TaskRequest([file], options or ManipulationOptions(), data))


class _AnyActor:
    """Drives the arm as the actor that is set."""

    def __init__(self) -> None:
        self.actor: ArmActor | None = None

    def begin(self, situation: ArmSituation) -> None:
        assert self.actor is not None
        self.actor.begin(situation)

    def act(self, seen: Any) -> Sequence[Step]:
        assert self.actor is not None
        return self.actor.act(seen)

    def end(self, *, success: bool) -> None:
        assert self.actor is not None
        self.actor.end(success=success)


class Arena:
    """A trajectory whose true states are known, and an arm in its scene."""

    def __init__(self, data: Path, expert: Simulator, simulator: Simulator) -> None:
        self._data = data
        (self.trajectory,) = iter_trajectories(data)
        self.episodes = {episode.index: episode for episode in arm_episodes(self.trajectory)}
        self.states = replay_expert(self.trajectory, expert)
        assert not self.states.refusal
        self.simulator = simulator
        self._any_actor = _AnyActor()
        self._runners: dict[int, ArmRunner] = {}
        self._environment: ArmEnvironment | None = None

    def of(self, kind: ManipulationKind) -> list[ArmEpisode]:
        return [episode for episode in self.episodes.values() if episode.kind == kind]

    def play(self, actor: ArmActor, index: int, seed: int = 0, **settings: Any) -> ArmRecord:
        """Run an episode."""
        episode = self.episodes[index]
        if seed not in self._runners:
            # One world at a time: they share the simulator.
            self._runners = {seed: self._runner(seed)}
            self._environment = None
        self._any_actor.actor = actor
        task = task_of(self._data, **{"kind": str(episode.kind), **settings})
        return self._runners[seed].run(task, episode).payload

    def begin(
        self, index: int, grasp: Grasp | None = None, conversion: Conversion | None = None
    ) -> tuple[ArmEnvironment, ArmOutcome]:
        """Begin an episode."""
        if self._environment is None:
            self._environment, self._runners = ArmEnvironment(self.trajectory, self.simulator), {}
        episode = self.episodes[index]
        start = self.states.before(episode)
        begun = self._environment.reset(
            episode, start, conversion or Conversion(), grasp or Grasp(), NoFrames()
        )
        return self._environment, begun

    def _runner(self, seed: int) -> ArmRunner:
        return ArmRunner(
            self.trajectory, self.states, self.simulator, self._any_actor, senses=None, seed=seed
        )
