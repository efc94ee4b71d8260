"""What a context is: the part of a trajectory that a question is asked on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question

__all__ = ["Case", "Context", "Settings", "Unfit", "clue_positions"]

Part = str | FrameRef


@dataclass(frozen=True)
class Case:
    """One way in which a question is asked.

    Attributes:
        frames: the frames shown, as positions in the trajectory's time order.
        variant: which of the context's ways this is ("depth=0.4"); empty where there is one.
        n_cut: frames of the trajectory that are cut off because the context has a size.
    """

    frames: tuple[int, ...]
    variant: str = ""
    n_cut: int = 0


@dataclass(frozen=True)
class Unfit:
    """A way in which the question cannot be asked, and why."""

    reason: str
    variant: str = ""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What contexts can be told, under `dataset_kwargs` of a task file or in lm-eval's metadata.

    Attributes:
        ctx_size: size of the context in kilo-tokens.
        k_tokens: how many tokens a kilo-token is, 1000 or 1024; None takes the published value of the context.
        tokens_per_frame: tokens of one frame with the model at hand, from its own processor.
        depths: where in the window the needle lies, 0 at its start.
        top_k: how many frames are retrieved.
        seed: for what is sampled.
    """

    ctx_size: float | None = None
    k_tokens: int | None = None
    tokens_per_frame: int | None = None
    depths: tuple[float, ...] = (0.0, 0.2, 0.4, 0.6, 0.8)
    top_k: int = 10
    seed: int = 0

    @classmethod
    def read(cls, given: Mapping[str, Any]) -> "Settings":
        """Settings from a mapping; what they do not know is not theirs.

        Raises:
            UsageError: a value that cannot be.
        """
        known = {item.name for item in fields(cls)}
        settings = cls(**{key: value for key, value in given.items() if key in known and value is not None})
        if settings.k_tokens not in (None, 1000, 1024):
            raise UsageError(f"k_tokens is {settings.k_tokens}; a kilo-token is 1000 or 1024 tokens")
        return settings

    def n_frames(self, k_tokens: int) -> int:
        """How many frames fill the context.

        Args:
            k_tokens: the published size of a kilo-token in this context.

        Raises:
            UsageError: the size or the frame's tokens are not known.
        """
        if self.ctx_size is None:
            raise UsageError("this context needs its size: ctx_size under dataset_kwargs of the task file")
        if not self.tokens_per_frame:
            raise UsageError("this context needs tokens_per_frame, the model's tokens of one frame, in the metadata")
        return int(self.ctx_size * (self.k_tokens or k_tokens)) // self.tokens_per_frame


def _frames_alone(_data: NiehSet, _question: Question, frames: Sequence[FrameRef]) -> list[Part]:
    return list(frames)


@dataclass(frozen=True)
class Context:
    """A context.

    Attributes:
        cases: the ways in which a question is asked, or why it cannot be.
        needs_model: whether the frames depend on the model's tokens per frame.
        intro: the published sentence that tells the model what it sees.
        parts: what the model sees before that sentence, given the frames of a case.
    """

    cases: Callable[[NiehSet, Question, Settings], list[Case | Unfit]]
    needs_model: bool = False
    intro: str = "Answer the question given the agent's views in time order."
    parts: Callable[[NiehSet, Question, Sequence[FrameRef]], list[Part]] = field(default=_frames_alone)


def clue_positions(data: NiehSet, question: Question) -> tuple[int, ...]:
    """Where in the trajectory's time order the clues lie, each once, ascending."""
    order = {frame: position for position, frame in enumerate(data.frames(question.traj_id))}
    return tuple(sorted({order[frame] for frame in data.clue_frames(question)}))
