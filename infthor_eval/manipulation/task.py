"""A task of manipulation: the settings of its file, and its episodes."""

import string
from dataclasses import dataclass
from typing import Any

from infthor_eval.episodes.task_settings import task_settings
from infthor_eval.episodes.tasks import EpisodeTask
from infthor_eval.errors import UsageError
from infthor_eval.household.wording import canonical_type, noun
from infthor_eval.manipulation.config import ArmTaskConfig
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import SUCCESS_RULES, Grasp
from infthor_eval.manipulation.kinds import (
    KIND_NAMES,
    Closing,
    Hand,
    ManipulationKind,
    PutCriterion,
    Stand,
)
from infthor_eval.manipulation.options import RADII, ManipulationOptions
from infthor_eval.manipulation.trajectories import ArmEpisode, ArmTrajectory, read_arm_trajectory
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.limiting import limit_items

_INSTRUCTIONS = {
    ManipulationKind.PICKUP: "pick up the {object}",
    ManipulationKind.PUT: "put the {object} in the {receptacle}",
}
_CHOICES = {
    "kind": tuple(ManipulationKind),
    "grasps": ("target", "all"),
    "hold": ("middle", "palm"),
    "stand": tuple(map(str, Stand)),
    "hand": tuple(map(str, Hand)),
    "closing": tuple(map(str, Closing)),
    "put_criterion": tuple(map(str, PutCriterion)),
}
# settings that are options too
_GIVEN = ("instruction", "stand", "hand", "closing", "put_criterion")


@dataclass(frozen=True, kw_only=True)
class ArmTaskSettings:
    """`dataset_kwargs` of a task file.

    Attributes:
        kind: "pickup" or "put".
        bundled: name of a set of trajectories in the package.
        instruction: instruction of a policy, with {object} and, for puts, {receptacle}; "short" is
            the kind alone.
        radius: radius of the hand's sphere, metres; AI2-THOR's own is 0.06, the published one 0.5.
        max_steps: maximum number of steps of one episode.
        image_size: width and height of the frames, pixels.
        field_of_view: field of view of the camera, degrees.
        grasps: whether the hand takes the "target" alone out of its sphere, or "all" objects in it.
        hold: where the object to put is held: in the "middle" of the sphere if there is room, or
            before the "palm".
        stand: where the agent stands at the start, see `Stand`.
        hand: height of its arm at the start of a pick-up, see `Hand`.
        closing: when a policy's hand closes in a pick-up, see `Closing`.
        put_criterion: when a put succeeds, see `PutCriterion`.
        gripper_threshold: value of a policy's gripper below which the hand closes; else it opens.
        translation_scale: see `Conversion`.
        max_step: see `Conversion`.
        rotation: see `Conversion`.
        return_to_start: see `Conversion`.
        reward: reward of a success.
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
    stand: str = Stand.EXPERT
    hand: str = Hand.REST
    closing: str = Closing.ASKED
    put_criterion: str = PutCriterion.AT_REST
    gripper_threshold: float = 0.5
    translation_scale: float = 1.0
    max_step: float = 0.1
    rotation: bool = True
    return_to_start: bool = True
    reward: float = 2.0

    @property
    def conversion(self) -> Conversion:
        """How a policy's steps become calls."""
        return Conversion(
            self.translation_scale, self.max_step, self.rotation, self.return_to_start
        )

    @property
    def grasp(self) -> Grasp:
        """How the hand closes and opens."""
        return Grasp(
            radius=self.radius,
            takes_all=self.grasps == "all",
            at_palm=self.hold == "palm",
            threshold=self.gripper_threshold,
            stand=Stand(self.stand),
            hand=Hand(self.hand),
            closing=Closing(self.closing),
        )

    @property
    def camera(self) -> tuple[int, float]:
        """Size of the frames in pixels, and field of view in degrees."""
        return self.image_size, self.field_of_view

    @property
    def camera_options(self) -> dict[str, Any]:
        """The same as options of `Simulator`."""
        return {
            "width": self.image_size,
            "height": self.image_size,
            "fieldOfView": self.field_of_view,
        }


