"""Options of NIEH on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.errors import UsageError
from infthor_eval.memory.options import MemoryOptions
from infthor_eval.nieh.prompts import PROMPTS, PUBLISHED_MAIN
from infthor_eval.quantities import MOST_REPEATS

SHOWN = "shown"
BLANK = "blank"
OTHER = "other"
NO_CLUE = "no-clue"
FRAMES = (SHOWN, BLANK, "shuffled", OTHER, NO_CLUE)  # see `infthor_eval.nieh.frame_ablations`


@dataclass(frozen=True, kw_only=True)
class NiehOptions(MemoryOptions):
    """Options of the suite, with their help texts; None is the task's or the model's own."""

    context: str | None = field(
        default=None,
        metadata={
            "help": "Contexts of tasks that leave it open (nieh_twins), a run with each: clues, "
            "trajectory, haystack, truncate_head, memory, video; default: clues.",
            "metavar": "NAME,...",
            "each": True,
        },
    )
    ctx_size: float | None = field(
        default=None,
        metadata={
            "help": "Size of such a context in kilo-tokens, for haystack and truncate_head.",
            "metavar": "K",
        },
    )
    k_tokens: int | None = field(
        default=None,
        metadata={
            "choices": ("1000", "1024"),
            "help": "Tokens of a kilo-token in contexts with a size; default: each context's "
            "published value.",
        },
    )
    tokens_per_frame: int | None = field(
        default=None,
        metadata={
            "help": "Tokens of one frame in contexts with a size, for models that count no tokens.",
            "metavar": "N",
        },
    )
    retriever: str | None = field(
        default=None,
        metadata={
            "help": "CLIP model of retrieval tasks, a hub id or a folder.",
            "metavar": "NAME",
            "is_place": True,
        },
    )
    retriever_revision: str | None = field(
        default=None,
        metadata={
            "help": "Branch, tag or commit of the retriever on the hub.",
            "metavar": "REVISION",
        },
    )
    trajectories: str | None = field(
        default=None,
        metadata={
            "help": "Folder of the set's trajectories (TRAJ_ID.json or .txt) if they are not in "
            "the set.",
            "metavar": "DIR",
            "is_place": True,
        },
    )
    frames: str = field(
        default=SHOWN,
        metadata={
            "help": f"Frames to show, a run with each: {SHOWN}, {BLANK}, shuffled, {OTHER} (of "
            f"another home), {NO_CLUE} (without the evidence).",
            "metavar": "HOW,...",
            "each": True,
            "shorthands": {
                "controls": (
                    f"{SHOWN},{NO_CLUE},{BLANK},{OTHER}",
                    "What of the score is memory, and what knowledge of homes: a run with each of "
                    f"--frames {SHOWN},{NO_CLUE},{BLANK},{OTHER}.",
                )
            },
        },
    )
    prompt: str | None = field(
        default=None,
        metadata={
            "choices": PROMPTS,
            "help": "Words of the question, for tasks that leave them open; default: "
            f"{PUBLISHED_MAIN}.",
        },
    )
    repeats: int = field(
        default=1,
        metadata={
            "help": "Ask each question N times, with replies drawn by the seeds from --seed on.",
            "metavar": "N",
        },
    )
    temperature: float | None = field(
        default=None,
        metadata={
            "help": "Draw replies at this temperature; default: as the task says, and 1 if it is "
            "repeated.",
            "metavar": "T",
        },
    )
    max_thinking_tokens: int | None = field(
        default=None,
        metadata={
            "help": "Tokens for what a model thinks, beside those of its answer.",
            "metavar": "N",
        },
    )

    def __post_init__(self) -> None:
        """Raise UsageError if a value is not valid."""
        super().__post_init__()
        if self.max_thinking_tokens is not None and self.max_thinking_tokens < 1:
            raise UsageError(
                f"--max-thinking-tokens {self.max_thinking_tokens}: give 1 or more, or leave it out"
            )
        if self.repeats < 1:
            raise UsageError(f"--repeats {self.repeats}: a question is asked once at least")
        if self.repeats > MOST_REPEATS:
            raise UsageError(f"--repeats {self.repeats}: give {MOST_REPEATS:,} at most")
        if self.temperature is not None and not 0 < self.temperature < float("inf"):
            raise UsageError(
                f"--temperature {self.temperature}: replies are drawn at a temperature above 0"
            )
        check_frames(self.frames)
        if self.tokens_per_frame is not None and self.tokens_per_frame < 1:
            raise UsageError(
                f"--tokens-per-frame {self.tokens_per_frame}: a frame has one token at least"
            )


def check_frames(frames: str) -> None:
    """Check the name of a frame ablation.

    Raises:
        UsageError: there is no such ablation; the message has those that there are.
    """
    if frames not in FRAMES:
        raise UsageError(f"--frames {frames}: there are {', '.join(FRAMES)}")
