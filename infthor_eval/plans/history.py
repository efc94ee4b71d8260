"""How much of the true history a model is given before it acts."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.blank import blank_like
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT, action_part, goal_part, plan_part
from infthor_eval.memory import (
    Observation,
    Query,
    TrajectoryFacts,
    accepted_options,
    check_recalled,
    memory_identity,
    open_memory,
    parse_options,
    read_budget,
    wrap_memory_errors,
)
from infthor_eval.plans.segments import Part, PlanSegment, goal_of_last, restart_at, segment_parts

__all__ = [
    "CountTokens",
    "FullHistory",
    "History",
    "LastTokens",
    "MemoryChoice",
    "Past",
    "PublishedHistory",
    "RecalledHistory",
    "StateInWords",
    "history_named",
]

CountTokens = Callable[[Sequence[Part]], int | None]
Options = tuple[tuple[str, Any], ...]  # sorted pairs


@dataclass(frozen=True)
class Past:
    """The history before a plan.

    Attributes:
        segments: segments of the plans before.
        present: the plan's own segment, without a step.
        state: the state of room and agent in words, as far as it was seen; empty if no history needs it.
    """

    segments: Sequence[PlanSegment]
    present: PlanSegment
    state: str = ""

    @property
    def all(self) -> list[PlanSegment]:
        """All segments, the present one last."""
        return [*self.segments, self.present]

    @property
    def goal(self) -> str:
        """The goal that the plan belongs to."""
        return goal_of_last(self.all)

    @property
    def frames(self) -> list[FrameRef]:
        """Every frame before the present one."""
        return [step.frame for step in self.observations()[:-1]]

    def observations(self, blank: bool = False) -> list[Observation]:
        """Return all steps as a memory observes them, the present one last; with `blank` their frames are grey."""
        steps: list[tuple[FrameRef, str | None, str | None]] = []
        goal = None
        for segment in self.all:
            goal = segment.goal or goal
            if not steps:
                steps.append((segment.before, None, goal))
            steps += [(frame, action, goal) for action, frame in segment.steps]
        return [
            Observation(number=number, frame=blank_like(frame) if blank else frame, action=action, goal=of_step)
            for number, (frame, action, of_step) in enumerate(steps)
        ]


class History(Protocol):
    """Selects what a model is given of the past; `needs_state` tells whether it needs the state in words."""

    needs_state: ClassVar[bool]

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what the model is given before the first action of a plan.

        Args:
            count: counts the tokens of some parts; returns None if the model does not count.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the required parts do not fit.
        """


class FullHistory:
    """The whole history."""

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        return segment_parts(past.all)


class PublishedHistory:
    """The whole history as the published loop writes it.

    Three things differ from `FullHistory`: the first action of each past plan stands behind two marks, as the plan's
    own is there already; behind every goal is the first frame of the scene, which the loop keeps from its last set-up;
    plans that belong to no task are left out.
    """

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        parts: list[Part] = []
        for segment in past.all:
            if segment.goal is not None:
                parts += goal_part(segment.goal), past.all[0].before
            if segment.in_task:
                parts += plan_part(segment.plan), *((ACT,) if segment.steps else ())
                parts += (part for action, frame in segment.steps for part in (action_part(action), frame))
        return parts


