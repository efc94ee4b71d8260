"""Options of the suite of plans on the command line, beside its task files."""

from dataclasses import dataclass, field

from infthor_eval.episodes.options import SimulatorOptions
from infthor_eval.formats.object_ids import Words
from infthor_eval.memory.options import MemoryOptions


@dataclass(frozen=True, kw_only=True)
class PlansOptions(SimulatorOptions, MemoryOptions):
    """Options of the suite, with their help texts; None is the task's own."""

    rewards: str | None = field(
        default=None,
        metadata={
            "choices": ("default", "published"),
            "help": "Rules of rewards; the task's own if not given.",
        },
    )
    words: str | None = field(
        default=None,
        metadata={
            "choices": tuple(map(str, Words)),
            "help": "Words of plans and actions: the published ones, or plain English; the task's "
            "own if not given.",
        },
    )
    force_action: bool = field(
        default=False,
        metadata={
            "help": "Call the simulator with forceAction, as the published script does (--rewards "
            "published)."
        },
    )
    history: str | None = field(
        default=None,
        metadata={
            "help": "Past of a model: full, published, last:TOKENS, text, retrieved:K, frames:K, "
            "memory, goals, plans.",
            "metavar": "HOW",
        },
    )
    protocol: str | None = field(
        default=None,
        metadata={
            "choices": ("default", "published"),
            "help": "How final tasks are run: each plan from the true state, or in one go as in "
            "the published scripts.",
        },
    )
    after_failure: str | None = field(
        default=None,
        metadata={
            "choices": ("continue", "stop"),
            "help": "What follows a failed plan; the task's own if not given.",
        },
    )
    constrained: bool = field(
        default=False,
        metadata={"help": "Restrict replies to the actions that are possible in view."},
    )
    greedy: bool = field(
        default=False, metadata={"help": "Decode greedily instead of sampling as published."}
    )
    retriever: str | None = field(
        default=None,
        metadata={
            "help": "CLIP model that finds frames, a hub id or a folder.",
            "metavar": "NAME",
            "is_place": True,
        },
    )

    def __post_init__(self) -> None:
        """Raise UsageError if a value is not valid."""
        SimulatorOptions.__post_init__(self)
        MemoryOptions.__post_init__(self)
