"""The paper's Algorithm 1: a long trajectory of sampled, planned and simulated tasks.

Failures are counted as the published generator of July 2026 does. Those of tasks of which something
was executed count in a row; when there are too many, the last sub-goals are dropped: 1, then 2, 4,
... until a task is accepted. Those of tasks of which nothing was executed add up, and end the
attempt. (They begin anew with the pool of tasks, which ends an attempt there.) A put-down and its
task are dropped together, so that no task begins with a full hand: two sub-goals where the
published generator drops the put-down alone.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from msgspec.structs import astuple

from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import ApiAction, InitAction, SubTask, Trajectory
from infthor_eval.generation.draft import Draft, initial_scene
from infthor_eval.generation.final_task import end_types
from infthor_eval.generation.look_around import look_around
from infthor_eval.generation.rollout import Rollout
from infthor_eval.generation.sampling import TaskPool
from infthor_eval.generation.settings import MEMORY, TrajectorySettings
from infthor_eval.generation.simulator_jobs import JobProgress, OnProgress, ignore_progress
from infthor_eval.generation.statistics import AttemptStatistics, RollBack
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.generation.walking import Walker
from infthor_eval.household.affordances import MAX_PLAN_STEPS
from infthor_eval.household.containment import direct_parent
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.pddl import problem
from infthor_eval.household.planner import plan
from infthor_eval.household.possible_tasks import open_tasks
from infthor_eval.household.scout import reachable_grid
from infthor_eval.household.symbolic import Operator, SymbolicRoom, room_of
from infthor_eval.household.tasks import Task, TaskType, sub_task
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import NO_RENDERING, Simulator, SimulatorMark
from infthor_eval.thor.view import SimulatorView, ThorObject

_MAX_ADDED = 8  # ordinary tasks, where a final task is to need a memory and none does
_MIN_NOT_EXECUTED = 200  # tasks without any executed action that end an attempt, at least
_OTHER_SETTINGS = "choose another scene or seed or a higher --max-fail"
_Size = tuple[float, ...]
# tasks after which a failure is forgotten: other objects have moved and may have cleared the way
_LIFETIME = 24
_NEAR = 0.02  # tolerance of positions and sizes, metres


@dataclass
class GeneratedTrajectory:
    """One trajectory, with the planning problems of its tasks and put-downs as PDDL, in order."""

    trajectory: Trajectory
    statistics: AttemptStatistics
    problems: list[str]


def generate(
    settings: TrajectorySettings, simulator: Simulator, on_progress: OnProgress = ignore_progress
) -> GeneratedTrajectory:
    """Generate one trajectory in a simulator, which loads its scene.

    Args:
        settings: settings of the trajectory.
        simulator: the simulator.
        on_progress: called after each attempted task.
    """
    factory = _Factory(settings, simulator, on_progress)
    try:
        while not factory.long_enough():
            factory.extend()
        if settings.final_task:
            factory.finish()
    except _GaveUp as reason:
        return factory.bank(str(reason))
    return factory.result()


class _GaveUp(Exception):
    """The attempt ends before its lengths are reached; the message says why."""


@dataclass(frozen=True)
class _Start:
    """The state before a task, and the number of tasks and put-downs before it."""

    mark: SimulatorMark
    n_subgoals: int


@dataclass(frozen=True)
class _Outcome:
    """How a task that was sampled ended.

    Attributes:
        failure: why it failed; None if it became part of the trajectory.
        executed: True if at least one of its actions was executed.
    """

    failure: RolloutError | None
    executed: bool


class _Factory:
    def __init__(
        self, settings: TrajectorySettings, simulator: Simulator, on_progress: OnProgress
    ) -> None:
        """Load the scene and place the agent at random."""
        self._settings = settings
        self._on_progress = on_progress
        self._name = f"scene {settings.scene}, seed {settings.seed}"
        self._simulator = simulator
        # One stream for all random choices, seeded by a text, which Python hashes alike in every
        # process. Another order of draws would be another trajectory.
        self._rng = random.Random(f"{settings.scene}/{settings.seed}")
        self._task_types = settings.sampled_types()
        self._pool = TaskPool(self._rng)
        self._known_failures = KnownFailures()
        self._statistics = AttemptStatistics()
        self._n_in_row = 0  # failures of executed tasks since the last one that was accepted
        self._n_roll_backs = 0  # since the last task that was accepted
        self._n_not_executed = 0  # failures of tasks with nothing executed, since the pool began
        self._starts: list[_Start] = []  # of each task
        self._draft = self._start_draft()
        self._longest = self._draft.copy()

    def _start_draft(self) -> Draft:
        view = self._simulator.reset(self._settings.house or self._settings.scene)
        grid = reachable_grid(self._simulator)
        if not grid.cells:
            raise UsageError(
                f"scene {self._settings.scene}: the agent cannot stand anywhere; choose another "
                "scene"
            )
        x, z = grid.position(self._rng.choice(sorted(grid.cells)))
        turn = float(self._rng.choice([0, 90, 180, 270]))
        start = InitAction(x, view.agent.position.y, z, turn, 30.0)
        scene = initial_scene(self._settings, view, start)
        restore(self._simulator, scene)
        return Draft(self._settings, scene, self._simulator.view)

    # -- the whole trajectory

    def long_enough(self) -> bool:
        draft = self._draft
        settings = self._settings
        return draft.length.low >= settings.min_steps and draft.n_subgoals >= settings.min_subgoals

    def result(self) -> GeneratedTrajectory:
        trajectory = self._draft.trajectory(self._statistics.document())
        return GeneratedTrajectory(trajectory, self._statistics, self._draft.problems)

    def bank(self, reason: str) -> GeneratedTrajectory:
        """Return the longest trajectory so far, if it has `save_floor` steps.

        The embedded simulator repeats every action exactly, so all of its prefixes replay.
        """
        self._note_longest()
        self._draft = self._longest
        floor = self._settings.save_floor
        if not floor or self._draft.length.low < floor:
            raise UsageError(f"{self._name}: {reason}")
        self._statistics.gave_up = True
        return self.result()

    def extend(self) -> None:
        """Add one task, the first sampled one that can be planned and completed.

        If it leaves an object in the hand, that is put down in a sub-goal after the task.

        Raises:
            _GaveUp: there is nothing left to try, or nothing left to drop.
        """
        length = self._draft.length
        while self._draft.length.low <= length.low:
            room = self._room()
            candidates = self._candidates(room)
            task = self._pool.draw(candidates)
            if task is None:
                self._begin_pool_again(candidates)
                continue
            outcome = self._try(task, room)
            self._on_progress(self._progress())
            self._count(outcome)
            if self._n_in_row > self._settings.max_fail:
                self._roll_back()
                length = self._draft.length

    def finish(self) -> None:
        """Add the final task.

        Raises:
            _GaveUp: none works. The published generator discards the trajectory, too; where the
                task is to need a memory, ordinary tasks are added before other tries.
        """
        for n_added in range(1 + _MAX_ADDED * (self._settings.final_task == MEMORY)):
            if n_added:
                self.extend()
            if self._add_final_task():
                self._draft.make_last_task_final()
                return
        raise _GaveUp("no final task works; choose another scene (a house, for a memory) or seed")

    def _add_final_task(self) -> bool:
        """Try the tasks between the trajectory's ends, each once, in a direction drawn anew."""
        directions = end_types(self._draft.object_log(), self._settings.final_task == MEMORY)
        pool = TaskPool(self._rng)
        while True:
            room = self._room()
            possible = self._candidates(room)
            candidates = [list(filter(types.allows_task, possible)) for types in directions]
            self._rng.shuffle(candidates)
            task = pool.draw(candidates[0]) or pool.draw(candidates[1])
            if task is None:
                return False
            if self._try(task, room, is_last=True).failure is None:
                return True

    # -- dead ends

    def _begin_pool_again(self, candidates: Sequence[Task]) -> None:
        # The published generator would save what is there; here the same tasks are drawn again.
        # First those that were left out, as what is known of failures may be outdated.
        if self._known_failures:
            self._known_failures.forget()
        elif self._pool.begin_again(candidates):
            self._statistics.pool_restarts.append(self._draft.length.low)
            self._n_not_executed = 0
        else:
            raise _GaveUp(self._no_further_task("choose another scene or seed"))

    def _count(self, outcome: _Outcome) -> None:
        """Count the failures, or begin to count anew.

        Raises:
            _GaveUp: too many tasks of which nothing was executed.
        """
        if outcome.failure is None:
            self._n_in_row = self._n_roll_backs = 0
            return
        if outcome.executed:
            self._n_in_row += 1
            return
        self._n_not_executed += 1
        if self._n_not_executed > max(_MIN_NOT_EXECUTED, 10 * self._settings.max_fail):
            raise _GaveUp(self._no_further_task(_OTHER_SETTINGS))

    def _roll_back(self) -> None:
        """Drop the last sub-goals, twice as many as last time, and go on from the state before.

        Raises:
            _GaveUp: there is nothing to drop.
        """
        if not self._starts:
            raise _GaveUp(self._no_further_task(_OTHER_SETTINGS))
        self._note_longest()
        before = self._draft.length
        n_before = self._draft.n_subgoals
        n_to_drop = min(2**self._n_roll_backs, max(1, n_before - 1))
        while self._starts and n_before - self._draft.n_subgoals < n_to_drop:
            start = self._starts.pop()
            self._draft.keep(start.n_subgoals)
        self._simulator.rewind(start.mark, exactly=True)
        self._known_failures.forget()
        self._n_in_row = 0
        self._n_roll_backs += 1
        dropped = n_before - self._draft.n_subgoals
        self._statistics.roll_backs.append(RollBack(before.low, self._draft.length.low, dropped))

    def _note_longest(self) -> None:
        if self._draft.length.low > self._longest.length.low:
            self._longest = self._draft.copy()

    def _no_further_task(self, hint: str) -> str:
        statistics = self._statistics
        reasons = (statistics.reasons + statistics.not_executed).most_common(3)
        causes = "; ".join(f"{reason} ({count})" for reason, count in reasons)
        n_failed = statistics.reasons.total()
        return (
            f"no further task works after {self._draft.length.low} steps and {n_failed} failed "
            f"tasks ({causes or 'no possible task'}); {hint}"
        )

    def _progress(self) -> JobProgress:
        """Return how far the trajectory is; as many steps a sub-goal as before are expected."""
        n_steps, n_subgoals = self._draft.length.low, self._draft.n_subgoals
        expected = n_steps * self._settings.min_subgoals // max(1, n_subgoals)
        refused = self._statistics.reasons + self._statistics.not_executed
        detail = ""
        if refused:
            ((most, n_most),) = refused.most_common(1)
            detail = f"{refused.total()} task(s) refused, {n_most} as {most}"
        name, n_units = self._settings.traj_id, max(self._settings.min_steps, expected)
        return JobProgress(name, n_steps, n_units, detail)

    # -- one task

    def _room(self) -> SymbolicRoom:
        return self._known_failures.room(self._simulator.view)

    def _candidates(self, room: SymbolicRoom) -> list[Task]:
        """Return the tasks that are possible now, not with what is known to be full or far."""
        types = {one.object_type for one in self._simulator.view.objects.values()}
        return open_tasks(room, types, self._task_types)

    def _try(self, task: Task, room: SymbolicRoom, is_last: bool = False) -> _Outcome:
        """Plan a task, rehearse it and carry it out; after a failure everything is as before."""
        operators = plan(task, room) or []
        objection = self._objection(task, operators)
        if objection is not None:
            return self._failed(task, _Outcome(objection, executed=False))
        start = _Start(self._simulator.mark(), self._draft.n_subgoals)
        outcome = self._execute(lambda rollout: rollout.run(operators), look=True)
        if outcome.failure is None:
            outcome = _Outcome(_unmet_goal(task, self._simulator), outcome.executed)
        if outcome.failure is None:
            self._draft.end_task(*self._documents(task, room))
            if not is_last:
                outcome = _Outcome(self._put_down(), outcome.executed)
        if outcome.failure is not None:
            self._simulator.rewind(start.mark)
            self._draft.keep(start.n_subgoals)
            return self._failed(task, outcome)
        self._statistics.tried[_name(task)] += 1
        self._statistics.accepted[_name(task)] += 1
        self._known_failures.task_done()
        self._starts.append(start)
        return outcome

    def _documents(self, task: Task, room: SymbolicRoom) -> tuple[SubTask, str]:
        """Return a task in the form of trajectories, and its problem in the room before it."""
        name = f"task-{self._draft.n_subgoals:03d}"
        return sub_task(task, self._settings.scene, self._words()), problem(task, room, name)

    def _words(self) -> random.Random | None:
        """Return what draws the next task's words, which depend on nothing but seed and number."""
        if self._settings.words == Words.NATURAL:
            return None
        return random.Random(f"{self._settings.seed}/{self._draft.n_subgoals}")

    def _objection(self, task: Task, operators: list[Operator]) -> RolloutError | None:
        """Return why a task is not worth walking for."""
        if all(step.name == "GotoLocation" for step in operators):
            return RolloutError(f"{task.task_type}: no plan, or walking alone")
        if len(operators) > MAX_PLAN_STEPS:
            return RolloutError(f"a plan of more than {MAX_PLAN_STEPS} steps")
        return _rehearse(task, operators, self._simulator)

    def _failed(self, task: Task, outcome: _Outcome) -> _Outcome:
        """Count a failed task, with the simulator as it was before it, and remember what failed."""
        failure = outcome.failure
        assert failure is not None
        if failure.item is not None:
            self._known_failures.note(self._simulator.view, failure.item, failure.receptacle)
        if outcome.executed:
            self._statistics.tried[_name(task)] += 1
            self._statistics.reasons[str(failure)] += 1
        else:
            self._statistics.not_executed[str(failure)] += 1
        return outcome

    def _put_down(self) -> RolloutError | None:
        """Put a held object into a random receptacle that has room for it, as a sub-goal."""
        room = self._room()
        held = room.start.held
        if held is None:
            return None
        fitting = sorted(key for key in room.places & room.receptacles if room.fits(held, key))
        self._rng.shuffle(fitting)
        for receptacle in fitting:
            task = Task(TaskType.PUT_AWAY, held.partition("|")[0], room.types[receptacle])
            if self._put_into(task, held, receptacle):
                self._draft.end_put_down(*self._documents(task, room))
                return None
        return RolloutError(f"no receptacle has room for {room.types[held]}", held)

    def _put_into(self, task: Task, held: str, receptacle: str) -> bool:
        """Put a held object down; returns False if that fails, with everything as before."""
        mark = self._simulator.mark()
        # As published, the camera is not raised in put-downs.
        outcome = self._execute(lambda rollout: rollout.put_down(held, receptacle), look=False)
        if outcome.failure is not None:
            return False
        if _unmet_goal(task, self._simulator) is not None:
            self._simulator.rewind(mark)
            self._draft.keep(self._draft.n_subgoals)
            return False
        return True

    def _execute(self, act: Callable[[Rollout], None], look: bool) -> _Outcome:
        """Act and add the actions, with those of looking around if `look`.

        If an action fails, the simulator is rewound and nothing is added.
        """
        mark = self._simulator.mark()
        trace = Trace(self._simulator, self._draft.length.high)
        try:
            act(Rollout(trace, Walker(trace)))
            if look and self._settings.look_around:
                look_around(trace, mark)
        except RolloutError as error:
            self._simulator.rewind(mark)
            return _Outcome(error, executed=bool(trace.actions))
        self._draft.add(trace)
        return _Outcome(None, executed=True)


