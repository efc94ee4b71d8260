"""Options of memories on the command line, which the suites share."""

from dataclasses import dataclass
from typing import Annotated

from infthor_eval.memory.budgets import read_budget
from infthor_eval.settings import Setting

_CAUSE = "the memory"


@dataclass(frozen=True, kw_only=True)
class MemoryOptions:
    """The options `--memory`, `--memory-args` and `--budget`."""

    memory: Annotated[
        str | None,
        Setting(
            help="Memories for tasks that need one (nieh_memory, --history memory), a run with "
            "each; `ls memories`, or FILE.py:CLASS.",
            where="memory",
            in_config=True,
            cause=_CAUSE,
            metavar="NAME,...",
            each=True,
        ),
    ] = None
    memory_args: Annotated[
        str | None,
        Setting(
            help="Options of the memory (see `ls memories`).",
            where="memory",
            in_config=True,
            cause=_CAUSE,
            metavar="K=V,...",
        ),
    ] = None
    budget: Annotated[
        str | None,
        Setting(
            help="Most tokens of what a memory recalls, a run with each; default: the memory's "
            "own limit.",
            where="memory",
            in_config=True,
            cause=_CAUSE,
            metavar="TOKENS,...",
            each=True,
        ),
    ] = None

    def __post_init__(self) -> None:
        """Raise UsageError for a budget that is none."""
        read_budget(self.budget)
