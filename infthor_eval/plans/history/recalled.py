"""A memory in front of an agent: what it recalls of the steps before the present one."""

import threading
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

from infthor_eval.errors import DataError, ModelError, UsageError
from infthor_eval.memory import (
    MemoryArgs,
    Observation,
    Query,
    TrajectoryFacts,
    accepted_options,
    check_recalled,
    memory_identity,
    open_memory,
    parse_options,
    pieces_of,
    read_budget,
    wrap_memory_errors,
)
from infthor_eval.plans.history.past import ChosenHistory, CountTokens, Past
from infthor_eval.plans.history.segments import Part


class RecalledHistory(ChosenHistory):
    """What a memory (`infthor_eval.memory`) recalls of earlier steps, the goal, and the frame.

    The memory observes each step once, as long as one episode goes on.
    """

    def __init__(
        self, name: str, options: MemoryArgs = (), budget: int | None = None, blank: bool = False
    ) -> None:
        """Open a memory.

        Args:
            name: its name, or FILE.py:CLASS.
            options: options of its class, sorted pairs.
            budget: most tokens of what it recalls; None for its own limit.
            blank: whether it observes blank frames.
        """
        self._name = name
        self._options = options
        self._budget = budget
        self._blank = blank
        self._memory = open_memory(name, options)
        self._privileged = self._memory.capabilities.privileged
        if self._memory.capabilities.writes:
            raise UsageError(
                f"the memory {name} needs a model that writes for it, as agents do not; take "
                "another"
            )
        if self._memory.capabilities.cache:
            raise UsageError(
                f"the memory {name} cuts the model's cache, for questions alone; take one of frames"
            )
        self.identity()  # opens what the memory needs now, rather than at the first plan
        self._observed: list[Observation] = []
        self._in_use = threading.Lock()  # episodes in flight share it

    def identity(self) -> dict[str, Any]:
        """Return everything that can change what is recalled, as JSON values."""
        return memory_identity(self._name, self._options) | {"budget": self._budget}

    def choose(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what is recalled, in order."""
        if self._privileged and not past.logs:
            raise DataError(
                f"the trajectory has no log of what is in view, which the memory {self._name} needs"
            )
        *steps, present = past.observations(self._blank, self._privileged)
        clues = (() if past.clue is None else (past.clue,)) if self._privileged else None
        query = Query(
            text=f"{past.goal} {past.present.plan}", present=_copied(present), clues=clues
        )
        size = self._tokens_per_frame(present, count)
        with self._in_use:
            self._observe(steps, size)
            with wrap_memory_errors(self._name):
                recalled = pieces_of(self._memory.recall(query, self._budget), self._name)
        check_recalled(recalled, steps, self._name, self._budget, size)
        frames = past.frames
        return [item if isinstance(item, str) else frames[item.number] for item in recalled]

    def _tokens_per_frame(self, present: Observation, count: CountTokens) -> int | None:
        if self._budget is None:
            return None
        both = count([present.frame, present.frame])
        one = count([present.frame])
        if both is None or one is None:
            raise ModelError("the model counts no tokens, so --budget cannot be used; leave it out")
        return both - one

    def _observe(self, steps: Sequence[Observation], tokens_per_frame: int | None) -> None:
        """Observe the steps that are new, or all of them where another episode has begun."""
        n_known = len(self._observed)
        if not n_known or list(steps[:n_known]) != self._observed:
            n_known = 0
            with wrap_memory_errors(self._name):
                facts = TrajectoryFacts(name="episode", tokens_per_frame=tokens_per_frame)
                self._memory.begin(facts)
        for step in steps[n_known:]:
            with wrap_memory_errors(self._name):
                self._memory.observe(_copied(step))
        self._observed = list(steps)


def _copied(step: Observation) -> Observation:
    """Return a step with a log of its own: a memory may change what it is given."""
    return replace(step, log=deepcopy(step.log))


@dataclass(frozen=True)
class MemoryChoice:
    """The options of a run that choose a memory, as they were typed.

    Attributes:
        blank: whether it observes blank frames.
    """

    name: str | None = None
    options: str | None = None
    budget: str | None = None
    retriever: str | None = None
    blank: bool = False

    def open(self) -> RecalledHistory:
        """Open the memory."""
        if self.name is None:
            raise UsageError(
                "--history memory: give --memory NAME; `infthor-eval ls memories` lists them"
            )
        options = parse_options(self.options) or {}
        if self.retriever is not None:
            if "retriever" not in accepted_options(self.name):
                raise UsageError(
                    f"--retriever: the memory {self.name} retrieves no frames; leave it out"
                )
            options["retriever"] = self.retriever
        budget = read_budget(self.budget)
        return RecalledHistory(self.name, tuple(sorted(options.items())), budget, self.blank)

    def refuse(self, history: str) -> None:
        """Refuse options of memories with another history."""
        typed = {"--memory": self.name, "--memory-args": self.options, "--budget": self.budget}
        for option, value in typed.items():
            if value is not None:
                raise UsageError(
                    f"{option} {value}: --history {history} has no memory; use --history memory"
                )
