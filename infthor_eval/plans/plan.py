"""The plans of a trajectory: the instructions that an agent is given, one after the other."""

from dataclasses import dataclass
from enum import StrEnum

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import HighAction, SubTask, TaskInfo, Trajectory
from infthor_eval.household.sequence_text import goal_text, plan_text
from infthor_eval.household.tasks import Task, task_of


class PlanKind(StrEnum):
    """ALFRED's sub-goals."""

    GOTO = "GotoLocation"
    PICKUP = "PickupObject"
    PUT = "PutObject"
    OPEN = "OpenObject"
    CLOSE = "CloseObject"
    TOGGLE = "ToggleObject"
    SLICE = "SliceObject"
    CLEAN = "CleanObject"
    HEAT = "HeatObject"
    COOL = "CoolObject"


@dataclass(frozen=True)
class TrajectoryTask:
    """One task: its goal in words, as recorded and as a condition; its sub-goals [first, end)."""

    text: str
    info: TaskInfo
    task: Task
    first_high: int
    end_high: int

    def holds(self, high: int) -> bool:
        """Return whether a sub-goal belongs to the task."""
        return self.first_high <= high < self.end_high


@dataclass(frozen=True)
class Plan:
    """One plan.

    Attributes:
        index: index among the trajectory's plans.
        high: index of its sub-goal in the trajectory.
        text: the plan in words ("pick up the mug").
        task: index of the task that it belongs to; the earlier one if it is between two tasks.
        in_task: whether it belongs to a task, and not to the way from one to the next, as putting
            away what is held.
        low: indices of the expert's low-level actions, [first, end).
        object_id: recorded id of its object; None if the recording names none.
        receptacle_id: recorded id of its receptacle; None if the recording names none.
        location: pose to reach by GotoLocation, "loc|x|z|turn|horizon": cells of 0.25 m, quarter
            turns, degrees.
        is_final: whether it belongs to the final long-horizon task.
    """

    index: int
    high: int
    kind: PlanKind
    text: str
    task: int
    in_task: bool
    low: tuple[int, int]
    object_id: str | None = None
    receptacle_id: str | None = None
    location: str | None = None
    is_final: bool = False


def tasks_of(trajectory: Trajectory) -> list[TrajectoryTask]:
    """Return the tasks of a trajectory, in time order; ALFRED's demonstrations have one."""
    n_high = len(trajectory.plan.high_pddl)
    if not trajectory.sub_trajs:
        single = _single_task(trajectory)
        task = _task(trajectory, 0, single)
        return [TrajectoryTask(goal_text(trajectory, None), single.task_info, task, 0, n_high)]
    tasks = []
    n_parts = len(trajectory.sub_trajs)
    if n_parts != len(trajectory.tasks):
        problem = f"{n_parts} parts for {len(trajectory.tasks)} tasks; restore the file"
        raise _error(trajectory, problem)
    for sub_task, span in zip(trajectory.tasks, trajectory.sub_trajs, strict=True):
        first, end = span.high_pddl_idx
        if not 0 <= first <= end <= n_high:
            problem = f"task {span.sub_traj_idx} has sub-goals {first} to {end} of {n_high}"
            raise _error(trajectory, problem)
        task = _task(trajectory, span.sub_traj_idx, sub_task)
        text = goal_text(trajectory, sub_task)
        tasks.append(TrajectoryTask(text, sub_task.task_info, task, first, end))
    return tasks


def plans_of(trajectory: Trajectory, words: Words) -> list[Plan]:
    """Return a trajectory's plans in order; a sub-goal without action (ALFRED's last) is none."""
    tasks = tasks_of(trajectory)
    spans = _spans(trajectory)
    final = len(tasks) - 1 if trajectory.long_horizon_task is not None else None
    plans: list[Plan] = []
    for index, high in enumerate(trajectory.plan.high_pddl):
        low = spans.get(high.high_idx)
        if low is None:
            continue
        begun = [number for number, task in enumerate(tasks) if task.first_high <= index]
        number = max(begun, default=0)
        object_id, receptacle_id = _ids(trajectory, high, low)
        plans.append(
            Plan(
                index=len(plans),
                high=index,
                kind=_kind(trajectory, high),
                text=_text(trajectory, high, words),
                task=number,
                in_task=tasks[number].holds(index),
                low=low,
                object_id=object_id,
                receptacle_id=receptacle_id,
                location=high.planner_action.location,
                is_final=number == final and tasks[number].holds(index),
            )
        )
    return plans


def _task(trajectory: Trajectory, number: int, recorded: SubTask) -> Task:
    try:
        return task_of(recorded)
    except DataError as error:
        raise DataError(f"trajectory {trajectory.traj_id}, task {number}: {error}") from error


def _single_task(trajectory: Trajectory) -> SubTask:
    """Return the task of an ALFRED demonstration."""
    params = trajectory.pddl_params or {}
    info = TaskInfo(
        goal=trajectory.task_type or "",
        pickup=params.get("object_target"),
        movable=params.get("mrecep_target") or None,
        receptacle=params.get("parent_target") or None,
    )
    return SubTask(info, pddl_params=params)


def _spans(trajectory: Trajectory) -> dict[int, tuple[int, int]]:
    """Return the indices of each sub-goal's actions, [first, end)."""
    spans: dict[int, tuple[int, int]] = {}
    previous = -1
    for number, low in enumerate(trajectory.plan.low_actions):
        if low.high_idx < previous:
            problem = f"action {number} belongs to sub-goal {low.high_idx}, out of order"
            raise _error(trajectory, problem)
        first, _ = spans.get(low.high_idx, (number, number))
        spans[low.high_idx] = (first, number + 1)
        previous = low.high_idx
    if unknown := spans.keys() - {high.high_idx for high in trajectory.plan.high_pddl}:
        raise _error(trajectory, f"there is no sub-goal {min(unknown)}, which actions belong to")
    return spans


def _ids(
    trajectory: Trajectory, high: HighAction, low: tuple[int, int]
) -> tuple[str | None, str | None]:
    """Return the ids of a sub-goal's object and receptacle.

    What is put away after a task is named by its type in the sub-goal; its ids are in the action
    that puts it.
    """
    planner = high.planner_action
    if "|" not in (planner.object_id or "|"):
        for action in trajectory.plan.low_actions[slice(*low)]:
            api = action.api_action
            if api.action == high.discrete_action.action and api.object_id is not None:
                return api.object_id, api.receptacle_id or planner.receptacle_id
    return planner.object_id, planner.receptacle_id


def _kind(trajectory: Trajectory, high: HighAction) -> PlanKind:
    kind = high.discrete_action.action
    try:
        return PlanKind(kind)
    except ValueError as error:
        problem = f"sub-goal {high.high_idx} is {kind!r:.60}; there are {', '.join(PlanKind)}"
        raise _error(trajectory, problem) from error


def _text(trajectory: Trajectory, high: HighAction, words: Words) -> str:
    try:
        return plan_text(high, words)
    except DataError as error:
        raise _error(trajectory, str(error)) from error


def _error(trajectory: Trajectory, problem: str) -> DataError:
    return DataError(f"trajectory {trajectory.traj_id}: {problem}")
