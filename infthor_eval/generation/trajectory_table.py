"""A trajectory at a glance: its scene, its length, its tasks with their steps, and `gen_info`."""

import json
from collections.abc import Iterator
from typing import Any

import msgspec

from infthor_eval.formats.trajectory import SubTask, Trajectory
from infthor_eval.household.sequence_text import goal_text
from infthor_eval.tables import Column, Row, Table


class SubGoalSummary(msgspec.Struct):
    """A task, or the put-down of what one left in the hand.

    Attributes:
        goal: its type; empty if the file has none.
        text: its goal in words.
        first: index of its first low-level action.
        end: index of the action after its last one.
        final: whether it is the final task.
    """

    goal: str
    text: str
    first: int
    end: int
    final: bool = False


class TrajectorySummary(msgspec.Struct):
    """What `infthor-eval show` prints of a trajectory.

    Attributes:
        traj_id: its id.
        scene: name of its scene.
        steps: number of low-level actions.
        sub_goals: its tasks and put-downs, in order.
        gen_info: what the file says of its generation, as it is there; null if nothing.
    """

    traj_id: str
    scene: str
    steps: int
    sub_goals: list[SubGoalSummary]
    gen_info: dict[str, Any] | None


def summary_of(trajectory: Trajectory) -> TrajectorySummary:
    """Return the summary of a trajectory of ALFRED, of ∞-THOR, or ours."""
    return TrajectorySummary(
        trajectory.traj_id,
        trajectory.scene.floor_plan,
        len(trajectory.plan.low_actions),
        list(_sub_goals(trajectory)),
        trajectory.gen_info,
    )


def _sub_goals(trajectory: Trajectory) -> Iterator[SubGoalSummary]:
    final = trajectory.long_horizon_task
    tasks: list[SubTask] = trajectory.sub_tasks
    if len(tasks) < len(trajectory.sub_trajs) and final is not None:
        tasks = [*tasks, final]  # some files have it apart from the others
    if not trajectory.sub_trajs:  # ALFRED's demonstrations are one task
        n_actions = len(trajectory.plan.low_actions)
        yield SubGoalSummary(trajectory.task_type or "", goal_text(trajectory, None), 0, n_actions)
    last = len(trajectory.sub_trajs) - 1
    for number, part in enumerate(trajectory.sub_trajs):
        task = tasks[number] if number < len(tasks) else None
        yield SubGoalSummary(
            "" if task is None else task.task_info.goal,
            str(part.subgoal or "") if task is None else task.task_desc,
            *part.low_pddl_idx,
            final=final is not None and number == last,
        )


def trajectory_table(summary: TrajectorySummary) -> Table:
    """Return a row per sub-goal, with the indices of its first and last action; below, `gen_info`,
    a note per field."""
    rows = [
        Row((str(number), _steps(part), str(part.end - part.first), part.goal, _text(part)))
        for number, part in enumerate(summary.sub_goals)
    ]
    n_parts = len(summary.sub_goals)
    words = "1 sub-goal" if n_parts == 1 else f"{n_parts} sub-goals"
    info = (summary.gen_info or {}).items()
    return Table(
        f"{summary.traj_id}: scene {summary.scene}, {summary.steps} steps, {words}",
        (
            Column("#"),
            Column("steps"),
            Column("actions"),
            Column("goal", False),
            Column("in words", False),
        ),
        tuple(rows),
        tuple(f"{name}: {json.dumps(value)}" for name, value in info),
    )


def _steps(part: SubGoalSummary) -> str:
    return f"{part.first}-{part.end - 1}" if part.end > part.first else "none"


def _text(part: SubGoalSummary) -> str:
    return f"{part.text} (final task)" if part.final else part.text
