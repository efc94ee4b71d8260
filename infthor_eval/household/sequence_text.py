"""A trajectory as the text on which models are trained and prompted (`traj.txt`).

Each task has `<|goal|>Your main goal: ...<|goal|>` and the frame at its start, each sub-goal
`<|plan|>Plan: ...<|plan|>`, and each action `<|act|>...<|act|><image>`.
"""

from collections.abc import Callable
from typing import TypeVar

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import Step
from infthor_eval.formats.trajectory import ApiAction, HighAction, SubTask, Trajectory
from infthor_eval.thor.actions import text_of

_Described = TypeVar("_Described")
ACT = "<|act|>"
_PLAN = "<|plan|>"
_GOAL = "<|goal|>"
MARKS = (ACT, _PLAN, _GOAL)  # special tokens of models that are trained on sequences

# In the order in which the published script looks for them in a sub-goal's name.
_PLANS = {
    "GotoLocation": "go to the {0}",
    "OpenObject": "open the {0}",
    "CloseObject": "close the {0}",
    "PickupObject": "pick up the {0}",
    "PutObject": "put the {0} in the {1}",
    "CleanObject": "wash the {0}",
    "HeatObject": "heat the {0}",
    "CoolObject": "cool the {0}",
    "ToggleObject": "toggle {0}",
    "SliceObject": "slice the {0}",
    "End": "<<STOP>>",
}
_PLAIN_ACTIONS = {"RotateLeft", "RotateRight", "MoveAhead", "LookUp", "LookDown", "NoOp"}
_OBJECT_ACTIONS = {
    "OpenObject",
    "CloseObject",
    "PickupObject",
    "PutObject",
    "ToggleObjectOn",
    "ToggleObjectOff",
    "SliceObject",
}


def plan_text(high: HighAction, words: Words) -> str:
    """Return a sub-goal in words.

    `Words.PUBLISHED` are those of the published script (`get_templated_high_pddl_desc`): names out
    of the ids in `planner_action` ("put the Mug in the Sink"), in GotoLocation the argument; a
    sub-goal without a template is empty. `Words.NATURAL` are the arguments ("put the mug in the
    sink"); a sub-goal without a template, or without arguments, has its name.
    """
    return _published_plan(high) if words is Words.PUBLISHED else _natural_plan(high)


def _natural_plan(high: HighAction) -> str:
    action = high.discrete_action
    template = _PLANS.get(action.action)
    if template is None:  # not formatted: the name is from a file and may have braces
        return action.action
    names = [str(name) for name in action.args] if isinstance(action.args, list) else []
    return template.format(*names) if len(names) >= template.count("{") else action.action


def _published_plan(high: HighAction) -> str:
    kind = high.discrete_action.action
    args = high.discrete_action.args
    template = next((text for name, text in _PLANS.items() if name in kind), None)
    names = _published_names(high)
    if template is None or template == _PLANS["End"]:
        return template or ""
    if template == _PLANS["GotoLocation"]:
        names = args[:1] if isinstance(args, list) else []
    needed = names[: template.count("{")]
    if len(needed) < template.count("{") or None in needed:
        missing = "place" if template == _PLANS["GotoLocation"] else "object"
        raise DataError(
            f"sub-goal {high.high_idx} ({kind:.40}) names no {missing}, which the published words "
            "need; take --words natural"
        )
    return template.format(*needed)


def _published_names(high: HighAction) -> list[str | None]:
    """Return the names of object and receptacle; PutObject without an object takes both from its
    arguments."""
    action = high.discrete_action
    planner = high.planner_action
    names: list[str | None] = [None, None]
    if planner.object_id is None and action.action == "PutObject":
        args = action.args if isinstance(action.args, list) else []
        if len(args) < 2:
            raise DataError(
                f"sub-goal {high.high_idx} (PutObject) names no object; take --words natural"
            )
        names = [str(args[0]), str(args[1])]
    ids = (planner.object_id, planner.receptacle_id)
    return [
        old if key is None else Words.PUBLISHED.name_of(key)
        for old, key in zip(names, ids, strict=True)
    ]


def action_text(action: ApiAction, words: Words) -> str:
    """Return a recorded low-level action in words ("PutObject Mug Sink").

    `Words.PUBLISHED` are those of the published script (`serialize_action`): what follows an
    underscore in the name is cut, and a missing id leaves its place holder.
    """
    if words is Words.NATURAL:
        return str(text_of(action.action, action.object_id, action.receptacle_id))
    name = action.action.split("_")[0]
    if name in _PLAIN_ACTIONS:
        return name
    if name not in _OBJECT_ACTIONS:
        raise DataError(
            f"the published words do not know the action {name!r:.40}; take --words natural"
        )
    holes = [(action.object_id, "[object]"), (action.receptacle_id, "[receptacle]")]
    names = [
        hole if key is None else words.name_of(key)
        for key, hole in holes[: 1 + (name == "PutObject")]
    ]
    return " ".join((name, *names))


def goal_text(trajectory: Trajectory, task: SubTask | None) -> str:
    """Return the goal of a task, in ALFRED's trajectories that of the first annotator."""
    if task is not None:
        return task.task_desc
    annotations = (trajectory.turk_annotations or {}).get("anns") or [{}]
    return str(annotations[0].get("task_desc", trajectory.task_type or ""))


def goal_part(goal: str) -> str:
    """Return a goal as part of the sequence; the frame at its start follows."""
    return f"{_GOAL}Your main goal: {goal}{_GOAL}"


def task_goal_part(goal: str) -> str:
    """Return a goal in the words of the published Qwen2.5-VL trainer, which differ from those of
    evaluation."""
    return f"{_GOAL}Your task goal: {goal}{_GOAL}"


def plan_part(plan: str) -> str:
    """Return a plan as part of the sequence; its actions follow."""
    return f"{_PLAN}Plan: {plan}{_PLAN}"


def action_part(action: str) -> str:
    """Return an action as part of the sequence; the frame after it follows. Models continue after
    the first mark."""
    return f"{ACT}{action}{ACT}"


def sequence_text(trajectory: Trajectory, steps: list[Step]) -> str:
    """Return the trajectory as text, from its replay's log; of an action's frames the last counts.

    The words are the published ones. A sub-goal or action that has none keeps its natural words, so
    that a trajectory is never without its text.
    """
    starts: dict[int, int | None] = {
        part.low_pddl_idx[0]: part.sub_traj_idx for part in trajectory.sub_trajs
    }
    starts = starts or {0: None}
    plans = {high.high_idx: _in_some_words(plan_text, high) for high in trajectory.plan.high_pddl}
    actions = [_in_some_words(action_text, low.api_action) for low in trajectory.plan.low_actions]
    parts: list[str] = []
    sub_goal: int | None = None
    for step in steps:
        if step.action is None:  # the first frame, or one of several during an action
            continue
        if step.step in starts:
            task = _task(trajectory, starts[step.step])
            parts.append(f"{goal_part(goal_text(trajectory, task))}<image>")
        if step.high_idx is not None and step.high_idx != sub_goal:
            sub_goal = step.high_idx
            parts.append(plan_part(plans.get(sub_goal, "")))
        parts.append(f"{action_part(actions[step.step])}<image>")
    return "".join(parts)


def _in_some_words(text_in: Callable[[_Described, Words], str], described: _Described) -> str:
    try:
        return text_in(described, Words.PUBLISHED)
    except DataError:
        return text_in(described, Words.NATURAL)


def _task(trajectory: Trajectory, index: int | None) -> SubTask | None:
    tasks = trajectory.sub_tasks
    return tasks[index] if index is not None and index < len(tasks) else None
