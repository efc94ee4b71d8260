"""What NIEH can be told on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.errors import UsageError

__all__ = ["SHOWN", "NiehOptions", "check_frames"]

SHOWN = "shown"
_FRAMES = (SHOWN, "blank", "shuffled", "other")  # see `infthor_eval.nieh.stand_ins`


@dataclass(frozen=True, kw_only=True)
class NiehOptions:
    """Options of the suite; the help that people see stands with each.

    Attributes:
        k_tokens: tokens of a kilo-token in contexts of a given size; None takes each context's published value.
        tokens_per_frame: tokens of one frame for such contexts; None asks the model.
        retriever: CLIP model of contexts that retrieve frames, a hub id or a folder; None takes the published one.
        retriever_revision: branch, tag or commit of it on the hub; None is the default branch.
        trajectories: folder of the set's trajectories (the published scripts' `--traj_dir`); None where they lie in it.
        frames: what is shown in the frames' places: they themselves, or stand-ins.
    """

    k_tokens: int | None = field(
        default=None,
        metadata={
            "choices": ("1000", "1024"),
            "help": "Tokens of a kilo-token where a context has a size; each context's published value if not given.",
        },
    )
    tokens_per_frame: int | None = field(
        default=None,
        metadata={
            "help": "Tokens of one frame where a context has a size, for models that count none.",
            "metavar": "N",
        },
    )
    retriever: str | None = field(
        default=None,
        metadata={"help": "CLIP model of retrieval tasks, a hub id or a folder.", "metavar": "NAME", "is_place": True},
    )
    retriever_revision: str | None = field(
        default=None, metadata={"help": "Branch, tag or commit of the retriever on the hub.", "metavar": "REVISION"}
    )
    trajectories: str | None = field(
        default=None,
        metadata={
            "help": "Folder of the set's trajectories (TRAJ_ID.json or .txt) where they do not lie in the set.",
            "metavar": "DIR",
            "is_place": True,
        },
    )
    frames: str = field(
        default=SHOWN,
        metadata={
            "help": f"Show what in the frames' places, a run with each: {', '.join(_FRAMES)} (another trajectory's).",
            "metavar": "HOW,...",
            "each": True,
        },
    )

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            UsageError: a frame without tokens, or unknown stand-ins for frames.
        """
        check_frames(self.frames)
        if self.tokens_per_frame is not None and self.tokens_per_frame < 1:
            raise UsageError(f"--tokens-per-frame {self.tokens_per_frame}: a frame has one token at least")


def check_frames(frames: str) -> None:
    """Refuse stand-ins for frames that there are not.

    Raises:
        UsageError: names those that there are.
    """
    if frames not in _FRAMES:
        raise UsageError(f"--frames {frames}: there are {', '.join(_FRAMES)}")
