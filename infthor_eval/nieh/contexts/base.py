"""Contexts: the part of a trajectory that a question is asked on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from msgspec import Meta

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.video import FILM_FPS, Video
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.memory import MemoryArgs
from infthor_eval.nieh.options import NiehSettings
from infthor_eval.nieh.prompts import PUBLISHED_MAIN, question_text
from infthor_eval.quantities import Share, Total
from infthor_eval.settings import Setting
from infthor_eval.storage.digests import digest, fingerprint
from model_adapters import CacheCut

ContextPart = str | FrameRef | Video
VIEW_FOLLOWS = "; Last agent's view: "  # text before a frame, which goes with it
_Fps = Annotated[float, Meta(gt=0, le=FILM_FPS)]


@dataclass(frozen=True)
class RecallSettings:
    """How a memory recalls what a sample shows.

    Attributes:
        memory: name of the memory, or FILE.py:CLASS.
        options: options of its class, sorted pairs.
        budget: most tokens of what is recalled; None for the memory's own limit.
        tokens_per_frame: tokens of a frame for the model under test; None if there is no budget.
        seed: seed of what the memory draws.
    """

    memory: str
    options: MemoryArgs = ()
    budget: int | None = None
    tokens_per_frame: int | None = None
    seed: int = 0

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> "RecallSettings":
        """Return the settings of a mapping of their fields."""
        return cls(**{**document, "options": tuple(sorted(dict(document["options"]).items()))})


@dataclass(frozen=True)
class QuestionVariant:
    """A question in one variant of its context.

    Attributes:
        frames: positions of the shown frames in the trajectory's time order.
        variant: variant of the context ("depth=0.4"); empty if there is only one.
        n_cut: number of frames that are cut off to keep the context's size.
        recall: how frames and texts are recalled; None if the context shows what it says.
        recalled: what was recalled, positions of frames and texts in order; None before. `frames`
            are all frames before, and then the recalled ones and the last.
        cut: what is kept of the model's cache of all frames, if the memory is one of the cache;
            `frames` are all frames then.
        fps: rate at which the frames are sampled from a film, per second, if they are shown as a
            video.
    """

    question: Question
    frames: tuple[int, ...]
    variant: str = ""
    n_cut: int = 0
    recall: RecallSettings | None = None
    recalled: tuple[int | str, ...] | None = None
    cut: CacheCut | None = None
    fps: float | None = None

    @property
    def awaits_recall(self) -> bool:
        """True if a memory is still to recall what it shows."""
        return self.recall is not None and self.recalled is None


@dataclass(frozen=True, kw_only=True)
class ContextSettings(NiehSettings):
    """Settings of contexts, from `dataset_kwargs` of a task file or lm-eval's metadata."""

    depths: Annotated[
        tuple[Share, ...],
        Meta(min_length=1),
        Setting(
            help="Positions of the needle in the window, 0 at its start.",
            is_a="a list of numbers from 0 to 1",
        ),
    ] = (0.0, 0.2, 0.4, 0.6, 0.8)
    top_k: Annotated[Total, Setting(help="Number of retrieved frames.")] = 10
    memory: Annotated[
        str | None,
        Setting(
            help="Memory that recalls what is shown, a name or FILE.py:CLASS.",
            is_a="the name of a memory",
        ),
    ] = None
    memory_args: Annotated[
        dict[str, str | int | float | bool],
        Setting(
            help="Options of the memory.",
            is_a="a mapping of options to texts and numbers",
        ),
    ] = field(default_factory=dict)
    budget: Annotated[
        Total | None,
        Setting(
            help="Most tokens of what is recalled; default: the memory's own limit.",
            of="tokens",
        ),
    ] = None
    fps: Annotated[
        _Fps,
        Setting(
            help="Frames per second that are sampled from a trajectory's film.",
            of="frames per second",
        ),
    ] = 1.0
    seed: Annotated[int, Setting(help="Seed of everything sampled.")] = 0

    def n_frames(self, k_tokens: int) -> int:
        """Return how many frames fill the context, given the published tokens of its kilo-token."""
        if self.ctx_size is None:
            raise UsageError(
                "this context needs its size: ctx_size under dataset_kwargs of the task file"
            )
        if not self.tokens_per_frame:
            raise UsageError(
                "this context needs tokens_per_frame, the model's tokens of one frame, in the "
                "metadata"
            )
        return int(self.ctx_size * (self.k_tokens or k_tokens)) // self.tokens_per_frame


