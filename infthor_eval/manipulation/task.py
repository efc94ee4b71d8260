"""A task of manipulation: the settings of its file, and its episodes."""

import string
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from msgspec import Meta

from infthor_eval.episodes.task_settings import task_settings, with_options
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
from infthor_eval.manipulation.options import (
    ClosingName,
    HandName,
    Instruction,
    ManipulationOptions,
    PutCriterionName,
    Radius,
    StandName,
)
from infthor_eval.manipulation.trajectories import ArmEpisode, ArmTrajectory, read_arm_trajectory
from infthor_eval.quantities import MOST, Total
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.limiting import limit_items
from infthor_eval.settings import Setting

_INSTRUCTIONS = {
    ManipulationKind.PICKUP: "pick up the {object}",
    ManipulationKind.PUT: "put the {object} in the {receptacle}",
}
_Positive = Annotated[float, Meta(gt=0, lt=MOST)]


@dataclass(frozen=True, kw_only=True)
class ArmTaskSettings:
    """`dataset_kwargs` of a task file."""

    kind: Annotated[str, Setting(help='"pickup" or "put".', choices=tuple(ManipulationKind))] = (
        ManipulationKind.PICKUP
    )
    twins: Annotated[
        bool, Setting(help="Whether episodes are choices between two things, of arm twins.")
    ] = False
    bundled: Annotated[
        str | None, Setting(help="Name of a set of trajectories in the package.")
    ] = None
    instruction: Instruction | None = None
    radius: Radius = 0.5
    max_steps: Annotated[Total, Setting(help="Maximum number of steps of one episode.")] = 60
    image_size: Annotated[Total, Setting(help="Width and height of the frames, pixels.")] = 300
    field_of_view: Annotated[
        Annotated[float, Meta(gt=0, lt=180)],
        Setting(help="Field of view of the camera, degrees.", of="degrees"),
    ] = 60.0
    grasps: Annotated[
        str,
        Setting(
            help='Whether the hand takes the "target" alone out of its sphere, or "all" objects '
            "in it.",
            choices=("target", "all"),
        ),
    ] = "target"
    hold: Annotated[
        str,
        Setting(
            help='Where the object to put is held: in the "middle" of the sphere if there is '
            'room, or before the "palm".',
            choices=("middle", "palm"),
        ),
    ] = "middle"
    stand: StandName = Stand.EXPERT
    hand: HandName = Hand.REST
    closing: ClosingName = Closing.ASKED
    put_criterion: PutCriterionName = PutCriterion.AT_REST
    gripper_threshold: Annotated[
        Annotated[float, Meta(gt=0, le=1)],
        Setting(
            help="Value of a policy's gripper below which the hand closes; else it opens (1 is "
            "fully open)."
        ),
    ] = 0.5
    translation_scale: Annotated[_Positive, Setting(help="Factor of a policy's translations.")] = (
        1.0
    )
    max_step: Annotated[
        _Positive,
        Setting(help="Maximum length of a translation, metres; a longer one is shortened."),
    ] = 0.1
    rotation: Annotated[bool, Setting(help="Whether the wrist is turned.")] = True
    return_to_start: Annotated[
        bool,
        Setting(
            help="Whether the arm goes back after a collision (AI2-THOR's default), or stays "
            "where it collided."
        ),
    ] = True
    reward: Annotated[_Positive, Setting(help="Reward of a success.")] = 2.0

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
    task_settings(file, ArmTaskSettings)


class ManipulationTask(EpisodeTask[ArmTaskSettings, ArmTrajectory]):
    """A task file that was read, with its episodes, each with its trajectory."""

    def __init__(self, file: TaskFile, request: TaskRequest[ManipulationOptions]) -> None:
        """Check the file and find its episodes."""
        file.require("dataset_kwargs")
        self._options = request.options
        settings = with_options(task_settings(file, ArmTaskSettings), request.options)
        self.kind = ManipulationKind(settings.kind)
        self._template = (
            _INSTRUCTIONS[self.kind] if settings.instruction is None else settings.instruction
        )
        self._check_instruction(file.name)
        super().__init__(file, request, settings, read_arm_trajectory)
        episodes = [
            (trajectory, episode)
            for trajectory in self.trajectories.trajectories
            for episode in trajectory.episodes
            if episode.kind == self.kind and (episode.choice is not None) == settings.twins
        ]
        self.episodes = _limited(episodes, request)
        if not self.episodes:
            what = "choice between two things" if settings.twins else KIND_NAMES[self.kind]
            raise UsageError(f"{self.name}: no trajectory there has a {what}")

    def instruction(self, episode: ArmEpisode) -> str:
        """Return the instruction of an episode."""
        if episode.choice is not None:
            return episode.choice.instruction
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
            cameras=self._options.cameras if self._options.senses.wrist else None,
            state=self._options.state,
        )

    @property
    def tells_history(self) -> bool:
        """Whether a policy is told what happened before."""
        return self.settings.twins

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


def _limited(
    episodes: Sequence[tuple[ArmTrajectory, ArmEpisode]], request: TaskRequest[ManipulationOptions]
) -> list[tuple[ArmTrajectory, ArmEpisode]]:
    """Return the episodes that a limit selects; both choices of a pair, which count as two."""
    groups: dict[str, list[tuple[ArmTrajectory, ArmEpisode]]] = {}
    for trajectory, episode in episodes:
        alone = f"{trajectory.traj_id}/{episode.index}"
        key = alone if episode.choice is None else episode.choice.pair
        groups.setdefault(key, []).append((trajectory, episode))
    of_pairs = any(episode.choice is not None for _, episode in episodes)
    limit = request.limit and -(-request.limit // (1 + of_pairs))
    chosen = limit_items(
        list(groups.values()), lambda group: group[0][0].traj_id, request.seed, limit
    )
    return [episode for group in chosen for episode in group]
