"""Recipe of the small model."""

from collections.abc import Iterable

import msgspec

from infthor_eval.formats.object_ids import Words

__all__ = ["NanoRecipe", "QuestionSettings", "SceneSettings"]

_COUNTS = (
    "vision_steps",
    "text_steps",
    "joint_steps",
    "frames_per_step",
    "text_plans_per_step",
    "windows_per_step",
    "plans_per_step",
    "joint_text_plans_per_step",
)


def _require_counts(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if getattr(settings, name) < 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use 1 or more")


def _require_shares(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if not 0 <= getattr(settings, name) <= 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use a number between 0 and 1")


class SceneSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Procedural scenes for training.

    Attributes:
        kinds: kinds of rooms.
        first: number of the first scene of each kind; the scenes of the bundled sets have lower
            numbers.
        count: scenes of each kind.
        min_steps: fewest steps of a trajectory.
    """

    kinds: tuple[str, ...] = ("kitchen", "living-room", "bedroom", "bathroom")
    first: int = 101
    count: int = 24
    min_steps: int = 70

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all scenes."""
        return tuple(f"{kind}-{self.first + at}" for kind in self.kinds for at in range(self.count))


class QuestionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Questions in the steps of the third stage.

    Attributes:
        per_step: questions in a step.
        synthetic: share of these that are synthetic questions for the presence of an object in any
            frame.
        paired: share of the others that are asked in both worlds of twins, if there are any.
        recalled: share of all but the synthetic ones that are asked as behind a memory: the clue
            frames among frames that do not matter, and the last view.
        recalled_frames: most frames among those that do not matter.
        whole: share of the steps with questions on one whole trajectory, of twins on both, instead.
        per_trajectory: most questions in such a step.
        ramp: share of the stage in which `recalled_frames` and `whole` grow from nothing.
    """

    per_step: int = 40
    synthetic: float = 0.4
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
        _require_counts(self, ("per_step", "recalled_frames", "per_trajectory"))
        _require_shares(self, ("synthetic", "paired", "recalled", "whole", "ramp"))


class NanoRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Training of the small model in three stages: vision, then text, then both together.

    Attributes:
        architecture: marks the recipe as one of the small model.
        title: description in one line.
        scenes: scenes to generate data in if no data are given.
        hidden: width of vision tower and decoder.
        layers: layers of each.
        vision_steps: steps of the first stage, in which the tower learns which objects are in which
            part of a frame, by the embeddings of their names.
        text_steps: steps of the second stage, in which the decoder learns to act by the words of
            synthetic plans without frames. The tower is frozen from here on.
        joint_steps: steps of the third stage, in which the decoder learns to answer questions and
            to act.
        frames_per_step: frames in each step of the first stage.
        text_plans_per_step: synthetic plans in each step of the second stage.
        questions: questions in each step of the third stage.
        windows_per_step: windows of histories in a step of the third stage.
        window_tokens: most tokens of a window.
        single_plan_share: share of the steps of the third stage with single plans of histories
            instead of windows.
        plans_per_step: single plans in such a step.
        joint_text_plans_per_step: synthetic plans in each step of the third stage.
        text_plans_weight: weight of the loss on these.
        lr: highest learning rate.
        weight_decay: weight decay of AdamW.
        vision_weight: weight of the first stage's loss in the other stages.
        words: words of plans and actions.
        threads: torch threads; another number rounds differently.
        seed: seed of everything that is random.
    """

    architecture: str = "nano"
    title: str
    scenes: SceneSettings = SceneSettings()
    hidden: int = 128
    layers: int = 4
    vision_steps: int = 600
    text_steps: int = 200
    joint_steps: int = 800
    frames_per_step: int = 64
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
    vision_weight: float = 0.1
    words: Words = Words.PUBLISHED
    threads: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges of all settings.

        Raises:
            ValueError: a value is out of its range; the message names the setting.
        """
        _require_counts(self, _COUNTS)
        if self.hidden % 32:
            raise ValueError(f"hidden is {self.hidden}; use a multiple of 32")
        _require_shares(self, ("single_plan_share",))
