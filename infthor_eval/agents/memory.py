"""How much of the true history a model is given before it acts."""

from collections.abc import Callable, Sequence
from typing import Protocol

from infthor_eval.agents.history import Chapter, Part, chapter_parts
from infthor_eval.errors import ModelError, UsageError

__all__ = ["FullHistory", "LastTokens", "Memory", "memory_named"]

Count = Callable[[Sequence[Part]], int | None]


class Memory(Protocol):
    """Chooses what a model is given."""

    def recall(self, past: Sequence[Chapter], present: Chapter, count: Count) -> list[Part]:
        """What the model sees before the first action of a plan.

        Args:
            past: the history, a chapter a plan.
            present: the plan's own chapter, without a step.
            count: tokens of parts, as the model takes them; None where it counts none.

        Raises:
            DataError: a frame cannot be read.
            ModelError: what must be there does not fit.
        """
        ...


class FullHistory:
    """All of it."""

    def recall(self, past: Sequence[Chapter], present: Chapter, count: Count) -> list[Part]:
        """See `Memory`."""
        return chapter_parts([*past, present])


class LastTokens:
    """As many of the last plans as fit, behind the goal that they serve and the frame that they begin with.

    Whole plans are left out, from the first on, and the goal is said again where what is left would begin without it:
    so every window has the form of a trajectory's beginning, as the models know it.
    """

    def __init__(self, n_tokens: int, reserve: int) -> None:
        """Set the limit.

        Args:
            n_tokens: of history and plan, as the model is given them.
            reserve: of these, for what the plan itself adds while it is carried out.
        """
        self._n_tokens = n_tokens
        self._reserve = reserve

    def recall(self, past: Sequence[Chapter], present: Chapter, count: Count) -> list[Part]:
        """See `Memory`; the number of plans is found by bisection, a count of tokens each."""
        chapters = [*past, present]
        least, most = 1, len(chapters)  # how many of the last chapters
        if not self._fits(chapters, least, count):
            raise ModelError(
                f"the plan alone takes more than {self._n_tokens - self._reserve} tokens; give a larger --history last:N"
            )
        while least < most:
            middle = (least + most + 1) // 2
            if self._fits(chapters, middle, count):
                least = middle
            else:
                most = middle - 1
        return _window(chapters, least)

    def _fits(self, chapters: Sequence[Chapter], n_last: int, count: Count) -> bool:
        n_tokens = count(_window(chapters, n_last))
        if n_tokens is None:
            raise ModelError("the model counts no tokens, so --history last:N cannot be held; use full")
        return n_tokens + self._reserve <= self._n_tokens


def _window(chapters: Sequence[Chapter], n_last: int) -> list[Part]:
    """The last chapters, the first of them beginning with its goal."""
    first, rest = chapters[-n_last], chapters[len(chapters) - n_last + 1 :]
    goal = next(item.goal for item in reversed(chapters[: len(chapters) - n_last + 1]) if item.goal is not None)
    opened = Chapter(first.plan, goal, first.before, first.steps)
    return chapter_parts([opened, *rest])


def memory_named(text: str, retriever: str | None = None) -> Memory:
    """The memory that `--history` names.

    Args:
        text: "full" or "last:N", N tokens.
        retriever: CLIP model of memories that retrieve frames.

    Raises:
        UsageError: there is none such.
    """
    kind, _, number = text.partition(":")
    if text == "full":
        return FullHistory()
    if kind == "last" and number.isdecimal() and int(number) > 0:
        return LastTokens(int(number), reserve=0)
    raise UsageError(f"--history {text}: there are full and last:TOKENS")
