"""The paper's Algorithm 1: a long trajectory of sampled, planned and simulated tasks."""

import random
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from infthor_eval.errors import UsageError
from infthor_eval.formats.trajectory import InitAction, Trajectory
from infthor_eval.generation.draft import Draft, initial_scene
from infthor_eval.generation.final_task import end_types
from infthor_eval.generation.known_failures import KnownFailures
from infthor_eval.generation.rollout import Rollout
from infthor_eval.generation.sampling import TaskPool
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.trace import RolloutError
from infthor_eval.household.affordances import MAX_PLAN_STEPS, goes_into
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.pddl import problem
from infthor_eval.household.planner import plan
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.scene_types import usual_tasks
from infthor_eval.household.scout import reachable_grid
from infthor_eval.household.symbolic import Operator, SymbolicRoom, room_of
from infthor_eval.household.tasks import Task, sub_task
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator

__all__ = ["GeneratedTrajectory", "TaskStatistics", "generate"]

_MAX_EXTENSIONS = 4  # ordinary tasks that are added at most because no final task works


@dataclass
class TaskStatistics:
    """Numbers of tasks tried and accepted by type, and of failures by reason."""

    tried: Counter[str] = field(default_factory=Counter)
    accepted: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, other: "TaskStatistics") -> None:
        """Add the numbers of another trajectory."""
        self.tried += other.tried
        self.accepted += other.accepted
        self.reasons += other.reasons


@dataclass
class GeneratedTrajectory:
    """One trajectory, with the planning problem of each of its tasks as PDDL (the final one last)."""

    trajectory: Trajectory
    statistics: TaskStatistics
    problems: list[str]


def generate(settings: TrajectorySettings, simulator: Simulator) -> GeneratedTrajectory:
    """Generate one trajectory in a simulator, which loads its scene.

    Raises:
        UsageError: no task in the scene can be completed.
        SimulatorError: the simulator fails, or has no such scene.
    """
    factory = _Factory(settings, simulator)
    while not factory.long_enough():
        factory.extend()
    if settings.final_task:
        factory.finish()
    return factory.result()


