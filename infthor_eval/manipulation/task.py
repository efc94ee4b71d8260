"""A task of manipulation: what its file says, and which episodes of which trajectories it is about."""

import string
from dataclasses import dataclass
from typing import Any

from infthor_eval.episodes.task_settings import task_settings
from infthor_eval.episodes.trajectory_sets import TrajectorySet, find_trajectories
from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.digests import digest
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource
from infthor_eval.household.wording import canonical_type, noun
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import Grasp
from infthor_eval.manipulation.history import Errand, errands_of
from infthor_eval.manipulation.kinds import KIND_NAMES, ManipulationKind
from infthor_eval.manipulation.options import RADII, ManipulationOptions
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.limiting import limited

__all__ = ["ArmCourse", "ManipulationTask", "TaskSettings"]

_WORDS = {ManipulationKind.PICKUP: "pick up the {object}", ManipulationKind.PUT: "put the {object} in the {receptacle}"}
_HALF_TURN = 180.0  # degrees
_CHOICES = {"kind": tuple(ManipulationKind), "grasps": ("target", "all"), "hold": ("middle", "palm")}


@dataclass(frozen=True, kw_only=True)
class TaskSettings:
    """What `dataset_kwargs` of a task can say.

    Attributes:
        kind: "pickup" or "put".
        bundled: name of a set of trajectories that comes with the package.
        instruction: what a policy is told, with {object} and, of puts, {receptacle}; "short" is the kind alone.
        radius: of the hand's sphere, metres; AI2-THOR's own is 0.06, the published one 0.5.
        max_steps: of one episode.
        image_size: width and height of the frames, pixels.
        field_of_view: of the camera, degrees.
        grasps: whether the hand takes the "target" alone out of its sphere, or "all" that is in it.
        hold: where what is to be put is held: in the "middle" of the sphere where there is room, or before the "palm".
        gripper_threshold: of a policy's gripper; below it the hand closes, else it opens.
        translation_scale: see `Conversion`.
        max_step: see `Conversion`.
        rotation: see `Conversion`.
        return_to_start: see `Conversion`.
        reward: of a success.
    """

    kind: str = ManipulationKind.PICKUP
    bundled: str | None = None
    instruction: str | None = None
    radius: float = 0.5
    max_steps: int = 60
    image_size: int = 300
    field_of_view: float = 60.0
    grasps: str = "target"
    hold: str = "middle"
    gripper_threshold: float = 0.5
    translation_scale: float = 1.0
    max_step: float = 0.1
    rotation: bool = True
    return_to_start: bool = True
    reward: float = 2.0


@dataclass(frozen=True)
class ArmCourse:
    """A trajectory out of which episodes are cut.

    Attributes:
        trajectory: the trajectory.
        errands: its pick-ups and puts.
        digest: of its file.
    """

    trajectory: Trajectory
    errands: tuple[Errand, ...]
    digest: str

    @property
    def traj_id(self) -> str:
        """The trajectory's name."""
        return self.trajectory.traj_id


class ManipulationTask:
    """A task file, read."""

    def __init__(self, file: TaskFile, request: TaskRequest[ManipulationOptions]) -> None:
        """Check the file and find its trajectories.

        Raises:
            UsageError: an option that does not fit, or there are no trajectories.
            DataError: the file or all of its trajectories are not what they should be.
        """
        file.require("dataset_kwargs")
        self.file = file
        self.name = file.name
        options = request.options
        told = {"radius": options.radius_metres, "instruction": options.instruction}
        self.settings = task_settings(file, TaskSettings, told, _CHOICES)
        self.kind = ManipulationKind(self.settings.kind)
        self._check()
        self.conversion = Conversion(
            self.settings.translation_scale,
            self.settings.max_step,
            self.settings.rotation,
            self.settings.return_to_start,
        )
        self.grasp = Grasp(
            radius=self.settings.radius,
            takes_all=self.settings.grasps == "all",
            at_palm=self.settings.hold == "palm",
            threshold=self.settings.gripper_threshold,
        )
        self.camera = self.settings.image_size, self.settings.field_of_view
        data = str(request.data) if request.data is not None else None
        self.courses: TrajectorySet[ArmCourse] = find_trajectories(data, self.settings.bundled, _course)
        every = [(course, errand) for course in self.courses.found for errand in course.errands]
        of_kind = [(course, errand) for course, errand in every if errand.kind == self.kind]
        self.episodes = limited(of_kind, lambda episode: episode[0].traj_id, request.seed, request.limit)
        if not self.episodes:
            raise UsageError(f"{self.name}: no trajectory there has a {KIND_NAMES[self.kind]}")

    def instruction(self, errand: Errand) -> str:
        """What a policy is told."""
        template = self._template
        if template == "short":
            return KIND_NAMES[self.kind]
        names = {"object": errand.object_type, "receptacle": errand.receptacle_type}
        return template.format(**{key: noun(canonical_type(name)) for key, name in names.items() if name is not None})

    def identity(self) -> dict[str, Any]:
        """What its numbers depend on, as JSON values."""
        used = {course.traj_id: course.digest for course, _ in self.episodes}
        return {
            "config": dict(self.file.settings),
            "kind": str(self.kind),
            "radius": self.settings.radius,
            "instruction": self.settings.instruction,
            "trajectories": used,
            "broken": [list(item) for item in self.courses.broken],
        }

    @property
    def _template(self) -> str:
        return _WORDS[self.kind] if self.settings.instruction is None else self.settings.instruction

    def _check(self) -> None:
        """Refuse numbers that no hand and no camera has, and words that do not tell the object.

        Raises:
            UsageError: of any of them.
        """
        if self.settings.field_of_view >= _HALF_TURN:
            raise UsageError(f"{self.name}: field_of_view {self.settings.field_of_view} is not below 180 degrees")
        if self.settings.gripper_threshold > 1:
            raise UsageError(f"{self.name}: gripper_threshold {self.settings.gripper_threshold} is above 1, fully open")
        if not RADII[0] <= self.settings.radius <= RADII[1]:
            raise UsageError(
                f"{self.name}: radius {self.settings.radius} is not within {RADII[0]} to {RADII[1]} metres"
            )
        template = self._template
        known = {"object", "receptacle"} if self.kind == ManipulationKind.PUT else {"object"}
        try:
            fields = {name for _, name, form, turn in string.Formatter().parse(template) if name is not None}
            plain = all(not form and not turn for _, _, form, turn in string.Formatter().parse(template))
        except ValueError:
            fields, plain = set(), False
        if template != "short" and ("object" not in fields or not fields <= known or not plain):
            raise UsageError(
                f"{self.name}: the instruction {template!r:.60} must have {{object}}"
                f"{' and may have {receptacle}' if len(known) > 1 else ''}, and nothing else in braces; "
                f'or be "short" for {KIND_NAMES[self.kind]!r} alone'
            )


def _course(source: TrajectorySource) -> ArmCourse:
    trajectory = source.read()
    try:
        errands = errands_of(trajectory)
    except DataError as error:
        raise DataError(f"{source.place}: {error}") from error
    return ArmCourse(trajectory, tuple(errands), digest(source.raw.strip()))
