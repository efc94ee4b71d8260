"""Tasks with object types: ALFRED's seven task types, and putting away what is held after one.

To add a household task type: here, its goal in `goals.py` and `pddl.py`.
"""

from enum import StrEnum
from random import Random
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import modern_type
from infthor_eval.formats.trajectory import SubTask, TaskInfo
from infthor_eval.household.affordances import preposition
from infthor_eval.household.wording import compact_name, noun, plural, with_article


class TaskType(StrEnum):
    """ALFRED's task types, and the published generator's PUT_AWAY, by their trajectories' names."""

    PLACE = "pick_and_place_simple"
    PLACE_TWO = "pick_two_obj_and_place"
    EXAMINE = "look_at_obj_in_light"
    CLEAN = "pick_clean_then_place_in_recep"
    HEAT = "pick_heat_then_place_in_recep"
    COOL = "pick_cool_then_place_in_recep"
    STACK = "pick_and_place_with_movable_recep"
    PUT_AWAY = "put object"


# Those that a task is drawn from: ALFRED's.
SAMPLED = tuple(task_type for task_type in TaskType if task_type != TaskType.PUT_AWAY)


class Task(msgspec.Struct, frozen=True):
    """One task; objects are given by their types.

    Attributes:
        task_type: type of the task.
        pickup: the object to pick up (the type of the whole, also if `sliced`), or for PUT_AWAY the
            one in the hand, where the type of the whole stands for a slice as well.
        receptacle: the receptacle to put it into; None for EXAMINE.
        movable: the receptacle that is carried with it, for STACK.
        light: the lamp, for EXAMINE.
        sliced: True if the task requires a slice of the object.
    """

    task_type: TaskType
    pickup: str
    receptacle: str | None = None
    movable: str | None = None
    light: str | None = None
    sliced: bool = False

    @property
    def target(self) -> str:
        """Type of the object that must be in the receptacle in the end."""
        return f"{self.pickup}Sliced" if self.sliced else self.pickup

    @property
    def targets(self) -> tuple[str, ...]:
        """Types of which one must be in the receptacle in the end."""
        return (
            (self.pickup, f"{self.pickup}Sliced")
            if self.task_type == TaskType.PUT_AWAY
            else (self.target,)
        )


_TEMPLATES = {
    TaskType.PLACE: "put {item} {where}",
    TaskType.PLACE_TWO: "put two {items} {where}",
    TaskType.EXAMINE: "look at {item} under the {light}",
    TaskType.CLEAN: "put a clean {bare} {where}",
    TaskType.HEAT: "put a hot {bare} {where}",
    TaskType.COOL: "put a cold {bare} {where}",
    TaskType.STACK: "put {movable} with {item} in it {where}",
    # published, with the types as they are
    TaskType.PUT_AWAY: "put the {pickup} on the {receptacle}",
}
_ONTO = {"Plate"}  # objects are on these, not in them
# Of the published generator (`gen/goal_library.py`), for whole objects and for slices.
_PUBLISHED = {
    TaskType.PLACE: (
        ("put a {obj} in {recep}", "put some {obj} on {recep}"),
        ("slice {obj} and put in {recep}", "put sliced {obj} in {recep}"),
    ),
    TaskType.PLACE_TWO: (
        ("put two {obj} in {recep}", "find two {obj} and put them in {recep}"),
        ("put two sliced {obj} in {recep}", "find two sliced {obj} and put them in {recep}"),
    ),
    TaskType.EXAMINE: (
        ("look at {obj} under the {toggle}", "examine the {obj} with the {toggle}"),
        ("look at sliced {obj} under the {toggle}", "examine the sliced {obj} with the {toggle}"),
    ),
    TaskType.CLEAN: (
        ("put a clean {obj} in {recep}", "clean some {obj} and put it in {recep}"),
        ("put a clean slice of {obj} in {recep}", "clean some sliced {obj} and put it in {recep}"),
    ),
    TaskType.HEAT: (
        ("put a hot {obj} in {recep}", "heat some {obj} and put it in {recep}"),
        ("put a hot slice of {obj} in {recep}", "heat some sliced {obj} and put it in {recep}"),
    ),
    TaskType.COOL: (
        ("put a cool {obj} in {recep}", "cool some {obj} and put it in {recep}"),
        ("put a cool slice of {obj} in {recep}", "cool some sliced {obj} and put it in {recep}"),
    ),
    TaskType.STACK: (
        (
            "put {obj} in a {mrecep} and then put them in {recep}",
            "put a {mrecep} of {obj} in {recep}",
            "put {obj} {mrecep} in {recep}",
        ),
        (
            "put sliced {obj} in a {mrecep} and then put them in {recep}",
            "put a {mrecep} of sliced {obj} in {recep}",
            "put sliced {obj} {mrecep} in {recep}",
        ),
    ),
}


