"""Options of the suite of plans on the command line, beside its task files."""

from dataclasses import dataclass
from typing import Annotated

from infthor_eval.episodes.options import SimulatorOptions
from infthor_eval.formats.object_ids import Words
from infthor_eval.memory.options import MemoryOptions
from infthor_eval.settings import Setting

# Settings of task files that are options too; one that is not given is the task's own.
Rewards = Annotated[str, Setting(help="Rules of rewards.", choices=("default", "published"))]
WordsName = Annotated[
    str,
    Setting(
        help="Words of plans and actions: the published ones, or plain English.",
        choices=tuple(Words),
    ),
]
History = Annotated[
    str,
    Setting(
        help="Past of a model: full, published, last:TOKENS, text, retrieved:K, frames:K, "
        "memory, goals, plans.",
        metavar="HOW",
    ),
]
Protocol = Annotated[
    str,
    Setting(
        help="How final tasks are run: each plan from the true state, or in one go as in "
        "the published scripts.",
        choices=("default", "published"),
    ),
]
AfterFailure = Annotated[
    str,
    Setting(
        help="What follows a failed plan: the next from the true state, or nothing.",
        choices=("continue", "stop"),
    ),
]


@dataclass(frozen=True, kw_only=True)
class PlansOptions(SimulatorOptions, MemoryOptions):
    """Options of a run; None is the task's own."""

    rewards: Rewards | None = None
    words: WordsName | None = None
    force_action: Annotated[
        bool,
        Setting(
            help="Call the simulator with forceAction, as the published script does (--rewards "
            "published)."
        ),
    ] = False
    history: History | None = None
    protocol: Protocol | None = None
    after_failure: AfterFailure | None = None
    constrained: Annotated[
        bool, Setting(help="Restrict replies to the actions that are possible in view.")
    ] = False
    greedy: Annotated[bool, Setting(help="Decode greedily instead of sampling as published.")] = (
        False
    )
    retriever: Annotated[
        str | None,
        Setting(
            help="CLIP model that finds frames, a hub id or a folder.",
            metavar="NAME",
            is_place=True,
        ),
    ] = None

    def __post_init__(self) -> None:
        """Raise UsageError if a value is not valid."""
        SimulatorOptions.__post_init__(self)
        MemoryOptions.__post_init__(self)
