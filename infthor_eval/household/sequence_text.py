"""A trajectory as the text on which models are trained and prompted (`traj.txt`).

Each task has `<|goal|>Your main goal: ...<|goal|>` and the frame at its start, each sub-goal `<|plan|>Plan:
...<|plan|>`, and each action `<|act|>...<|act|><image>`.
"""

from infthor_eval.formats.step_log import Step
from infthor_eval.formats.trajectory import HighAction, SubTask, Trajectory

__all__ = ["ACT", "MARKS", "action_part", "goal_part", "goal_text", "plan_part", "plan_text", "sequence_text"]

ACT, _PLAN, _GOAL = "<|act|>", "<|plan|>", "<|goal|>"
MARKS = (ACT, _PLAN, _GOAL)  # special tokens of models that are trained on sequences

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
}


def plan_text(high: HighAction) -> str:
    """Return a sub-goal in words ("put the mug in the fridge"), or its name if it has no template."""
    action = high.discrete_action
    template = _PLANS.get(action.action)
    if template is None:  # not formatted: the name is from a file and may have braces
        return action.action
    names = [str(name) for name in action.args] if isinstance(action.args, list) else []
    return template.format(*names) if len(names) >= template.count("{") else action.action


def goal_text(trajectory: Trajectory, task: SubTask | None) -> str:
    """Return the goal of a task, in ALFRED's trajectories that of the first annotator."""
    if task is not None:
        return task.task_desc
    annotations = (trajectory.turk_annotations or {}).get("anns") or [{}]
    return str(annotations[0].get("task_desc", trajectory.task_type or ""))


def goal_part(goal: str) -> str:
    """Return a goal as part of the sequence; the frame at its start follows."""
    return f"{_GOAL}Your main goal: {goal}{_GOAL}"


def plan_part(plan: str) -> str:
    """Return a plan as part of the sequence; its actions follow."""
    return f"{_PLAN}Plan: {plan}{_PLAN}"


def action_part(action: str) -> str:
    """Return an action as part of the sequence; the frame after it follows. Models continue after the first mark."""
    return f"{ACT}{action}{ACT}"


def sequence_text(trajectory: Trajectory, steps: list[Step]) -> str:
    """Return the whole trajectory as text, from its replay's log; of several frames of an action the last counts."""
    starts: dict[int, int | None] = {item.low_pddl_idx[0]: item.sub_traj_idx for item in trajectory.sub_trajs}
    starts = starts or {0: None}
    plans = {high.high_idx: plan_text(high) for high in trajectory.plan.high_pddl}
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
        parts.append(f"{action_part(step.action)}<image>")
    return "".join(parts)


def _task(trajectory: Trajectory, index: int | None) -> SubTask | None:
    tasks = trajectory.sub_tasks
    return tasks[index] if index is not None and index < len(tasks) else None