def sub_task(task: Task, scene: str, draw: Random | None = None) -> SubTask:
    """Return a task in a scene in the form of trajectories, with a description in words.

    Args:
        task: the task.
        scene: name of the scene.
        draw: draws a description among the published generator's; None for plain English.
    """
    if task.task_type == TaskType.PUT_AWAY:  # as the published generator writes it
        return SubTask(
            TaskInfo(str(task.task_type), None, task.pickup, task.receptacle, scene),
            _describe(task),
        )
    info = TaskInfo(str(task.task_type), task.pickup, task.movable, task.receptacle, scene)
    params = {
        "mrecep_target": task.movable or "",
        "object_sliced": task.sliced,
        "object_target": task.pickup,
        "parent_target": task.receptacle or "",
        "toggle_target": task.light or "",
    }
    description = _describe(task) if draw is None else _describe_as_published(task, draw)
    return SubTask(info, description, params)


def task_of(recorded: SubTask) -> Task:
    """Return the task in a trajectory, ours, published or ALFRED's; the inverse of `sub_task`.

    Object types get their AI2-THOR 5.x names. Fields that the task type does not need are ignored.
    """
    info = recorded.task_info
    params = recorded.pddl_params
    task_type = _task_type(info.goal)
    if task_type == TaskType.PUT_AWAY:
        # Its parameters are those of the task before it; the object is the movable one, and none is
        # picked up.
        if not (info.movable and info.receptacle):
            raise DataError(
                f"a task of type {task_type} needs task_info's movable and receptacle; give object "
                "types"
            )
        return Task(task_type, modern_type(info.movable), modern_type(info.receptacle))
    examines = task_type == TaskType.EXAMINE
    stacks = task_type == TaskType.STACK
    pickup = _object_type(task_type, params, "object_target", info.pickup)
    whole = pickup.removesuffix("Sliced")
    return Task(
        task_type,
        whole,
        receptacle=None
        if examines
        else _object_type(task_type, params, "parent_target", info.receptacle),
        movable=_object_type(task_type, params, "mrecep_target", info.movable) if stacks else None,
        light=_object_type(task_type, params, "toggle_target", None) if examines else None,
        sliced=whole != pickup or _is_sliced(params),
    )


def _task_type(goal: str) -> TaskType:
    if not goal:
        raise DataError(f"a task has no goal; give one of {', '.join(TaskType)}")
    try:
        return TaskType(goal)
    except ValueError as error:
        raise DataError(
            f"a task's goal is {goal!r:.60}; give one of {', '.join(TaskType)}"
        ) from error


_IN_INFO = {"object_target": "pickup", "parent_target": "receptacle", "mrecep_target": "movable"}


def _object_type(
    task_type: TaskType, params: dict[str, Any], name: str, in_info: str | None
) -> str:
    """Return an object type that a goal needs, from `task_info` or else from `pddl_params`."""
    object_type = in_info or params.get(name)
    if isinstance(object_type, str) and object_type:
        return modern_type(object_type)
    sources = (
        f"task_info's {_IN_INFO[name]} or pddl_params' {name}"
        if name in _IN_INFO
        else f"pddl_params' {name}"
    )
    raise DataError(f"a task of type {task_type} has no {sources}; give an object type there")


def _is_sliced(params: dict[str, Any]) -> bool:
    sliced = params.get("object_sliced")
    if sliced is not None and not isinstance(sliced, bool):
        raise DataError(
            f"a task's pddl_params have object_sliced {sliced!r:.60}; set it to true or false"
        )
    return sliced is True


def _describe(task: Task) -> str:
    bare = f"sliced {noun(task.pickup)}" if task.sliced else noun(task.pickup)
    receptacle = task.receptacle
    text = _TEMPLATES[task.task_type].format(
        pickup=task.pickup,
        receptacle=receptacle,
        item=with_article(bare),
        items=f"slices of {noun(task.pickup)}" if task.sliced else plural(bare),
        bare=bare,
        where=f"{preposition(receptacle)} the {noun(receptacle)}" if receptacle else "",
        light=noun(task.light) if task.light else "",
        movable=with_article(noun(task.movable)) if task.movable else "",
    )
    return text.replace(" in it ", " on it ") if task.movable in _ONTO else text


def _describe_as_published(task: Task, draw: Random) -> str:
    names = {
        "obj": task.pickup,
        "recep": task.receptacle or "",
        "toggle": task.light or "",
        "mrecep": task.movable or "",
    }
    template = draw.choice(_PUBLISHED[task.task_type][task.sliced])
    return template.format(**{name: compact_name(value) for name, value in names.items()})
