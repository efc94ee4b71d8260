"""Algorithm 1: a long trajectory out of sampled, planned and simulated tasks."""

import random
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import msgspec

from infthor_eval import __version__
from infthor_eval.errors import UsageError
from infthor_eval.formats.trajectory import (
    HighAction,
    InitAction,
    LowAction,
    ObjectPose,
    Plan,
    Scene,
    SubTask,
    SubTrajectory,
    Trajectory,
)
from infthor_eval.generation.final_task import ends_of
from infthor_eval.generation.recorder import object_log
from infthor_eval.generation.rollout import Rollout, RolloutError
from infthor_eval.generation.sampling import TaskPool
from infthor_eval.generation.setbacks import Setbacks
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.pddl import problem
from infthor_eval.household.planner import plan
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.scout import reachable
from infthor_eval.household.symbolic import Operator, Room, room_of
from infthor_eval.household.tasks import Task, TaskType, sub_task
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator, SimulatorMark

__all__ = ["Made", "Settings", "Statistics", "generate"]

_TRIALS = 60  # tasks tried in a row without success before the scene counts as unsolvable
_LONGER = 4  # how often a trajectory is made longer because no final task works


@dataclass(frozen=True)
class Settings:
    """What to make.

    Attributes:
        scene: name of the scene.
        seed: makes every choice.
        min_steps: low-level actions at least.
        min_subgoals: sub-goals at least.
        final_task: whether a final task follows (see `final_task`).
        task_types: what to draw from.
    """

    scene: str
    seed: int
    min_steps: int
    min_subgoals: int
    final_task: bool = False
    task_types: tuple[TaskType, ...] = tuple(TaskType)

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return f"{self.scene}-seed{self.seed}"

    def document(self) -> dict[str, Any]:
        """The settings as trajectories hold them."""
        return {
            "scene": self.scene,
            "seed": self.seed,
            "min_steps": self.min_steps,
            "min_subgoals": self.min_subgoals,
            "final_task": self.final_task,
            "task_types": [str(task_type) for task_type in self.task_types],
        }


@dataclass
class Statistics:
    """Tasks tried and accepted by type, and why others failed."""

    tried: Counter[str] = field(default_factory=Counter)
    accepted: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, other: "Statistics") -> None:
        """Add the numbers of another trajectory."""
        self.tried += other.tried
        self.accepted += other.accepted
        self.reasons += other.reasons


@dataclass
class Made:
    """One trajectory, with the planning problem of each of its tasks as PDDL (the final one last)."""

    trajectory: Trajectory
    statistics: Statistics
    problems: list[str]


def generate(settings: Settings, simulator: Simulator) -> Made:
    """Make one trajectory.

    Args:
        settings: what to make.
        simulator: where it happens; its scene is replaced.

    Raises:
        UsageError: the scene offers no task that can be carried out.
        SimulatorError: the simulator fails or has no such scene.
    """
    factory = _Factory(settings, simulator)
    factory.begin()
    while not factory.long_enough():
        factory.extend()
    if settings.final_task:
        factory.finish()
    return Made(factory.trajectory(), factory.statistics, factory.problems)