class LastTokens:
    """As many of the last plans as fit, after the goal that they belong to and the frame that they begin with.

    Whole plans are left out, from the first on, and the goal is repeated if the rest would begin without it. So every
    window has the form of a trajectory's beginning, which is what the models were trained on.
    """

    needs_state: ClassVar[bool] = False

    def __init__(self, n_tokens: int) -> None:
        """Set the maximum number of tokens before the model's first action; the plan's own steps come on top."""
        self._n_tokens = n_tokens

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`; by bisection, as each count encodes the window."""
        segments = past.all
        least, most = 1, len(segments)  # number of last segments
        if not self._fits(segments, least, count):
            raise ModelError(
                f"the plan alone takes more than {self._n_tokens} tokens; give --history last:N a larger N"
            )
        while least < most:
            middle = (least + most + 1) // 2
            if self._fits(segments, middle, count):
                least = middle
            else:
                most = middle - 1
        return _window(segments, least)

    def _fits(self, segments: Sequence[PlanSegment], n_last: int, count: CountTokens) -> bool:
        n_tokens = count(_window(segments, n_last))
        if n_tokens is None:
            raise ModelError("the model counts no tokens, so --history last:N cannot be used; use full")
        return n_tokens <= self._n_tokens


def _window(segments: Sequence[PlanSegment], n_last: int) -> list[Part]:
    return segment_parts(restart_at(segments, len(segments) - n_last))


class StateInWords:
    """The present frame, and what was seen before it in words, as in the published text state."""

    needs_state: ClassVar[bool] = True

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        text = f" State: {past.state}; Last agent's view: "
        return [goal_part(past.goal) + text, past.present.before, plan_part(past.present.plan)]


class RecalledHistory:
    """What a memory recalls of the steps before the present one (`infthor_eval.memory`), the goal, and that frame.

    The memory observes each step once, as long as one episode goes on.
    """

    needs_state: ClassVar[bool] = False

    def __init__(self, name: str, options: Options = (), budget: int | None = None, blank: bool = False) -> None:
        """Open a memory.

        Args:
            name: its name, or FILE.py:CLASS.
            options: options of its class, sorted pairs.
            budget: most tokens of what it recalls; None for its own limit.
            blank: whether it observes blank frames.

        Raises:
            UsageError: there is no such memory, or it needs what an agent does not have.
        """
        self._name, self._options, self._budget, self._blank = name, options, budget, blank
        self._memory = open_memory(name, options)
        capabilities = self._memory.capabilities
        if capabilities.privileged or capabilities.writes:
            needs = "metadata and clues" if capabilities.privileged else "a model that writes for it"
            raise UsageError(f"the memory {name} needs {needs}, which agents do not have; take another")
        self.identity()  # opens what the memory needs now, rather than at the first plan
        self._observed: list[Observation] = []
        self._in_use = threading.Lock()  # episodes in flight share it

    def identity(self) -> dict[str, Any]:
        """Return everything that can change what is recalled, as JSON values."""
        return memory_identity(self._name, self._options) | {"budget": self._budget}

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        recalled = self.choose(past, count)
        return [*recalled, goal_part(past.goal), past.present.before, plan_part(past.present.plan)]

    def choose(self, past: Past, count: CountTokens) -> list[Part]:
        """Return what is recalled, in order.

        Raises:
            DataError: a frame cannot be read.
            ModelError: there is a budget and the model counts no tokens, or the memory exceeds it.
            UserCodeError: the memory fails.
        """
        *steps, present = past.observations(self._blank)
        query = Query(text=f"{past.goal} {past.present.plan}", present=present)
        size = self._tokens_per_frame(present, count)
        with self._in_use, wrap_memory_errors(self._name):
            self._observe(steps, size)
            recalled = self._memory.recall(query, self._budget)
        check_recalled(recalled, steps, self._name, self._budget, size)
        frames = past.frames
        return [item if isinstance(item, str) else frames[item.number] for item in recalled]

    def _tokens_per_frame(self, present: Observation, count: CountTokens) -> int | None:
        if self._budget is None:
            return None
        both, one = count([present.frame, present.frame]), count([present.frame])
        if both is None or one is None:
            raise ModelError("the model counts no tokens, so --budget cannot be used; leave it out")
        return both - one

    def _observe(self, steps: Sequence[Observation], tokens_per_frame: int | None) -> None:
        """Observe the steps that are new, or all of them where another episode has begun."""
        n_known = len(self._observed)
        if not n_known or list(steps[:n_known]) != self._observed:
            n_known = 0
            self._memory.begin(TrajectoryFacts(name="episode", tokens_per_frame=tokens_per_frame))
        for step in steps[n_known:]:
            self._memory.observe(step)
        self._observed = list(steps)


def history_named(text: str, memory: "MemoryChoice") -> History:
    """Return the history of a value of `--history`.

    Args:
        text: "full", "published", "last:N" (N tokens), "text", "frames:K" (K frames), or "memory".
        memory: the options of memories.

    Raises:
        UsageError: there is no such history, or an option is given that it does not use.
    """
    kind, _, number = text.partition(":")
    size = int(number) if number.isdecimal() else 0
    if text == "memory":
        return memory.open()
    memory.refuse(text)
    if kind == "frames" and size:  # the paper's image memory (20 frames)
        return MemoryChoice("clip-view", f"k={size}", None, memory.retriever, memory.blank).open()
    if memory.retriever is not None:
        raise UsageError(f"--retriever: --history {text} retrieves no frames; leave it out, or use --history frames:K")
    if text == "full":
        return FullHistory()
    if text == "published":
        return PublishedHistory()
    if text == "text":
        return StateInWords()
    if kind == "last" and size:
        return LastTokens(size)
    raise UsageError(f"--history {text}: there are full, published, last:TOKENS, text, frames:K and memory")


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
        """Open the memory.

        Raises:
            UsageError: none is named, or it cannot be opened.
        """
        if self.name is None:
            raise UsageError("--history memory: give --memory NAME; `infthor-eval ls memories` lists them")
        options = parse_options(self.options) or {}
        if self.retriever is not None:
            if "retriever" not in accepted_options(self.name):
                raise UsageError(f"--retriever: the memory {self.name} retrieves no frames; leave it out")
            options["retriever"] = self.retriever
        budget = read_budget(self.budget)
        return RecalledHistory(self.name, tuple(sorted(options.items())), budget, self.blank)

    def refuse(self, history: str) -> None:
        """Refuse options of memories with another history.

        Raises:
            UsageError: there is one.
        """
        given = {"--memory": self.name, "--memory-args": self.options, "--budget": self.budget}
        for option, value in given.items():
            if value is not None:
                raise UsageError(f"{option} {value}: --history {history} has no memory; use --history memory")
