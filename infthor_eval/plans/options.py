"""What the suite of plans can be told on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.errors import UsageError

__all__ = ["PlansOptions"]

_FRAMES = ("shown", "blank")


@dataclass(frozen=True, kw_only=True)
class PlansOptions:
    """Options of the suite; the help that people see stands with each.

    Attributes:
        simulator: "embedded", "unity" (the build that ai2thor downloads), or the path of a Unity executable.
        scenes: folder with recorded floor plans, for trajectories in them.
        rewards: name of the rules; None takes the task's own.
        history: how much of the history a model is given; None takes the task's own.
        after_failure: whether an episode goes on after a failed plan; None takes the task's own.
        constrained: hold a model's replies to the actions that are possible.
        greedy: decode greedily instead of sampling as published.
        frames: what is shown in the frames' places.
        retriever: CLIP model of histories that retrieve frames, a hub id or a folder.
    """

    simulator: str = field(
        default="embedded",
        metadata={"help": "embedded, unity, or the path of a Unity executable.", "metavar": "NAME"},
    )
    scenes: str | None = field(
        default=None,
        metadata={"help": "Folder with recorded floor plans (thor_scenes/).", "metavar": "DIR", "is_place": True},
    )
    rewards: str | None = field(
        default=None,
        metadata={"choices": ("default", "published-compat"), "help": "Rules of rewards; the task's own if not given."},
    )
    history: str | None = field(
        default=None,
        metadata={"help": "What a model is given of the past: full, last:TOKENS, text, frames:K.", "metavar": "HOW"},
    )
    after_failure: str | None = field(
        default=None,
        metadata={"choices": ("continue", "stop"), "help": "What follows a failed plan; the task's own if not given."},
    )
    constrained: bool = field(
        default=False, metadata={"help": "Hold replies to the actions that are possible in view."}
    )
    greedy: bool = field(default=False, metadata={"help": "Decode greedily instead of sampling as published."})
    frames: str = field(
        default="shown",
        metadata={"help": "Show what in the frames' places, a run with each.", "metavar": "HOW,...", "each": True},
    )
    retriever: str | None = field(
        default=None,
        metadata={"help": "CLIP model that finds frames, a hub id or a folder.", "metavar": "NAME", "is_place": True},
    )

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            UsageError: unknown stand-ins for frames.
        """
        if self.frames not in _FRAMES:
            raise UsageError(f"--frames {self.frames}: tasks of plans have {', '.join(_FRAMES)}")