class _Factory:
    def __init__(self, settings: TrajectorySettings, simulator: Simulator) -> None:
        """Load the scene and place the agent at random."""
        self._settings = settings
        self._name = f"scene {settings.scene}, seed {settings.seed}"
        self._simulator = simulator
        # One stream for all random choices, seeded by a text, which Python hashes alike in every process. Another order
        # of draws would be another trajectory.
        self._rng = random.Random(f"{settings.scene}/{settings.seed}")
        self._pool = TaskPool(usual_tasks(settings.scene).intersection(settings.task_types), self._rng)
        self._known_failures = KnownFailures()
        self._statistics = TaskStatistics()
        self._n_failed = 0
        self._problems: list[str] = []
        self._draft = self._start_draft()

    def _start_draft(self) -> Draft:
        view = self._simulator.reset(self._settings.scene)
        grid = reachable_grid(self._simulator)
        if not grid.cells:
            raise UsageError(f"scene {self._settings.scene}: the agent cannot stand anywhere; choose another scene")
        x, z = grid.position(self._rng.choice(sorted(grid.cells)))
        start = InitAction(x, view.agent.position.y, z, float(self._rng.choice([0, 90, 180, 270])), 30.0)
        scene = initial_scene(self._settings, view, start)
        restore(self._simulator, scene)
        return Draft(self._settings, scene, self._simulator.view)

    def long_enough(self) -> bool:
        draft, settings = self._draft, self._settings
        return draft.length.low >= settings.min_steps and draft.n_tasks >= settings.min_subgoals

    def result(self) -> GeneratedTrajectory:
        statistics = self._statistics
        trajectory = self._draft.trajectory(dict(statistics.tried), dict(statistics.accepted))
        return GeneratedTrajectory(trajectory, statistics, self._problems)

    def extend(self) -> None:
        """Add one task, the first sampled one that can be planned and completed.

        If it leaves an object in the hand, that is put down in a sub-goal after the task.
        """
        if self._add_task(lambda _: True) is None:
            reasons = "; ".join(f"{reason} ({count})" for reason, count in self._statistics.reasons.most_common(3))
            hint = "choose another scene or seed" + (" or a higher --max-fail" if self._out_of_tries else "")
            raise UsageError(
                f"{self._name}: no further task works after {self._draft.length.low} steps and "
                f"{self._n_failed} failed tasks ({reasons or 'no possible task'}); {hint}"
            )

    def finish(self) -> None:
        """Add the final task; if none works, an ordinary task is added before the next try."""
        for _ in range(_MAX_EXTENSIONS):
            directions = list(end_types(self._draft.object_log()))
            self._rng.shuffle(directions)
            for types in directions:
                self._n_failed = 0
                if self._add_task(types.allows_task, is_last=True) is not None:
                    self._draft.make_last_task_final()
                    return
            self._n_failed = 0
            self.extend()
        raise UsageError(f"{self._name}: no final task works; choose another scene or seed")

    @property
    def _out_of_tries(self) -> bool:
        return self._n_failed >= self._settings.max_fail

    def _add_task(self, allowed: Callable[[Task], bool], is_last: bool = False) -> Task | None:
        """Try sampled tasks until one becomes part of the trajectory; returns None if none does."""
        task = self._try_sampled(allowed, is_last)
        if task is None and self._known_failures and not self._out_of_tries:
            self._known_failures.forget()  # they may be outdated, so everything is tried again before giving up
            task = self._try_sampled(allowed, is_last)
        return task

    def _try_sampled(self, allowed: Callable[[Task], bool], is_last: bool) -> Task | None:
        view = self._simulator.view
        types = {item.object_type for item in view.objects.values()}
        room = self._known_failures.room(view)
        possible = set(tasks_of(room, types))
        for task in self._pool.sample(room, types):
            if self._out_of_tries:
                return None
            operators = plan(task, room) if task in possible and allowed(task) else None
            if not operators or all(step.name == "GotoLocation" for step in operators):
                continue  # its goal holds already, or would after walking alone
            failure = self._try(task, room, operators, is_last)
            if failure is None:
                return task
            self._n_failed += 1
            if failure.item is not None:
                self._known_failures.note(view, failure.item, failure.receptacle)
            room = self._known_failures.room(view)
            possible = set(tasks_of(room, types))
        return None

    def _try(self, task: Task, room: SymbolicRoom, operators: Sequence[Operator], is_last: bool) -> RolloutError | None:
        name = f"{task.task_type}{' sliced' if task.sliced else ''}"
        self._statistics.tried[name] += 1
        mark, start = self._simulator.mark(), self._draft.length
        failure = self._execute(operators) or self._check_goal(task)
        end = self._draft.length
        if failure is None and not is_last:
            failure = self._put_down()
        if failure is not None:
            if self._draft.length.low > start.low:
                self._simulator.rewind(mark)
                self._draft.cut(start)
            self._pool.note_failure(task)
            return failure
        self._statistics.accepted[name] += 1
        self._pool.note_use(task)
        self._known_failures.task_done()
        self._problems.append(problem(task, room, f"task-{len(self._problems):03d}"))
        self._draft.add_task(sub_task(task, self._settings.scene), start, end)
        return None

    def _check_goal(self, task: Task) -> RolloutError | None:
        # A completed plan is no proof: objects can slide.
        if goal_holds(task, self._simulator.view):
            return None
        error = RolloutError(f"{task.task_type}: its plan was completed, but its goal does not hold")
        self._statistics.reasons[str(error)] += 1
        return error

    def _put_down(self) -> RolloutError | None:
        """Put a held object into a random receptacle that has room for it."""
        room = room_of(self._simulator.view)
        held = room.start.held
        if held is None:
            return None
        places = sorted(key for key in room.places & room.receptacles if goes_into(room.types[held], room.types[key]))
        self._rng.shuffle(places)
        for place in places:
            if self._execute([Operator("PutObject", held, place)]) is None:
                return None
        error = RolloutError(f"no receptacle has room for {room.types[held]}", held)
        self._statistics.reasons[str(error)] += 1
        return error

    def _execute(self, operators: Sequence[Operator]) -> RolloutError | None:
        """Run operators and add their actions; if one fails, the simulator is rewound and nothing is added."""
        mark = self._simulator.mark()
        rollout = Rollout(self._simulator, self._draft.length.high)
        try:
            rollout.run(list(operators))
            if len(rollout.trace.actions) > MAX_PLAN_STEPS:
                raise RolloutError(f"a plan of more than {MAX_PLAN_STEPS} steps")
        except RolloutError as error:
            self._statistics.reasons[str(error)] += 1
            self._simulator.rewind(mark)
            return error
        self._draft.add(rollout.trace)
        return None