def _unmet_goal(task: Task, simulator: Simulator) -> RolloutError | None:
    # A completed plan is no proof: objects can slide.
    if goal_holds(task, simulator.view):
        return None
    return RolloutError(f"{task.task_type}: its plan was completed, but its goal does not hold")


def _name(task: Task) -> str:
    return f"{task.task_type}{' sliced' if task.sliced else ''}"


class KnownFailures:
    """Objects that cannot be acted on, and receptacles without room for an object.

    They are not tried again while the objects involved are unchanged.
    """

    def __init__(self) -> None:
        self._n_tasks = 0
        # Number of the task at which an object failed, and its position then.
        self._blocked: dict[str, tuple[int, tuple[float, ...]]] = {}
        # Number of the task at which an object did not fit into a receptacle, and its contents
        # then.
        self._refused: dict[tuple[str, str], tuple[int, frozenset[str]]] = {}
        self._sizes: dict[str, _Size | None] = {}

    def __bool__(self) -> bool:
        return bool(self._blocked or self._refused)

    def note(self, view: SimulatorView, item: str, receptacle: str | None) -> None:
        """Record that an object cannot be acted on, or does not fit into a receptacle.

        Args:
            view: state before the failed task.
            item: id of the object.
            receptacle: id of the receptacle without room; None if the object itself cannot be acted
                on.
        """
        if receptacle is not None:
            self._refused[item, receptacle] = self._n_tasks, _contents(view, receptacle)
            if item in view.objects:
                self._sizes[item] = _size(view.objects[item])
        elif item in view.objects:
            self._blocked[item] = self._n_tasks, _position(view, item)

    def task_done(self) -> None:
        """Count a completed task, which changed the room."""
        self._n_tasks += 1

    def forget(self) -> None:
        """Forget all failures."""
        self._blocked.clear()
        self._refused.clear()

    def room(self, view: SimulatorView) -> SymbolicRoom:
        """Return the room, without the objects and pairs that are known to fail."""
        oldest = self._n_tasks - _LIFETIME
        self._blocked = {
            item: (since, position)
            for item, (since, position) in self._blocked.items()
            if since > oldest and item in view.objects and _is_near(position, _position(view, item))
        }
        # A receptacle from which something was taken may have room now.
        self._refused = {
            pair: (since, contents)
            for pair, (since, contents) in self._refused.items()
            if since > oldest and contents <= _contents(view, pair[1])
        }
        return room_of(view, self._blocked.keys(), set(self._without_room(view)))

    def _without_room(self, view: SimulatorView) -> Iterator[tuple[str, str]]:
        """Yield (object, receptacle) pairs that do not fit: known ones, and those by their sizes.

        An object does not fit where an object of at most its size did not, nor into a receptacle of
        a smaller base.
        """
        yield from self._refused
        all_sizes = {key: _size(thor_object) for key, thor_object in view.objects.items()}
        sizes = {key: size for key, size in all_sizes.items() if size is not None}
        items = [key for key in sizes if view.objects[key].pickupable]
        for item, receptacle in self._refused:
            refused_size = self._sizes.get(item)
            if refused_size is not None:
                yield from ((key, receptacle) for key in items if _covers(sizes[key], refused_size))
        for receptacle in (key for key in sizes if view.objects[key].receptacle):
            base = sizes[receptacle][:2]
            yield from ((key, receptacle) for key in items if not _covers(base, sizes[key][:2]))


