"""What a context is: the part of a trajectory that a question is asked on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import msgspec

from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.formats.digests import digest_of_file, fingerprint
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.notes import Notes, Notetaking
from infthor_eval.nieh.prompts import question_text

__all__ = ["Context", "ContextPart", "ContextSettings", "Sample", "clue_positions", "trajectories_identity"]

_LARGEST = 1e9  # kilo-tokens; more is a slip
ContextPart = str | FrameRef | Notes


@dataclass(frozen=True)
class Sample:
    """A question, asked in one way.

    Attributes:
        question: the question.
        frames: the frames shown, as positions in the trajectory's time order.
        variant: which of the context's ways this is ("depth=0.4"); empty where there is one.
        n_cut: frames of the trajectory that are cut off because the context has a size.
        notes: how the model takes notes on the frames, where it is shown its notes instead of them.
    """

    question: Question
    frames: tuple[int, ...]
    variant: str = ""
    n_cut: int = 0
    notes: Notetaking | None = None


@dataclass(frozen=True, kw_only=True)
class ContextSettings:
    """What contexts can be told, under `dataset_kwargs` of a task file or in lm-eval's metadata.

    Attributes:
        ctx_size: size of the context in kilo-tokens.
        k_tokens: how many tokens a kilo-token is, 1000 or 1024; None takes the published value of the context.
        tokens_per_frame: tokens of one frame with the model at hand, from its own processor.
        depths: where in the window the needle lies, 0 at its start.
        top_k: how many frames are retrieved.
        retriever: CLIP model that retrieves them, a hub id or a folder.
        retriever_revision: branch, tag or commit on the hub; the default branch where None.
        note_window: how many frames the model reads for one note.
        note_tokens: most tokens of one note.
        seed: for what is sampled.
        frames: what is shown in the frames' places (`infthor_eval.nieh.stand_ins`).
    """

    ctx_size: float | None = None
    k_tokens: int | None = None
    tokens_per_frame: int | None = None
    depths: tuple[float, ...] = (0.0, 0.2, 0.4, 0.6, 0.8)
    top_k: int = 10
    retriever: str = "openai/clip-vit-large-patch14"
    retriever_revision: str | None = None
    note_window: int = 20
    note_tokens: int = 64
    seed: int = 0
    frames: str = "shown"

    @classmethod
    def read(cls, given: Mapping[str, Any]) -> "ContextSettings":
        """ContextSettings from a mapping; what they do not know is not theirs.

        Raises:
            UsageError: a value that cannot be.
        """
        known = {item.name for item in fields(cls)}
        told = {key: value for key, value in given.items() if key in known and value is not None}
        wrong = "a context's settings (dataset_kwargs of a task file) are not what they should be"
        with wrap_errors(wrong, "mend them", catch=msgspec.ValidationError, raise_as=UsageError):
            settings = msgspec.convert(told, cls)
        if settings.k_tokens not in (None, 1000, 1024):
            raise UsageError(f"k_tokens is {settings.k_tokens}; a kilo-token is 1000 or 1024 tokens")
        for name in ("top_k", "note_window", "note_tokens"):
            if getattr(settings, name) < 1:
                raise UsageError(f"{name} is {getattr(settings, name)!r}; it is a whole number from 1 on")
        if settings.ctx_size is not None and not 0 < settings.ctx_size < _LARGEST:
            raise UsageError(f"ctx_size is {settings.ctx_size}; it is a number of kilo-tokens above 0")
        if not settings.depths or not all(0 <= depth <= 1 for depth in settings.depths):
            raise UsageError(f"depths are {settings.depths}; they are between 0 and 1")
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


def _frames_alone(_data: NiehSet, _sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    return list(frames)


def _every_frame(data: NiehSet, traj_id: str) -> Sequence[FrameRef]:
    return data.frames(traj_id)


def _nothing_else(_data: NiehSet, _settings: ContextSettings) -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Context:
    """A context.

    Attributes:
        samples: the ways in which a question is asked, or why it cannot be.
        needs_model: whether the frames depend on the model's tokens per frame.
        intro: the sentence that tells the model what it sees, as published where the context is.
        parts: what the model sees before that sentence, given the frames of a sample.
        frames: the frames that the positions of a sample refer to.
        sources: what the frames depend on besides the set's own fingerprint and the settings, as JSON values.
    """

    samples: Callable[[NiehSet, Question, ContextSettings], list[Sample | SkippedQuestion]]
    needs_model: bool = False
    intro: str = "Answer the question given the agent's views in time order."
    parts: Callable[[NiehSet, Sample, Sequence[FrameRef]], list[ContextPart]] = field(default=_frames_alone)
    frames: Callable[[NiehSet, str], Sequence[FrameRef]] = field(default=_every_frame)
    sources: Callable[[NiehSet, ContextSettings], dict[str, Any]] = field(default=_nothing_else)

    def shown(self, data: NiehSet, sample: Sample) -> list[FrameRef]:
        """The frames of a sample."""
        frames = self.frames(data, sample.question.traj_id)
        return [frames[position] for position in sample.frames]

    def request(self, data: NiehSet, sample: Sample) -> tuple[list[ContextPart], str]:
        """All that a model is shown and told: the context, and the text with the question that follows it."""
        shown = self.parts(data, sample, self.shown(data, sample))
        return shown, question_text(self.intro, sample.question)


def clue_positions(data: NiehSet, question: Question) -> tuple[int, ...]:
    """Where in the trajectory's time order the clues lie, each once, ascending."""
    order = {frame: position for position, frame in enumerate(data.frames(question.traj_id))}
    return tuple(sorted({order[frame] for frame in data.clue_frames(question)}))


def trajectories_identity(data: NiehSet, _settings: ContextSettings) -> dict[str, Any]:
    """Hash of the trajectories' own files: the set's fingerprint does not know them."""
    ids = sorted({question.traj_id for question in data.questions})
    files = {traj_id: path for traj_id in ids if (path := data.outline_file(traj_id)) is not None}
    return {"trajectories": fingerprint({traj_id: digest_of_file(path) for traj_id, path in files.items()})}
