"""What a memory recalls of the trajectory, and the agent's current view.

A memory is opened for a task's identity, but it recalls only when a question is asked: that can
take long, and some ask the model under test (`infthor_eval.nieh.asking.recalling`).
"""

from collections.abc import Sequence
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.memory import accepted_options, memory_identity, open_memory
from infthor_eval.memory.caches import FRAMES
from infthor_eval.nieh.contexts.base import (
    ContextPart,
    ContextSettings,
    QuestionVariant,
    RecallSettings,
)

# Stands for what will be recalled, in prompts of samples that no model was asked.
_UNRECALLED = "<memory>"
_OF_RETRIEVER = ("retriever", "retriever_revision")


def memory(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on what a memory recalls of the frames before the last, and on the last (the view)."""
    return [
        QuestionVariant(
            question, tuple(range(len(data.frames_until(question)))), recall=_recall(settings)
        )
    ]


def memory_sources(_data: NiehSet, settings: ContextSettings) -> dict[str, Any]:
    """Return the identity of the memory: another one recalls other things."""
    recall = _recall(settings)
    cache = open_memory(recall.memory, recall.options).capabilities.cache
    least = recall.tokens_per_frame or 0
    if cache == FRAMES and recall.budget is not None and recall.budget < least:
        raise UsageError(
            f"--budget {recall.budget}: less than a frame, which has {least} tokens; give more"
        )
    return memory_identity(recall.memory, recall.options)


def recalled_parts(
    _data: NiehSet, sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return what was recalled in order (a mark before it is), then the last frame."""
    if sample.recalled is None:
        return [_UNRECALLED, *frames[-1:]]
    if sample.cut is not None:
        return list(frames)
    left = iter(frames)
    return [*(part if isinstance(part, str) else next(left) for part in sample.recalled), *left]


def _recall(settings: ContextSettings) -> RecallSettings:
    if settings.memory is None:
        raise UsageError(
            "this task needs a memory: give --memory NAME; `infthor-eval ls memories` lists them"
        )
    options = dict(settings.memory_args)
    for name in _OF_RETRIEVER:
        value = getattr(settings, name)
        if value is not None and name in accepted_options(settings.memory):
            options.setdefault(name, value)
    # Without a budget the size of a frame decides nothing: recalls are the same for every model.
    size = settings.tokens_per_frame if settings.budget is not None else None
    return RecallSettings(
        settings.memory, tuple(sorted(options.items())), settings.budget, size, settings.seed
    )
