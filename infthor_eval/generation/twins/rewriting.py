"""Rewriting a trajectory for a world: its scene, the ids in its actions, and its words."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.trajectory import (
    ApiAction,
    DiscreteAction,
    HighAction,
    LowAction,
    Scene,
    SubTask,
    Trajectory,
)
from infthor_eval.household.tasks import sub_task, task_of

_ID_FIELDS = ("object_id", "receptacle_id", "clean_id")


def in_world(
    trajectory: Trajectory,
    scene: Scene,
    new_id: Callable[[str], str] = str,
    types: Mapping[str, str] | None = None,
) -> Trajectory:
    """Return a copy of a trajectory for another world.

    Args:
        trajectory: the trajectory.
        scene: start of the world.
        new_id: returns the id of an object in this world for that in the trajectory.
        types: object types that stand for others in tasks and words, both ways.
    """
    types = types or {}
    plan = msgspec.structs.replace(
        trajectory.plan,
        low_actions=[_low_action(low, new_id) for low in trajectory.plan.low_actions],
        high_pddl=[_high_action(high, new_id, types) for high in trajectory.plan.high_pddl],
    )
    final = trajectory.long_horizon_task
    return msgspec.structs.replace(
        trajectory,
        scene=scene,
        plan=plan,
        sub_tasks=[_task(task, types) for task in trajectory.sub_tasks],
        sub_trajs=_with_words(trajectory, types),
        long_horizon_task=None if final is None else _task(final, types),
    )


def without_traces(trajectory: Trajectory, traj_id: str) -> Trajectory:
    """Return a copy without what tells where it comes from: logs, boxes, seeds and names."""
    low_actions = [_without_box(low) for low in trajectory.plan.low_actions]
    return Trajectory(
        scene=msgspec.structs.replace(trajectory.scene, random_seed=0),
        plan=msgspec.structs.replace(trajectory.plan, low_actions=low_actions),
        traj_id=traj_id,
        sub_tasks=trajectory.sub_tasks,
        sub_trajs=trajectory.sub_trajs,
        long_horizon_task=trajectory.long_horizon_task,
    )


def with_inserted(trajectory: Trajectory, index: int, actions: Sequence[ApiAction]) -> Trajectory:
    """Return a copy with more low-level actions before the one of an index, within its sub-goal."""
    plan = trajectory.plan
    high_idx = plan.low_actions[index].high_idx
    inserted = [LowAction(api, high_idx, DiscreteAction(api.action, {}), None) for api in actions]
    low_actions = [*plan.low_actions[:index], *inserted, *plan.low_actions[index:]]
    numbered = [
        msgspec.structs.replace(low, low_idx=number) for number, low in enumerate(low_actions)
    ]

    def shifted(place: int) -> int:
        return place + len(actions) if place > index else place

    parts = [
        msgspec.structs.replace(
            part, low_pddl_idx=(shifted(part.low_pddl_idx[0]), shifted(part.low_pddl_idx[1]))
        )
        for part in trajectory.sub_trajs
    ]
    return msgspec.structs.replace(
        trajectory,
        plan=msgspec.structs.replace(plan, low_actions=numbered),
        sub_trajs=parts,
    )


def first_subgoals(world: Trajectory, n_high: int) -> Trajectory:
    """Return the first sub-goals of a world: their actions, and the tasks that they are of."""
    high_pddl = world.plan.high_pddl[:n_high]
    known = {high.high_idx for high in high_pddl}
    low_actions = [low for low in world.plan.low_actions if low.high_idx in known]
    parts = [
        msgspec.structs.replace(
            part,
            high_pddl_idx=(part.high_pddl_idx[0], min(part.high_pddl_idx[1], n_high)),
            low_pddl_idx=(part.low_pddl_idx[0], min(part.low_pddl_idx[1], len(low_actions))),
        )
        for part in world.sub_trajs
        if part.high_pddl_idx[0] < n_high
    ]
    return msgspec.structs.replace(
        world,
        plan=msgspec.structs.replace(world.plan, low_actions=low_actions, high_pddl=high_pddl),
        sub_tasks=world.tasks[: len(parts)],
        sub_trajs=parts,
        long_horizon_task=None,
    )


def exchange_ids(ids: Mapping[str, str]) -> Callable[[str], str]:
    """Return a function from ids to new ones; a slice or a part goes with its whole."""

    def new_id(old: str) -> str:
        head = whole_of(old)
        other = ids.get(head, head)
        rest = old[len(head) :]
        before, after = object_type_of(head), object_type_of(other)
        # The id of a slice names the type: "Apple|...|AppleSliced_1".
        return other + rest.replace(f"|{before}Sliced", f"|{after}Sliced")

    return new_id


def whole_of(key: str) -> str:
    """Return the id of the object that a slice or a part is of."""
    return "|".join(key.split("|")[:4])


def _with_words(trajectory: Trajectory, types: Mapping[str, str]) -> list[Any]:
    words = [_task(task, types).task_desc for task in trajectory.sub_tasks]
    parts = []
    for number, part in enumerate(trajectory.sub_trajs):
        is_named = number < len(words) and isinstance(part.subgoal, str)
        subgoal = words[number] if is_named else part.subgoal
        parts.append(msgspec.structs.replace(part, subgoal=subgoal))
    return parts


def _task(task: SubTask, types: Mapping[str, str]) -> SubTask:
    known = task_of(task)
    exchanged = msgspec.structs.replace(
        known,
        pickup=types.get(known.pickup, known.pickup),
        movable=types.get(known.movable or "", known.movable),
        receptacle=types.get(known.receptacle or "", known.receptacle),
    )
    return sub_task(exchanged, str(task.task_info.scene or ""))


def _low_action(low: LowAction, new_id: Callable[[str], str]) -> LowAction:
    return msgspec.structs.replace(low, api_action=_with_ids(low.api_action, new_id))


def _high_action(
    high: HighAction, new_id: Callable[[str], str], types: Mapping[str, str]
) -> HighAction:
    by_word = {old.lower(): new.lower() for old, new in types.items()}
    args = high.discrete_action.args
    if isinstance(args, list):
        args = [by_word.get(word, word) if isinstance(word, str) else word for word in args]
    return msgspec.structs.replace(
        high,
        discrete_action=DiscreteAction(high.discrete_action.action, args),
        planner_action=_with_ids(high.planner_action, new_id),
    )


def _with_ids(action: Any, new_id: Callable[[str], str]) -> Any:
    ids = {name: getattr(action, name, None) for name in _ID_FIELDS}
    return msgspec.structs.replace(
        action, **{name: new_id(old) for name, old in ids.items() if old is not None}
    )


def _without_box(low: LowAction) -> LowAction:
    words = low.discrete_action
    return msgspec.structs.replace(
        low, discrete_action=None if words is None else DiscreteAction(words.action, {})
    )
