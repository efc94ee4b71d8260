"""Recipe of the small model."""

from collections.abc import Iterable

import msgspec

from infthor_eval.formats.object_ids import Words


def _require_counts(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if getattr(settings, name) < 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use 1 or more")


def _require_shares(settings: msgspec.Struct, names: Iterable[str]) -> None:
    for name in names:
        if not 0 <= getattr(settings, name) <= 1:
            raise ValueError(f"{name} is {getattr(settings, name)}; use a number between 0 and 1")


def _require_width(settings: "NanoRecipe | VisionSettings", factor: int) -> None:
    if settings.hidden < 1 or settings.hidden % factor:
        raise ValueError(f"hidden is {settings.hidden}; use a multiple of {factor}")


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
        """Check the ranges of all settings."""
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


class ViewSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Views to learn seeing from, of rooms whose things are put about at random.

    Attributes:
        kinds: kinds of rooms.
        first: number of the first room of each kind; trajectories are in others.
        count: rooms of each kind.
        arrangements: how often the things of a room are put about.
        per_arrangement: views of each arrangement.
    """

    kinds: tuple[str, ...] = ("kitchen", "living-room", "bedroom", "bathroom")
    first: int = 1001
    count: int = 30
    arrangements: int = 4
    per_arrangement: int = 17

    def __post_init__(self) -> None:
        """Check the ranges of all settings."""
        _require_counts(self, ("count", "arrangements", "per_arrangement"))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all rooms."""
        numbers = range(self.first, self.first + self.count)
        return tuple(f"{kind}-{number}" for number in numbers for kind in self.kinds)


class VisionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The vision tower and the first stage, in which it learns which objects views show where.

    Attributes:
        hidden: width of the tower.
        layers: layers of the tower.
        steps: steps of the first stage.
        patches_per_step: patches in each of these.
        crops: share of the steps, the first ones, with crops around things instead of frames.
        mixed: share of the later steps with crops.
        lr: highest learning rate in these.
        matrix_lr: that of the layers' matrices, whose steps are made orthogonal (Muon).
    """

    hidden: int = 96
    layers: int = 4
    steps: int = 1000
    patches_per_step: int = 4608
    crops: float = 0.4
    mixed: float = 0.25
    lr: float = 3e-3
    matrix_lr: float = 1.5e-2

    def __post_init__(self) -> None:
        """Check the ranges of all settings."""
        _require_counts(self, ("layers", "steps", "patches_per_step"))
        _require_shares(self, ("crops", "mixed"))
        _require_width(self, 32)


class ReadingSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Questions in the steps in which the decoder learns to read.

    Attributes:
        tokens_per_step: fewest tokens of the questions of a step, with their frames.
        together: most questions on the same frames.
        labelled: share of the steps, the first ones, in which frames are known by what they show,
            and not by what the tower tells of them.
        renamed: share of the homes in which each type of thing is taken for another.
        turned: share of the homes in which a type of thing that nobody opens is open where it was
            closed, and the other way round.
        single: share of the steps, the first ones, in which all questions are on single frames.
        ramp: share of the steps, from there on, in which the numbers of frames grow.
        synthetic: share of the frames with synthetic questions, by rules from what they show.
        synthetic_frames: most frames of these.
        sought: share of these whose frames are sought for what few frames can be asked about:
            what is open, what is in a receptacle, and whether something is.
        events: share of the frames with synthetic questions on a few events in a row.
        events_in_a_row: most events of these.
        filled: most synthetic questions that are added to recorded ones.
        recalled: share of the recorded ones that are asked as behind a memory: the clue frames
            among frames that do not matter, and the last view.
        recalled_frames: most frames among those that do not matter.
        whole: share of the recorded ones that are asked on the whole trajectory.
    """

    tokens_per_step: int = 1500
    together: int = 12
    labelled: float = 0.5
    renamed: float = 0.7
    turned: float = 0.5
    single: float = 0.15
    ramp: float = 0.3
    synthetic: float = 0.25
    synthetic_frames: int = 6
    sought: float = 0.7
    events: float = 0.3
    events_in_a_row: int = 6
    filled: int = 4
    recalled: float = 0.5
    recalled_frames: int = 8
    whole: float = 0.03

    def __post_init__(self) -> None:
        """Check the ranges of all settings."""
        _require_counts(
            self, ("tokens_per_step", "together", "synthetic_frames", "events_in_a_row")
        )
        shares = (
            "labelled",
            "renamed",
            "turned",
            "single",
            "synthetic",
            "sought",
            "events",
            "recalled",
            "whole",
        )
        _require_shares(self, shares)
        if not 0 < self.ramp <= 1:
            raise ValueError(f"ramp is {self.ramp}; use a number above 0 and at most 1")


class ActingSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Histories and plans in the steps in which the decoder learns to act.

    Attributes:
        windows_per_step: windows of histories in a step.
        window_tokens: most tokens of a window.
        single_plan_share: share of the steps with single plans of histories instead of windows.
        plans_per_step: single plans in such a step.
        text_plans_per_step: synthetic plans without frames in each step.
        text_plans_weight: weight of the loss on these.
    """

    windows_per_step: int = 1
    window_tokens: int = 2048
    single_plan_share: float = 0.7
    plans_per_step: int = 8
    text_plans_per_step: int = 16
    text_plans_weight: float = 0.5

    def __post_init__(self) -> None:
        """Check the ranges of all settings."""
        counts = ("windows_per_step", "window_tokens", "plans_per_step", "text_plans_per_step")
        _require_counts(self, counts)
        _require_shares(self, ("single_plan_share",))


class NanoRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Training of the small model in two stages: the tower, and then the decoder.

    Attributes:
        title: description in one line.
        scenes: scenes to generate trajectories in if no data are given.
        views: rooms to generate views of.
        vision: the vision tower and the first stage, in which it learns to see.
        hidden: width of the decoder.
        layers: layers of the decoder.
        steps: steps of the second stage, in which the decoder learns to read and to act. The tower
            is frozen in it.
        reading: questions in each of its steps.
        acting: histories and plans in each of its steps.
        event_weight: weight of the loss of what happened between frames.
        lr: highest learning rate of the second stage.
        layer_lr: that of the decoder's layers, whose first weights a higher one would undo.
        weight_decay: weight decay of both.
        words: words of plans and actions.
        threads: torch threads; another number rounds differently.
        seed: seed of everything that is random.
    """

    title: str
    scenes: SceneSettings = SceneSettings()
    views: ViewSettings = ViewSettings()
    vision: VisionSettings = VisionSettings()
    hidden: int = 320
    layers: int = 4
    steps: int = 600
    reading: ReadingSettings = ReadingSettings()
    acting: ActingSettings = ActingSettings()
    event_weight: float = 0.3
    lr: float = 1e-3
    layer_lr: float = 3e-4
    weight_decay: float = 0.05
    words: Words = Words.PUBLISHED
    threads: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges of all settings."""
        _require_counts(self, ("layers", "steps"))
        _require_width(self, 40)