# Functions, not lambdas: contexts are pickled and sent to workers.
def _only_frames(
    _data: NiehSet, _sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    return list(frames)


def _all_frames(data: NiehSet, traj_id: str, _fps: float | None) -> Sequence[FrameRef]:
    return data.frames(traj_id)


def _frames_of(_data: NiehSet, sample: QuestionVariant) -> Sequence[int]:
    return sample.frames


def _no_sources(_data: NiehSet, _settings: ContextSettings) -> dict[str, Any]:
    return {}


@dataclass(frozen=True)
class Context:
    """A context.

    Attributes:
        samples: returns the samples of a question, one for each variant, or the reasons why it
            cannot be asked.
        needs_model: True if the frames depend on the model's tokens per frame.
        intro: the sentence that says what the model sees; the published one where the context is
            published.
        text_intro: the sentence where texts were recalled.
        intro_without_frames: the sentence where no frame is shown.
        prompts: the prompts in which it can be asked.
        parts: returns what the model sees before that sentence, given the frames of a sample.
        frames: returns the frames of a trajectory that the positions of a sample refer to, given
            its `fps`.
        positions: returns where in the trajectory's time order the frames of a sample are.
        sources: returns whatever the frames depend on besides the set's fingerprint and the
            settings, as JSON values.
    """

    samples: Callable[[NiehSet, Question, ContextSettings], list[QuestionVariant | SkippedQuestion]]
    needs_model: bool = False
    intro: str = "Answer the question given the agent's views in time order."
    text_intro: str = (
        "Answer the question given what was recalled of the agent's views, in time order, and its "
        "last view (the last image)."
    )
    intro_without_frames: str = "Answer the question."
    prompts: tuple[str, ...] = (PUBLISHED_MAIN,)
    parts: Callable[[NiehSet, QuestionVariant, Sequence[FrameRef]], list[ContextPart]] = field(
        default=_only_frames
    )
    frames: Callable[[NiehSet, str, float | None], Sequence[FrameRef]] = field(default=_all_frames)
    positions: Callable[[NiehSet, QuestionVariant], Sequence[int]] = field(default=_frames_of)
    sources: Callable[[NiehSet, ContextSettings], dict[str, Any]] = field(default=_no_sources)

    def select_frames(self, data: NiehSet, sample: QuestionVariant) -> list[FrameRef]:
        """Return the frames of a sample; none in a set of question files alone."""
        if not data.has_frames:
            return []
        frames = self.frames(data, sample.question.traj_id, sample.fps)
        return [frames[position] for position in sample.frames]

    def request(
        self,
        data: NiehSet,
        sample: QuestionVariant,
        prompt: str = PUBLISHED_MAIN,
        *,
        has_frames: bool = True,
    ) -> tuple[list[ContextPart], str]:
        """Return the request of a sample: the context, and the text with the question after it,
        which speaks of frames if they are shown."""
        parts = self.parts(data, sample, self.select_frames(data, sample))
        has_texts = any(isinstance(part, str) for part in sample.recalled or ())
        intro = self.text_intro if has_texts else self.intro
        return parts, question_text(
            intro if has_frames else self.intro_without_frames, sample.question, prompt
        )


def trajectories_identity(data: NiehSet, _settings: ContextSettings) -> dict[str, Any]:
    """Return the hash of the trajectories' own files, which the set's hash does not cover."""
    ids = sorted({question.traj_id for question in data.questions})
    files = {traj_id: path for traj_id in ids if (path := data.outline_file(traj_id)) is not None}
    return {
        "trajectories": fingerprint(
            {traj_id: digest(path.read_bytes()) for traj_id, path in files.items()}
        )
    }
