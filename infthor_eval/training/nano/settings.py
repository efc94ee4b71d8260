"""What the small model is made by."""

import msgspec

__all__ = ["NanoRecipe", "Scenes"]

_COUNTS = (
    "seeing_steps",
    "reading_steps",
    "telling_steps",
    "frames_per_step",
    "orders_read",
    "questions_per_step",
    "windows_per_step",
    "plans_per_step",
    "orders_per_step",
)


class Scenes(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The procedural scenes that it is trained in.

    Attributes:
        kinds: of rooms.
        first: number of the first scene of each kind; those that come with the package have lower ones.
        count: scenes of each kind.
        min_steps: of a trajectory, at least.
    """

    kinds: tuple[str, ...] = ("kitchen", "living-room", "bedroom", "bathroom")
    first: int = 101
    count: int = 24
    min_steps: int = 70

    @property
    def names(self) -> tuple[str, ...]:
        """Of all of them."""
        return tuple(f"{kind}-{self.first + at}" for kind in self.kinds for at in range(self.count))


class NanoRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How the small model is trained: it learns to see, to read, then to answer and to act.

    Attributes:
        architecture: marks the recipe.
        title: what it is, in one line.
        scenes: where its data is made, if none is given.
        hidden: width of tower and decoder.
        layers: of each.
        seeing_steps: in which it learns which objects are in which part of a frame, by their names' embeddings.
        reading_steps: in which it learns to do what the words of a plan say, from plans that are made up, without a
            frame; its tower stays as it is from here on.
        telling_steps: in which it learns to answer questions and to act.
        frames_per_step: while it learns to see.
        orders_read: plans that are made up, in each step of reading.
        questions_per_step: while it learns to answer.
        made_up: share of these that ask for the presence of an object in any frame.
        windows_per_step: histories that it learns to act from, in a step of these.
        window_tokens: of each of them at most.
        alone: share of the steps in which it learns from single plans of histories instead.
        plans_per_step: how many these are.
        orders_per_step: plans that are made up, while it learns to answer.
        orders_weight: of these beside the histories.
        lr: the highest learning rate.
        weight_decay: of AdamW.
        seeing_weight: of what is seen beside what is read or told.
        threads: of torch; another number rounds otherwise.
        seed: of everything that is random.
    """

    architecture: str = "nano"
    title: str
    scenes: Scenes = Scenes()
    hidden: int = 128
    layers: int = 4
    seeing_steps: int = 400
    reading_steps: int = 200
    telling_steps: int = 600
    frames_per_step: int = 64
    orders_read: int = 96
    questions_per_step: int = 40
    made_up: float = 0.4
    windows_per_step: int = 1
    window_tokens: int = 2048
    alone: float = 0.5
    plans_per_step: int = 12
    orders_per_step: int = 24
    orders_weight: float = 0.5
    lr: float = 1.5e-3
    weight_decay: float = 0.05
    seeing_weight: float = 0.1
    threads: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            ValueError: names the setting.
        """
        for name in _COUNTS:
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it is at least 1")
        if self.hidden % 32:
            raise ValueError(f"hidden is {self.hidden}; it is a multiple of 32")
        for name in ("made_up", "alone"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} is {getattr(self, name)}; it is between 0 and 1")
