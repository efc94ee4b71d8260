"""How much of the true history a model is given before it acts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import goal_part, plan_part
from infthor_eval.plans.history import Chapter, Part, chapter_parts, goal_before, opened

__all__ = ["FullHistory", "LastTokens", "Memory", "Past", "StateInWords", "TopFrames", "memory_named"]

Count = Callable[[Sequence[Part]], int | None]
_RETRIEVER = "openai/clip-vit-large-patch14"  # as published for questions


@dataclass(frozen=True)
class Past:
    """What there is to remember, before a plan.

    Attributes:
        chapters: the history, a chapter a plan.
        present: the plan's own chapter, without a step.
        state: the state of room and agent in words, so far as it was seen; empty where no memory asks for it.
    """

    chapters: Sequence[Chapter]
    present: Chapter
    state: str = ""

    @property
    def all(self) -> list[Chapter]:
        """The present chapter behind the others."""
        return [*self.chapters, self.present]

    @property
    def goal(self) -> str:
        """The goal that the plan serves."""
        return goal_before(self.all)

    @property
    def frames(self) -> list[FrameRef]:
        """Every frame before the present one."""
        after = [frame for chapter in self.chapters for _, frame in chapter.steps]
        return [chapter.before for chapter in self.all[:1] if after] + after[:-1]


class Memory(Protocol):
    """Chooses what a model is given.

    Attributes:
        needs_state: whether it wants the state in words.
    """

    needs_state: ClassVar[bool]

    def recall(self, past: Past, count: Count) -> list[Part]:
        """What the model sees before the first action of a plan.

        Args:
            past: what there is.
            count: tokens of parts, as the model takes them; None where it counts none.

        Raises:
            DataError: a frame cannot be read.
            ModelError: what must be there does not fit.
        """
        ...


class FullHistory:
    """All of it."""

    needs_state: ClassVar[bool] = False

    def recall(self, past: Past, count: Count) -> list[Part]:
        """See `Memory`."""
        return chapter_parts(past.all)


class LastTokens:
    """As many of the last plans as fit, behind the goal that they serve and the frame that they begin with.

    Whole plans are left out, from the first on, and the goal is said again where what is left would begin without it:
    so every window has the form of a trajectory's beginning, as the models know it.
    """

    needs_state: ClassVar[bool] = False

    def __init__(self, n_tokens: int) -> None:
        """Set the limit.

        Args:
            n_tokens: of what the model is given before its first action; what the plan adds comes on top.
        """
        self._n_tokens = n_tokens

    def recall(self, past: Past, count: Count) -> list[Part]:
        """See `Memory`; the number of plans is found by bisection, a count of tokens each."""
        chapters = past.all
        least, most = 1, len(chapters)  # how many of the last chapters
        if not self._fits(chapters, least, count):
            raise ModelError(
                f"the plan alone takes more than {self._n_tokens} tokens; give --history last:N a larger N"
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
        return n_tokens <= self._n_tokens


def _window(chapters: Sequence[Chapter], n_last: int) -> list[Part]:
    """The last chapters, the first of them beginning with its goal."""
    return chapter_parts(opened(chapters, len(chapters) - n_last))


class StateInWords:
    """No frame but the present one: what was seen so far in words, as the published text state has it."""

    needs_state: ClassVar[bool] = True

    def recall(self, past: Past, count: Count) -> list[Part]:
        """See `Memory`."""
        said = f" State: {past.state}; Last agent's view: "
        return [goal_part(past.goal) + said, past.present.before, plan_part(past.present.plan)]


class TopFrames:
    """The earlier frames that are most similar to the present one, in time order, and that one."""

    needs_state: ClassVar[bool] = False

    def __init__(self, n_frames: int, retriever: str) -> None:
        """Set the number.

        Args:
            n_frames: beside the present one; the paper shows 20.
            retriever: CLIP model, a hub id or a folder.

        Raises:
            UsageError: there is no such model.
        """
        from model_adapters.hf.retrieval import open_retriever

        self._n_frames, self._retriever = n_frames, open_retriever(retriever, None)

    def recall(self, past: Past, count: Count) -> list[Part]:
        """See `Memory`."""
        from model_adapters.hf.vectors import nearest

        frames, present = past.frames, past.present.before
        chosen: Sequence[int] = ()
        if frames:
            vectors = self._retriever.frames([*frames, present])
            chosen = nearest(vectors[:-1], vectors[-1], self._n_frames)
        shown = [frames[number] for number in chosen]
        return [*shown, goal_part(past.goal), present, plan_part(past.present.plan)]


def memory_named(text: str, retriever: str | None = None) -> Memory:
    """The memory that `--history` names.

    Args:
        text: "full", "last:N" (N tokens), "text", or "frames:K" (K frames).
        retriever: CLIP model of memories that retrieve frames; the published one where None.

    Raises:
        UsageError: there is none such, or a retriever that nothing looks at.
    """
    kind, _, number = text.partition(":")
    size = int(number) if number.isdecimal() else 0
    if kind == "frames" and size:
        return TopFrames(size, retriever or _RETRIEVER)
    if retriever is not None:
        raise UsageError(f"--retriever: --history {text} retrieves no frames; leave it out, or use --history frames:K")
    if text == "full":
        return FullHistory()
    if text == "text":
        return StateInWords()
    if kind == "last" and size:
        return LastTokens(size)
    raise UsageError(f"--history {text}: there are full, last:TOKENS, text and frames:K")
