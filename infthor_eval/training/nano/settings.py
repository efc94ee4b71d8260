"""Recipe of the small model."""

from collections.abc import Iterable

import msgspec

from infthor_eval.formats.object_ids import Words

__all__ = ["NanoRecipe", "QuestionSettings", "ReadingSettings", "SceneSettings", "VisionSettings"]

_COUNTS = (
    "text_steps",
    "joint_steps",
    "text_plans_per_step",
    "windows_per_step",
    "plans_per_step",
    "joint_text_plans_per_step",
)


_GRIDS = (2, 4)


def _require_counts(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if getattr(settings, name) < 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use 1 or more")


def _require_shares(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if not 0 <= getattr(settings, name) <= 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use a number between 0 and 1")


def _require_width(settings: "NanoRecipe | VisionSettings") -> None:
    if settings.hidden < 1 or settings.hidden % 32:
        raise ValueError(f"hidden is {settings.hidden}; use a multiple of 32")


class SceneSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Procedural scenes for training.

    Attributes:
        kinds: kinds of rooms.
        first: number of the first scene of each kind; the scenes of the bundled sets have lower
            numbers.
        count: scenes of each kind.
        min_steps: fewest steps of a trajectory.
        twins: scenes of each kind, from the first one, whose trajectories also get twins: the same
            episode with one thing changed. They take ten times as long to make.
        twins_per_edit: twins of one kind of edit and trajectory, at most.
    """

    kinds: tuple[str, ...] = ("kitchen", "living-room", "bedroom", "bathroom")
    first: int = 101
    count: int = 24
    min_steps: int = 70
    twins: int = 0
    twins_per_edit: int = 1

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        _require_counts(self, ("count", "min_steps", "twins_per_edit"))
        if not 0 <= self.twins <= self.count:
            raise ValueError(f"twins is {self.twins}; use 0 to count, which is {self.count}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all scenes."""
        return self._first_of_each(self.count)

    @property
    def names_with_twins(self) -> tuple[str, ...]:
        """Names of the scenes whose trajectories get twins."""
        return self._first_of_each(self.twins)

    def _first_of_each(self, n: int) -> tuple[str, ...]:
        return tuple(f"{kind}-{self.first + at}" for kind in self.kinds for at in range(n))


class VisionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The vision tower and the first stage, in which it learns which objects frames show where.

    Attributes:
        hidden: width of the tower.
        layers: layers of the tower.
        grid: tokens along each side of a frame, 2 or 4: a token merges four by four or two by two
            patches.
        steps: steps of the first stage.
        frames_per_step: frames in each of these.
        lr: highest learning rate in these.
        weight: weight of the loss of naming objects in the other stages.
    """

    hidden: int = 128
    layers: int = 4
    grid: int = 4
    steps: int = 600
    frames_per_step: int = 64
    lr: float = 1.5e-3
    weight: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        _require_counts(self, ("layers", "steps", "frames_per_step"))
        _require_width(self)
        if self.grid not in _GRIDS:
            raise ValueError(f"grid is {self.grid}; use one of {', '.join(map(str, _GRIDS))}")


class QuestionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Questions in the steps of the third stage.

    Attributes:
        per_step: fewest questions in a step.
        together: most questions on the same frames.
        synthetic: share of the frames with synthetic questions, by rules from what they show.
        synthetic_frames: most frames of these.
        paired: share of the others that are asked in both worlds of twins, if there are any.
        recalled: share of all but the synthetic ones that are asked as behind a memory: the clue
            frames among frames that do not matter, and the last view.
        recalled_frames: most frames among those that do not matter.
        whole: share of the steps with questions on one whole trajectory, of twins on both, instead.
        per_trajectory: most questions in such a step.
        ramp: share of the stage in which the numbers of frames and `whole` grow from nothing.
    """

    per_step: int = 100
    together: int = 12
    synthetic: float = 0.4
    synthetic_frames: int = 1
    paired: float = 0.0
    recalled: float = 0.5
    recalled_frames: int = 12
    whole: float = 0.0
    per_trajectory: int = 40
    ramp: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        counts = ("per_step", "together", "synthetic_frames", "recalled_frames", "per_trajectory")
        _require_counts(self, counts)
        _require_shares(self, ("synthetic", "paired", "recalled", "whole", "ramp"))


class ReadingSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Questions in the steps in which the decoder learns to read.

    Attributes:
        tokens_per_step: fewest tokens of the questions of a step, with their frames.
        together: most questions on the same frames.
        renamed: share of the homes in which each type of thing is taken for another.
        single: share of the steps, the first ones, in which all questions are on single frames.
        ramp: share of the steps, from there on, in which the numbers of frames grow.
        synthetic: share of the frames with synthetic questions, by rules from what they show.
        synthetic_frames: most frames of these.
        filled: most synthetic questions that are added to recorded ones.
        recalled: share of the others that are asked as behind a memory: the clue frames among
            frames that do not matter, and the last view.
        recalled_frames: most frames among those that do not matter.
        whole: share of the others that are asked on the whole trajectory.
    """

    tokens_per_step: int = 1500
    together: int = 12
    renamed: float = 0.7
    single: float = 0.15
    ramp: float = 0.3
    synthetic: float = 0.4
    synthetic_frames: int = 6
    filled: int = 4
    recalled: float = 0.5
    recalled_frames: int = 8
    whole: float = 0.03

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        _require_counts(self, ("tokens_per_step", "together", "synthetic_frames"))
        _require_shares(self, ("renamed", "single", "synthetic", "recalled", "whole"))
        if not 0 < self.ramp <= 1:
            raise ValueError(f"ramp is {self.ramp}; use a number above 0 and at most 1")


class NanoRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Training of the small model in three stages: vision, then text, then both together.

    Attributes:
        architecture: marks the recipe as one of the small model.
        title: description in one line.
        scenes: scenes to generate data in if no data are given.
        vision: the vision tower and the first stage, in which it learns to see.
        hidden: width of the decoder.
        layers: layers of the decoder.
        text_steps: steps of the second stage, in which the decoder learns to act by the words of
            synthetic plans without frames. The tower is frozen from here on.
        joint_steps: steps of the third stage, in which the decoder learns to answer questions and
            to act.
        text_plans_per_step: synthetic plans in each step of the second stage.
        questions: questions in each step of the third stage.
        windows_per_step: windows of histories in a step of the third stage.
        window_tokens: most tokens of a window.
        single_plan_share: share of the steps of the third stage with single plans of histories
            instead of windows.
        plans_per_step: single plans in such a step.
        joint_text_plans_per_step: synthetic plans in each step of the third stage.
        text_plans_weight: weight of the loss on these.
        lr: highest learning rate of the second and third stage.
        weight_decay: weight decay of AdamW.
        words: words of plans and actions.
        threads: torch threads; another number rounds differently.
        seed: seed of everything that is random.
    """

    architecture: str = "nano"
    title: str
    scenes: SceneSettings = SceneSettings()
    vision: VisionSettings = VisionSettings()
    hidden: int = 128
    layers: int = 4
    text_steps: int = 200
    joint_steps: int = 800
    text_plans_per_step: int = 96
    questions: QuestionSettings = QuestionSettings()
    windows_per_step: int = 1
    window_tokens: int = 2048
    single_plan_share: float = 0.5
    plans_per_step: int = 12
    joint_text_plans_per_step: int = 24
    text_plans_weight: float = 0.5
    lr: float = 1.5e-3
    weight_decay: float = 0.05
    words: Words = Words.PUBLISHED
    threads: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        _require_counts(self, _COUNTS)
        _require_width(self)
        _require_shares(self, ("single_plan_share",))
