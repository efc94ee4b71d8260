"""Episodes of one trajectory, played by baselines without a run: its history is made once."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.manipulation.actors import ArmActor, ArmSituation, Step
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, ArmOutcome, Grasp
from infthor_eval.manipulation.episodes import ArmStage, Played
from infthor_eval.manipulation.history import Errand, ManipulationKind, errands_of, history_of
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.thor.frames import NoFrames
from infthor_eval.thor.simulator import Simulator


def task_of(data: Path, options: ManipulationOptions | None = None, **settings: Any) -> ManipulationTask:
    """A task on these trajectories, with these `dataset_kwargs`."""
    file = TaskFile("a_task", "manipulation", Path("a_task.yaml"), {"dataset_kwargs": settings})
    return ManipulationTask(file, TaskRequest([file], options or ManipulationOptions(), data))


class _Whoever:
    """Drives as whoever is on turn does."""

    def __init__(self) -> None:
        self.actor: ArmActor | None = None

    def begin(self, situation: ArmSituation) -> None:
        assert self.actor is not None
        self.actor.begin(situation)

    def act(self, frame: Any) -> Sequence[Step]:
        assert self.actor is not None
        return self.actor.act(frame)


class Arena:
    """A trajectory whose expert's history is known, and an arm in its scene."""

    def __init__(self, data: Path, expert: Simulator, simulator: Simulator) -> None:
        self._data = data
        (self.trajectory,) = iter_trajectories(data)
        self.errands = {errand.index: errand for errand in errands_of(self.trajectory)}
        self.history = history_of(self.trajectory, expert)
        assert not self.history.refusal
        self.simulator = simulator
        self._whoever = _Whoever()
        self._stages: dict[int, ArmStage] = {}
        self._environment: ArmEnvironment | None = None

    def of(self, kind: ManipulationKind) -> list[Errand]:
        return [errand for errand in self.errands.values() if errand.kind == kind]

    def play(self, actor: ArmActor, index: int, seed: int = 0, **settings: Any) -> Played:
        """An episode."""
        errand = self.errands[index]
        if seed not in self._stages:
            self._stages = {seed: self._stage(seed)}  # one world at a time: they share the simulator
            self._environment = None
        self._whoever.actor = actor
        return self._stages[seed].play(task_of(self._data, **{"kind": str(errand.kind), **settings}), errand)

    def begin(
        self, index: int, grasp: Grasp | None = None, conversion: Conversion | None = None
    ) -> tuple[ArmEnvironment, ArmOutcome]:
        """An episode that is begun."""
        if self._environment is None:
            self._environment, self._stages = ArmEnvironment(self.trajectory, self.simulator), {}
        errand = self.errands[index]
        moment = self.history.moment(errand)
        begun = self._environment.reset(errand, moment, conversion or Conversion(), grasp or Grasp(), NoFrames())
        return self._environment, begun

    def _stage(self, seed: int) -> ArmStage:
        return ArmStage(self.trajectory, self.history, self.simulator, self._whoever, sees=False, seed=seed)