def check_task_file(file: TaskFile) -> None:
    """Check a task file's settings; raises DataError if one is unknown or its value not allowed."""
    file.require("dataset_kwargs")
    task_settings(file, ArmTaskSettings, {}, _CHOICES)


class ManipulationTask(EpisodeTask[ArmTaskSettings, ArmTrajectory]):
    """A task file that was read, with its episodes, each with its trajectory."""

    def __init__(self, file: TaskFile, request: TaskRequest[ManipulationOptions]) -> None:
        """Check the file and find its episodes."""
        file.require("dataset_kwargs")
        overrides = {"radius": request.options.radius_metres}
        overrides |= {name: getattr(request.options, name) for name in _GIVEN}
        settings = task_settings(file, ArmTaskSettings, overrides, _CHOICES)
        self.kind = ManipulationKind(settings.kind)
        self._template = (
            _INSTRUCTIONS[self.kind] if settings.instruction is None else settings.instruction
        )
        _check_numbers(file.name, settings)
        self._check_instruction(file.name)
        super().__init__(file, request, settings, read_arm_trajectory)
        episodes = [
            (trajectory, episode)
            for trajectory in self.trajectories.trajectories
            for episode in trajectory.episodes
            if episode.kind == self.kind
        ]
        self.episodes = limit_items(
            episodes, lambda pair: pair[0].traj_id, request.seed, request.limit
        )
        if not self.episodes:
            raise UsageError(f"{self.name}: no trajectory there has a {KIND_NAMES[self.kind]}")

    def instruction(self, episode: ArmEpisode) -> str:
        """Return the instruction of an episode."""
        template = self._template
        if template == "short":
            return KIND_NAMES[self.kind]
        names = {"object": episode.object_type, "receptacle": episode.receptacle_type}
        return template.format(
            **{key: noun(canonical_type(name)) for key, name in names.items() if name is not None}
        )

    def config(self) -> ArmTaskConfig:
        """See `EpisodeTask`."""
        return ArmTaskConfig(
            **self._shared_config(trajectory for trajectory, _ in self.episodes),
            kind=self.kind,
            radius=self.settings.radius,
            instruction=self.settings.instruction,
            stand=self.settings.stand,
            hand=self.settings.hand,
            closing=self.settings.closing,
            rules=SUCCESS_RULES,
            put_criterion=PutCriterion(self.settings.put_criterion),
        )

    def _check_instruction(self, name: str) -> None:
        """Check that the instruction names the object, and all in braces can be filled in."""
        template = self._template
        known = {"object", "receptacle"} if self.kind == ManipulationKind.PUT else {"object"}
        try:
            parsed = [part for part in string.Formatter().parse(template) if part[1] is not None]
        except ValueError:
            parsed = []
        fields = {field for _, field, _, _ in parsed}
        is_plain = all(not spec and not conversion for _, _, spec, conversion in parsed)
        if template != "short" and ("object" not in fields or not fields <= known or not is_plain):
            raise UsageError(
                f"{name}: the instruction {template!r:.60} must have {{object}}"
                f"{' and may have {receptacle}' if len(known) > 1 else ''}, and nothing else in "
                f'braces; or be "short" for {KIND_NAMES[self.kind]!r} alone'
            )


def _check_numbers(name: str, settings: ArmTaskSettings) -> None:
    if settings.field_of_view >= 180:
        raise UsageError(f"{name}: field_of_view {settings.field_of_view} is not below 180 degrees")
    if settings.gripper_threshold > 1:
        raise UsageError(
            f"{name}: gripper_threshold {settings.gripper_threshold} is above 1, fully open"
        )
    if not RADII[0] <= settings.radius <= RADII[1]:
        raise UsageError(
            f"{name}: radius {settings.radius} is not within {RADII[0]} to {RADII[1]} metres"
        )
