"""Settings of NIEH: its options on the command line, of which task files have some too.

A field of `NiehSettings` is an option and a setting of task files, one of `NiehOptions` an option
alone, and one of `ContextSettings` (`infthor_eval/nieh/contexts/base.py`) a setting of task files
alone.
"""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from infthor_eval.memory.options import MemoryOptions
from infthor_eval.nieh.prompts import PROMPTS, PUBLISHED_MAIN
from infthor_eval.quantities import MOST, Repetition, Total
from infthor_eval.settings import Setting, Shorthand, check_options

SHOWN = "shown"
BLANK = "blank"
OTHER = "other"
NO_CLUE = "no-clue"
NONE = "none"
FRAMES = (SHOWN, BLANK, "shuffled", OTHER, NO_CLUE, NONE)  # see `infthor_eval.nieh.frame_ablations`
_CONTROLS = f"{SHOWN},{NO_CLUE},{BLANK},{OTHER}"
_CLIP = "openai/clip-vit-large-patch14"
_WINDOW = "the context or its window"  # see `infthor_eval.report.causes`
_Size = Annotated[float, Meta(gt=0, lt=1e9)]  # kilo-tokens; more is a typing error
_Temperature = Annotated[float, Meta(gt=0, lt=MOST)]


@dataclass(frozen=True, kw_only=True)
class NiehSettings:
    """What the command line and task files can say; the file's own goes before. None is the task's
    or the model's own."""

    context: Annotated[
        str | None,
        Setting(
            help="What is shown in tasks that leave it open (nieh_twins), a run with each: clues, "
            "trajectory, haystack, truncate_head, memory, video; default: clues.",
            stands_for="clues",
            where="context",
            metavar="NAME,...",
            each=True,
        ),
    ] = None
    ctx_size: Annotated[
        _Size | None,
        Setting(
            help="Size of a context in kilo-tokens, for haystack and truncate_head.",
            of="kilo-tokens",
            where="context",
            metavar="K",
        ),
    ] = None
    k_tokens: Annotated[
        Total | None,
        Setting(
            help="Tokens of a kilo-token in contexts with a size; default: each context's "
            "published value.",
            choices=(1000, 1024),
            where="size",
            in_config=True,
            cause=_WINDOW,
        ),
    ] = None
    tokens_per_frame: Annotated[
        Total | None,
        Setting(
            help="Tokens of one frame in contexts with a size, for models that count no tokens.",
            where="size",
            in_config=True,
            cause=_WINDOW,
            metavar="N",
        ),
    ] = None
    retriever: Annotated[
        str | None,
        Setting(
            help="CLIP model of retrieval tasks, a hub id or a folder.",
            stands_for=_CLIP,
            where="retriever",
            metavar="NAME",
            is_place=True,
        ),
    ] = None
    retriever_revision: Annotated[
        str | None,
        Setting(
            help="Branch, tag or commit of the retriever on the hub.",
            where="retriever",
            metavar="REVISION",
        ),
    ] = None
    frames: Annotated[
        str,
        Setting(
            help=f"Frames to show, a run with each: {SHOWN}, {BLANK}, shuffled, {OTHER} (of "
            f"another home), {NO_CLUE} (without the evidence), {NONE} (texts alone, which language "
            "models read).",
            choices=FRAMES,
            in_config=True,
            metavar="HOW,...",
            each=True,
            shorthands=(
                Shorthand(
                    "controls",
                    _CONTROLS,
                    "What of the score is memory, and what knowledge of homes: a run with each of "
                    f"--frames {_CONTROLS}.",
                ),
            ),
        ),
    ] = SHOWN
    prompt: Annotated[
        str | None,
        Setting(
            help="Words of the question, for tasks that leave them open; default: "
            f"{PUBLISHED_MAIN}.",
            choices=PROMPTS,
            stands_for=PUBLISHED_MAIN,
            where="prompt",
            in_config=True,
            cause="the words of the question",
        ),
    ] = None

    @property
    def clip_model(self) -> str:
        """The CLIP model, a hub id or a folder."""
        return self.retriever or _CLIP

    @property
    def words(self) -> str:
        """Name of the prompt."""
        return self.prompt or PUBLISHED_MAIN


@dataclass(frozen=True, kw_only=True)
class NiehOptions(NiehSettings, MemoryOptions):
    """Options of a run; None is the task's or the model's own."""

    trajectories: Annotated[
        str | None,
        Setting(
            help="Folder of the set's trajectories (TRAJ_ID.json or .txt) if they are not in "
            "the set.",
            where="trajectories",
            metavar="DIR",
            is_place=True,
        ),
    ] = None
    repeats: Annotated[
        Repetition,
        Setting(
            help="Ask each question N times, with replies drawn by the seeds from --seed on.",
            in_config=True,
            cause="which questions are asked",
            metavar="N",
        ),
    ] = 1
    temperature: Annotated[
        _Temperature | None,
        Setting(
            help="Draw replies at this temperature; default: as the task says, and 1 if it is "
            "repeated.",
            metavar="T",
        ),
    ] = None
    max_thinking_tokens: Annotated[
        Total | None,
        Setting(
            help="Tokens for what a model thinks, beside those of its answer.",
            metavar="N",
        ),
    ] = None

    def __post_init__(self) -> None:
        """Raise UsageError if a value is not valid."""
        super().__post_init__()
        check_options(self)


def check_frames(frames: str) -> None:
    """Check the name of a frame ablation."""
    NiehOptions(frames=frames)
