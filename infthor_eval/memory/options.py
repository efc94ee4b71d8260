"""Options of memories on the command line, which the suites share."""

from dataclasses import dataclass, field

from infthor_eval.memory.budgets import read_budget


@dataclass(frozen=True, kw_only=True)
class MemoryOptions:
    """The options, with their help texts."""

    memory: str | None = field(
        default=None,
        metadata={
            "help": "Memories for tasks that need one (nieh_memory, --history memory), a run with "
            "each; `ls memories`, or FILE.py:CLASS.",
            "metavar": "NAME,...",
            "each": True,
        },
    )
    memory_args: str | None = field(
        default=None,
        metadata={"help": "Options of the memory (see `ls memories`).", "metavar": "K=V,..."},
    )
    budget: str | None = field(
        default=None,
        metadata={
            "help": "Most tokens of what a memory recalls, a run with each; default: the memory's "
            "own limit.",
            "metavar": "TOKENS,...",
            "each": True,
        },
    )

    def __post_init__(self) -> None:
        """Raise UsageError for a budget that is none."""
        read_budget(self.budget)
