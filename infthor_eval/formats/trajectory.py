"""Trajectory JSON: ∞-THOR's, ours, and ALFRED's `traj_data.json`, their single-task predecessor.

One set of types serves all three; `_normalize` converts what the published saver writes
differently. Unknown fields are ignored, so code that passes a trajectory on keeps
`TrajectorySource.raw`. Coordinates are metres, except x and z of `PlannerAction.location`, which
are grid cells of 0.25 m. Angles are degrees.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.reading import lines_of, read_bytes
from infthor_eval.formats.twins import ArmChoice, TwinWorld
from infthor_eval.storage.digests import digest
from infthor_eval.storage.limits import OBJECT_POSES

_SUFFIXES = (".json", ".jsonl", ".jsonl.gz")
# Other JSON files of what is replayed, and of a folder of the published generator.
_NOT_TRAJECTORIES = {
    "expert_log.json",
    "metadata.json",
    "replay.json",
    "set.json",
    "state_summary.json",
    "status.json",
    "twins.jsonl",
    "timeline.json",
}
_HINT = "restore the file or leave it out"
_ALWAYS: dict[str, Callable[[], Any]] = {
    "long_horizon_task": dict,
    "sub_tasks": list,
    "sub_trajs": list,
}


class _Fields(msgspec.Struct, omit_defaults=True):
    """Base class of the parts; default values are not written."""


class InitAction(_Fields, omit_defaults=False):
    """The agent's first pose; `rotation` is a number up to AI2-THOR 2.1.0 and a vector after it."""

    x: float
    y: float
    z: float
    rotation: float | dict[str, float] = 0.0
    horizon: float = 0.0
    action: str = "TeleportFull"
    rotate_on_teleport: bool = msgspec.field(name="rotateOnTeleport", default=True)

    @property
    def yaw(self) -> float:
        """Rotation about the vertical axis, degrees."""
        return (
            self.rotation if isinstance(self.rotation, int | float) else self.rotation.get("y", 0.0)
        )


class ObjectPose(_Fields):
    """The pose of an object in the initial scene; `name` is Unity's, without "(Clone)"."""

    name: str = msgspec.field(name="objectName")
    position: dict[str, float]
    rotation: dict[str, float] = msgspec.field(
        default_factory=lambda: {"x": 0.0, "y": 0.0, "z": 0.0}
    )


class Toggle(_Fields, omit_defaults=False):
    """The on/off state of all objects of a type in the initial scene."""

    object_type: str = msgspec.field(name="objectType")
    is_on: bool = msgspec.field(name="isOn")


class StartState(_Fields):
    """The state of one object in the initial scene, by Unity's name: our addition, for twins.

    Attributes:
        name: name of the object, as in `ObjectPose`.
        is_open: True or False to open or close it; None to leave it as it is.
        is_disabled: True to take it out of the scene.
    """

    name: str = msgspec.field(name="objectName")
    is_open: bool | None = msgspec.field(name="isOpen", default=None)
    is_disabled: bool = msgspec.field(name="isDisabled", default=False)


class Scene(_Fields, omit_defaults=False):
    """The initial state of a trajectory: scene, poses and states of objects, pose of the agent.

    `object_states` and `house`, the JSON of a ProcTHOR house in place of a scene that simulators
    know by `floor_plan`, are ours, and not written where they are empty, as in published files.
    """

    floor_plan: str
    init_action: InitAction
    scene_num: int | str = 0
    object_poses: list[ObjectPose] = msgspec.field(default_factory=list)
    object_toggles: list[Toggle] = msgspec.field(default_factory=list)
    dirty_and_empty: bool = False
    random_seed: int = 0
    object_states: list[StartState] | msgspec.UnsetType = msgspec.UNSET
    house: dict[str, Any] | msgspec.UnsetType = msgspec.UNSET


class ApiAction(_Fields):
    """One recorded call of the simulator, with object ids of the recording AI2-THOR version."""

    action: Annotated[str, Meta(pattern=r"\S")]
    object_id: str | None = msgspec.field(name="objectId", default=None)
    receptacle_id: str | None = msgspec.field(name="receptacleObjectId", default=None)
    move_magnitude: float | None = msgspec.field(name="moveMagnitude", default=None)
    degrees: float | None = None
    force_action: bool | None = msgspec.field(name="forceAction", default=None)
    place_stationary: bool | None = msgspec.field(name="placeStationary", default=None)