def _size(item: ThorObject) -> _Size | None:
    """Return the horizontal sizes, the larger first, and the height, metres."""
    box = item.axis_aligned_bounding_box
    return None if box is None else (*sorted((box.size.x, box.size.z), reverse=True), box.size.y)


def _covers(one: _Size, other: _Size) -> bool:
    """Return True if one size is at least the other in each direction."""
    return all(a >= b - _NEAR for a, b in zip(one, other, strict=True))


def _position(view: SimulatorView, item: str) -> tuple[float, ...]:
    return astuple(view.objects[item].position)


def _is_near(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(abs(a - b) <= _NEAR for a, b in zip(one, other, strict=True))


def _contents(view: SimulatorView, receptacle: str) -> frozenset[str]:
    objects = view.objects
    return frozenset(
        key for key, item in objects.items() if direct_parent(item, objects) == receptacle
    )


class _Stage:
    """Stands in for a walker: everything is in reach."""

    def go(self, object_ids: list[str], inside: str | None = None) -> None:
        """Do nothing."""

    def step_aside(self, item: str, inside: str | None = None) -> None:
        """Do nothing."""

    def forget_grid(self) -> None:
        """Do nothing."""


class _ForcedTrace(Trace):
    """Executes actions wherever their objects are, without pictures."""

    def act(self, api: ApiAction, arguments: dict[str, Any], suffix: str = "") -> None:
        """Execute one action; raises as that of a trace does."""
        super().act(api, {**arguments, **NO_RENDERING, "forceAction": True}, suffix)


def _rehearse(task: Task, operators: list[Operator], simulator: Simulator) -> RolloutError | None:
    """Return why a plan fails wherever the agent stands; None if it may work.

    Interactions are forced from where the agent is, and taken back. So what is full, and what is
    not allowed where, is known before the first step. It costs a fifth of what the walks do.

    The simulator is left as it was. One that cannot store its state is not asked, as going back
    would take as long as the trajectory.
    """
    mark = simulator.mark()
    if not simulator.stores(mark):
        return None
    try:
        Rollout(_ForcedTrace(simulator), _Stage()).run(operators)
        works = task.light is not None or goal_holds(task, simulator.view)
        if works:
            return None
        return RolloutError(f"{task.task_type}: its plan would not reach its goal")
    except RolloutError as error:
        return error
    finally:
        simulator.rewind(mark, exactly=True)