class _Factory:
    """A trajectory in the making."""

    def __init__(self, settings: Settings, simulator: Simulator) -> None:
        self._settings = settings
        self._name = f"scene {settings.scene}, seed {settings.seed}"
        self._simulator = simulator
        self._rng = random.Random(f"{settings.scene}/{settings.seed}")
        self._pool = TaskPool(settings.task_types, self._rng)
        self._setbacks = Setbacks()
        self._low: list[LowAction] = []
        self._high: list[HighAction] = []
        self._log: list[bytes] = []  # encoded: what is kept of every step must not weigh on the garbage collector
        self._sub_tasks: list[SubTask] = []
        self._sub_trajs: list[SubTrajectory] = []
        self._final: SubTask | None = None
        self.statistics = Statistics()
        self.problems: list[str] = []

    def begin(self) -> None:
        """Load the scene and put the agent somewhere."""
        view = self._simulator.reset(self._settings.scene)
        grid = reachable(self._simulator)
        if not grid.cells:
            raise UsageError(f"scene {self._settings.scene}: the agent can stand nowhere; choose another scene")
        x, z = grid.position(self._rng.choice(sorted(grid.cells)))
        start = InitAction(x, view.agent.position.y, z, float(self._rng.choice([0, 90, 180, 270])), 30.0)
        self._scene = Scene(
            floor_plan=self._settings.scene,
            init_action=start,
            scene_num=_number(self._settings.scene),
            object_poses=[
                ObjectPose(item.name, _vector(item.position), _vector(item.rotation))
                for item in view.objects.values()
                if item.pickupable
            ],
            random_seed=self._settings.seed,
        )
        restore(self._simulator, self._scene)
        self._note(0)

    def long_enough(self) -> bool:
        """Whether the asked length is reached."""
        settings = self._settings
        return len(self._low) >= settings.min_steps and len(self._high) >= settings.min_subgoals

    def extend(self) -> None:
        """Add one task: the first sampled one that can be planned and carried out.

        What it leaves in the hand is put down, as a sub-goal of its own behind the task.
        """
        if self._first_that_works(lambda _: True, _TRIALS) is None:
            reasons = "; ".join(f"{reason} ({count})" for reason, count in self.statistics.reasons.most_common(3))
            raise UsageError(
                f"{self._name}: no further task works after {len(self._low)} steps "
                f"({reasons or 'nothing there to do'}); choose another scene or seed"
            )

    def finish(self) -> None:
        """Add the final task; where none works, another ordinary one comes before it."""
        for _ in range(_LONGER):
            task = self._first_that_works(ends_of(self._decoded_log()).allow_task, None, is_last=True)
            if task is not None:
                self._final = self._sub_tasks.pop()
                return
            self.extend()
        raise UsageError(f"{self._name}: no final task works; choose another scene or seed")

    def _first_that_works(
        self, allowed: Callable[[Task], bool], trials: int | None, is_last: bool = False
    ) -> Task | None:
        """Try sampled tasks until one becomes part of the trajectory; None where none does."""
        task = self._try_sampled(allowed, trials, is_last)
        if task is None and self._setbacks:
            self._setbacks.forget()  # before giving up: they may be outdated
            task = self._try_sampled(allowed, trials, is_last)
        return task

    def _try_sampled(self, allowed: Callable[[Task], bool], trials: int | None, is_last: bool) -> Task | None:
        view = self._simulator.view
        types = {item.object_type for item in view.objects.values()}
        room = self._setbacks.room(view)
        possible = set(tasks_of(room, types))
        tried = 0
        for task in self._pool.sample(room, types):
            operators = plan(task, room) if task in possible and allowed(task) else None
            if not operators or all(step.name == "GotoLocation" for step in operators):
                continue  # it holds already, or would by standing elsewhere
            if tried == trials:
                return None
            tried += 1
            failure = self._try(task, room, operators, is_last)
            if failure is None:
                return task
            if failure.item is not None:
                self._setbacks.note(view, failure.item, failure.receptacle)
            room = self._setbacks.room(view)
            possible = set(tasks_of(room, types))
        return None

    def trajectory(self) -> Trajectory:
        """What was made so far."""
        settings = self._settings
        return Trajectory(
            scene=self._scene,
            plan=Plan(self._low, self._high),
            traj_id=settings.traj_id,
            sub_tasks=self._sub_tasks,
            sub_trajs=self._sub_trajs,
            long_horizon_task=self._final,
            object_log=self._decoded_log(),
            images=[_image(low) for low in self._low],
            gen_info={
                "generator": f"infthor-eval {__version__}",
                "ai2thor": version("ai2thor"),
                "settings": settings.document(),
                "tried": dict(self.statistics.tried),
                "accepted": dict(self.statistics.accepted),
            },
        )

    def _try(self, task: Task, room: Room, operators: Sequence[Operator], is_last: bool) -> RolloutError | None:
        name = f"{task.task_type}{' sliced' if task.sliced else ''}"
        self.statistics.tried[name] += 1
        before, low, high = self._simulator.mark(), len(self._low), len(self._high)
        failure = self._carry_out(operators)
        ends = len(self._low), len(self._high)
        if failure is None and not is_last:
            failure = self._put_down()
        if failure is not None:
            self._go_back(before, low, high)
            self._pool.failed(task)
            return failure
        self.statistics.accepted[name] += 1
        self._pool.used(task)
        self._setbacks.task_done()
        self.problems.append(problem(task, room, f"task-{len(self.problems):03d}"))
        described = sub_task(task, self._settings.scene)
        self._sub_trajs.append(
            SubTrajectory(len(self._sub_tasks), (high, ends[1]), (low, ends[0]), described.task_desc)
        )
        self._sub_tasks.append(described)
        return None

    def _put_down(self) -> RolloutError | None:
        """Put a held object down, wherever there is room for it."""
        room = room_of(self._simulator.view)
        held = room.start.held
        if held is None:
            return None
        places = [
            place for place in sorted(room.places & room.receptacles) if goes_into(room.types[held], room.types[place])
        ]
        self._rng.shuffle(places)
        for place in places:
            if self._carry_out([Operator("PutObject", held, place)]) is None:
                return None
        error = RolloutError(f"no place takes {room.types[held]}", held)
        self.statistics.reasons[str(error)] += 1
        return error

    def _go_back(self, before: SimulatorMark, low: int, high: int) -> None:
        """Take back what was added since a mark at which there were so many actions and sub-goals."""
        if len(self._low) > low:
            self._simulator.rewind(before)
            del self._low[low:], self._high[high:], self._log[low + 1 :]

    def _carry_out(self, operators: Sequence[Operator]) -> RolloutError | None:
        """Run operators; where that fails, the simulator is as it was before and nothing is added."""
        mark = self._simulator.mark()
        rollout = Rollout(self._simulator, len(self._high))
        try:
            rollout.run(list(operators))
        except RolloutError as error:
            self.statistics.reasons[str(error)] += 1
            self._simulator.rewind(mark)
            return error
        for acted in rollout.acted:
            acted.low.low_idx = len(self._low)
            self._low.append(acted.low)
            self._note(len(self._low), acted.view)
        self._high += rollout.high
        return None

    def _note(self, step: int, view: Any = None) -> None:
        entry = object_log(view or self._simulator.view)
        self._log.append(msgspec.json.encode({"step": step, **msgspec.to_builtins(entry)}))

    def _decoded_log(self) -> list[dict[str, Any]]:
        return [msgspec.json.decode(entry) for entry in self._log]


def _number(scene: str) -> int:
    digits = "".join(letter for letter in scene if letter.isdigit())
    return int(digits) if digits else 0


def _image(low: LowAction) -> dict[str, Any]:
    """The frame after an action, by the name that a replay gives it; frame 0 is before the first action."""
    assert low.low_idx is not None
    return {"high_idx": low.high_idx, "low_idx": low.low_idx, "image_name": f"{low.low_idx + 1:09d}.png"}


def _vector(value: Any) -> dict[str, float]:
    return {"x": value.x, "y": value.y, "z": value.z}
