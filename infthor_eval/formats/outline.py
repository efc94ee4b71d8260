"""Goals, actions and states of a trajectory, from its JSON, which some contexts show beside frames.

Only these fields are required, so that the reduced files of the published evaluation can be read.
"""

from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.reading import NOT_JSON, read_bytes

_SUFFIXES = (".json", ".txt")  # both hold JSON; the published scripts accept either


class _Call(msgspec.Struct):
    action: str
    object_id: str | None = msgspec.field(name="objectId", default=None)
    receptacle_id: str | None = msgspec.field(name="receptacleObjectId", default=None)

    @property
    def words(self) -> str:
        """The action with its object types: "PutObject Mug Fridge"."""
        return " ".join([self.action, *(object_id.partition("|")[0] for object_id in self._ids)])

    @property
    def object_types(self) -> list[str]:
        """Types of its objects; a slice has one of its own."""
        return list(map(object_type_of, self._ids))

    @property
    def _ids(self) -> list[str]:
        return [object_id for object_id in (self.object_id, self.receptacle_id) if object_id]


class _LowAction(msgspec.Struct):
    api_action: _Call


class _Plan(msgspec.Struct):
    low_actions: list[_LowAction] = []


class _Goal(msgspec.Struct):
    task_desc: str = ""


class _Range(msgspec.Struct):
    low_pddl_idx: tuple[int, int]


class _Scene(msgspec.Struct):
    floor_plan: str | None = None
    scene_num: int | str | None = None

    @property
    def name(self) -> str | None:
        """The floor plan; from its number alone, where the published saver leaves it empty."""
        if self.floor_plan or self.scene_num is None:
            return self.floor_plan
        return f"FloorPlan{str(self.scene_num).removeprefix('FloorPlan')}"


class Outline(msgspec.Struct):
    """The part of a trajectory that contexts show.

    Attributes:
        plan: low-level actions.
        sub_tasks: goals.
        sub_trajs: range [first, end) of the low-level actions of each goal.
        long_horizon_task: the final task.
        state_summary: state in words after each low-level action.
        scene: where it is; None if the file does not say.
    """

    plan: _Plan
    sub_tasks: list[_Goal] = []
    sub_trajs: list[_Range] = []
    long_horizon_task: _Goal | None = None
    state_summary: dict[int, str] | None = None
    scene: _Scene | None = None

    @property
    def floor_plan(self) -> str | None:
        """Name of the scene; None if the file does not say."""
        return self.scene.name if self.scene else None

    @property
    def actions(self) -> list[str]:
        """Every low-level action in words."""
        return [action.api_action.words for action in self.plan.low_actions]

    @property
    def interactions(self) -> list[tuple[str, list[str]]]:
        """Name and object types of every low-level action."""
        calls = [action.api_action for action in self.plan.low_actions]
        return [(call.action, call.object_types) for call in calls]

    @property
    def tasks(self) -> list[tuple[str, range]]:
        """Goals with the ranges of their actions, paired one to one as in the published code."""
        # Published files repeat the final task as the last sub-task. Ours do not, so it is appended
        # here.
        goals = [sub_task.task_desc for sub_task in self.sub_tasks]
        if len(self.sub_trajs) == len(goals) + 1 and self.long_horizon_task is not None:
            goals.append(self.long_horizon_task.task_desc)
        ranges = [range(*part.low_pddl_idx) for part in self.sub_trajs]
        return list(zip(goals, ranges, strict=False))


def find_outline(folder: Path, traj_id: str) -> Path | None:
    """Return the file of a trajectory in a folder of trajectories, or None if there is none."""
    paths = (folder / f"{traj_id}{suffix}" for suffix in _SUFFIXES)
    return next((path for path in paths if path.is_file()), None)


def read_outline(path: SetPath) -> Outline:
    """Read a trajectory's file."""
    content = read_bytes(path, "restore it")
    with wrap_errors(f"{path}: not a trajectory", "restore it", catch=NOT_JSON):
        outline = msgspec.json.decode(content, type=Outline, strict=False)
    ranges = [part.low_pddl_idx for part in outline.sub_trajs]
    if any(not 0 <= first <= end <= len(outline.plan.low_actions) for first, end in ranges):
        raise DataError(f"{path}: sub_trajs reach outside the low-level actions; restore it")
    return outline


def read_states(path: SetPath) -> dict[int, str]:
    """Read a `state_summary.json`: states by low-level action; empty if there is no such file."""
    if not path.exists():
        return {}
    content = read_bytes(path, "replay it again")
    with wrap_errors(
        f"{path}: not a mapping of low-level actions to states", "replay it again", catch=NOT_JSON
    ):
        return msgspec.json.decode(content, type=dict[int, str], strict=False)