class DiscreteAction(_Fields, omit_defaults=False):
    """The action in words; `args` is a list of names in sub-goals, a dict in low-level actions."""

    action: str
    args: dict[str, Any] | list[Any] = msgspec.field(default_factory=list)

    @property
    def box(self) -> tuple[int, int, int, int] | None:
        """Recorded box [xmin, ymin, xmax, ymax] of the object, in pixels of the 300x300 frame."""
        box = self.args.get("bbox") if isinstance(self.args, dict) else None
        return tuple(box) if isinstance(box, list) and len(box) == 4 else None


class LowAction(_Fields, omit_defaults=False):
    """One low-level action; `inserted` is "look_around" if it only moves the camera for frames."""

    api_action: ApiAction
    high_idx: int = 0
    discrete_action: DiscreteAction | None = None
    low_idx: int | None = None
    inserted: str | msgspec.UnsetType | None = msgspec.UNSET


class PlannerAction(_Fields):
    """One sub-goal in the planner's form; `location` is "loc|x|z|rotation|horizon"."""

    action: str
    location: str | None = None
    object_id: str | None = msgspec.field(name="objectId", default=None)
    receptacle_id: str | None = msgspec.field(name="receptacleObjectId", default=None)
    clean_id: str | None = msgspec.field(name="cleanObjectId", default=None)
    value: int | None = None


class HighAction(_Fields, omit_defaults=False):
    """One sub-goal."""

    high_idx: int
    discrete_action: DiscreteAction
    planner_action: PlannerAction


class ExpertPlan(_Fields, omit_defaults=False):
    """The expert's plan: sub-goals and low-level actions."""

    low_actions: list[LowAction]
    high_pddl: list[HighAction] = msgspec.field(default_factory=list)


class TaskInfo(_Fields, omit_defaults=False):
    """A task's type (`goal`) and its object types."""

    goal: str
    pickup: str | None = None
    movable: str | None = None
    receptacle: str | None = None
    scene: str | int | None = None


class SubTask(_Fields, omit_defaults=False):
    """One task of a trajectory, or its final one."""

    task_info: TaskInfo
    task_desc: str = ""
    pddl_params: dict[str, Any] = msgspec.field(default_factory=dict)


class SubTrajectory(_Fields, omit_defaults=False):
    """Ranges [first, end) of the sub-goals and low-level actions of one sub-task."""

    sub_traj_idx: int
    high_pddl_idx: tuple[int, int]
    low_pddl_idx: tuple[int, int]
    subgoal: Any = None


class Trajectory(_Fields):
    """One trajectory; not all formats have the fields below `plan` (see the module's docstring).

    `twin` and `arm_choices` are our additions, for pairs of twins with a final task, and of arms.
    """

    scene: Scene
    plan: ExpertPlan
    traj_id: str = ""
    task_id: str = ""
    task_type: str | None = None
    pddl_params: dict[str, Any] | None = None
    sub_tasks: list[SubTask] = msgspec.field(default_factory=list)
    sub_trajs: list[SubTrajectory] = msgspec.field(default_factory=list)
    long_horizon_task: SubTask | None = None
    object_log: list[Any] = msgspec.field(default_factory=list)
    images: list[Any] = msgspec.field(default_factory=list)
    state_summary: dict[str, str] | None = None
    retrieved_image: dict[str, Any] | None = None
    turk_annotations: dict[str, Any] | None = None
    gen_info: dict[str, Any] | None = None
    twin: TwinWorld | None = None
    arm_choices: list[ArmChoice] = msgspec.field(default_factory=list)

    @property
    def tasks(self) -> list[SubTask]:
        """The tasks of its parts; some files have the final one apart from the others."""
        final = self.long_horizon_task
        if final is not None and len(self.sub_trajs) == len(self.sub_tasks) + 1:
            return [*self.sub_tasks, final]
        return list(self.sub_tasks)


@dataclass(frozen=True)
class TrajectorySource:
    """A trajectory in a file, not yet decoded: a malformed one does not prevent reading others.

    `line` is its line in the file, from 1; None if the file holds only this trajectory.
    """

    path: SetPath
    line: int | None
    raw: bytes

    @property
    def place(self) -> str:
        """File and line, for messages."""
        return str(self.path) if self.line is None else f"{self.path}:{self.line}"

    @property
    def digest(self) -> str:
        """Hash of the trajectory's JSON, by which replays are recognised."""
        return digest(self.raw.strip())

    def read(self) -> Trajectory:
        """Decode and check the trajectory; a missing `traj_id` becomes the task's id or the file's.

        Raises:
            DataError: the text is not JSON, not of the documented form, or has more object poses
                than the limit.
        """
        catch = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
        with wrap_errors(f"{self.place}: not a trajectory", _HINT, catch=catch):
            trajectory = msgspec.convert(_normalize(msgspec.json.decode(self.raw)), type=Trajectory)
        n_poses = len(trajectory.scene.object_poses)
        if n_poses > OBJECT_POSES.value:
            raise DataError(
                f"{self.place}: {n_poses:,} object_poses are too many for a scene; "
                f"{OBJECT_POSES.hint}"
            )
        stem = self.path.name.split(".")[0]
        in_file = stem if self.line is None else f"{stem}-{self.line}"
        trajectory.traj_id = trajectory.traj_id or trajectory.task_id or in_file
        return trajectory


def read_trajectory(path: SetPath) -> Trajectory:
    """Read a file with one trajectory; raises as `TrajectorySource.read`."""
    return TrajectorySource(path, None, read_bytes(path, _HINT)).read()


def iter_sources(path: SetPath) -> Iterator[TrajectorySource]:
    """Yield trajectories, not decoded, of a file (`.json`, `.jsonl`, `.jsonl.gz`) or of a folder.

    They come in the order of file names and lines.

    Raises:
        DataError: a file is missing, unreadable or of another kind, or the folder has no such file.
    """
    if isinstance(path, Path) and path.is_dir():
        for file in trajectory_files(path):
            yield from iter_sources(file)
    elif path.name.endswith(".json"):
        yield TrajectorySource(path, None, read_bytes(path, _HINT))
    elif isinstance(path, Path) and path.name.endswith((".jsonl", ".jsonl.gz")):
        yield from (TrajectorySource(path, line, raw) for line, raw in lines_of(path, _HINT))
    else:
        raise DataError(
            f"{path}: not a trajectory file; give a {', '.join(_SUFFIXES)} file or a folder"
        )


def is_trajectory_file(path: Path) -> bool:
    """Return True for a file whose name is one of a trajectory file."""
    return path.is_file() and path.name.endswith(_SUFFIXES)


def trajectory_files(path: Path) -> list[Path]:
    """Return the sorted trajectory files of a folder, or the path itself if it is a file.

    Raises:
        DataError: the folder has no such file.
    """
    if not path.is_dir():
        return [path]
    named = (file for file in sorted(path.rglob("*")) if file.name.endswith(_SUFFIXES))
    # Not only plain files: reading a pipe or device then raises the error that says what it is.
    files = [file for file in named if not file.is_dir() and file.name not in _NOT_TRAJECTORIES]
    if not files:
        raise DataError(f"{path}: no {', '.join(_SUFFIXES)} file in this folder; give another path")
    return files


def iter_trajectories(path: Path) -> Iterator[Trajectory]:
    """Yield the decoded trajectories of a file or folder, see `iter_sources`.

    Raises:
        DataError: as `iter_sources` and `TrajectorySource.read`; the message names file and line.
    """
    for source in iter_sources(path):
        yield source.read()


def encode_trajectory(trajectory: Trajectory) -> bytes:
    """Return the trajectory as indented JSON, with the keys that the published saver writes."""
    document = {name: empty() for name, empty in _ALWAYS.items()} | msgspec.to_builtins(trajectory)
    return msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"


def _normalize(document: Any) -> Any:
    """Return a decoded file in the form of `Trajectory`.

    The published saver leaves `floor_plan` empty (`scene_num` has the number), writes null for
    `dirty_and_empty`, and an empty `long_horizon_task` if there is no final task.
    """
    if not isinstance(document, dict):
        return document  # `msgspec.convert` refuses it and says what it is
    normalized = {
        name: value
        for name, value in document.items()
        if (name, value) != ("long_horizon_task", {})
    }
    scene = normalized.get("scene")
    if isinstance(scene, dict):
        scene = {
            name: value
            for name, value in scene.items()
            if (name, value) != ("dirty_and_empty", None)
        }
        if not scene.get("floor_plan") and "scene_num" in scene:
            scene["floor_plan"] = f"FloorPlan{str(scene['scene_num']).removeprefix('FloorPlan')}"
        normalized["scene"] = scene
    return normalized
