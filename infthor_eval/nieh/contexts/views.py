"""Frames alone: the clues, the whole trajectory, its end, those that a CLIP model finds nearest to
the question; and the last state in words."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import (
    VIEW_FOLLOWS,
    ContextPart,
    ContextSettings,
    QuestionVariant,
)

if TYPE_CHECKING:
    from model_adapters.hf.retrieval import Retriever

_K_TOKENS = 1024  # truncate_head's published kilo-token


def clues(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on the evidence alone, in time order whatever the file's (the paper's Table 4)."""
    if not data.has_frames:  # baselines need no more than their number
        return [QuestionVariant(question, tuple(sorted(question.clues)))]
    return [QuestionVariant(question, tuple(sorted(data.clue_positions(question))))]


def trajectory(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on every frame of the trajectory (published: `full_traj`)."""
    return [QuestionVariant(question, tuple(range(len(data.frames_until(question)))))]


def truncate_head(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on the last frames that fit (published under the same name); earlier clues are lost.

    As published, the last one is always shown, though it be larger than the context.
    """
    n_all = len(data.frames_until(question))
    n_cut = max(0, n_all - max(1, settings.n_frames(_K_TOKENS)))
    return [QuestionVariant(question, tuple(range(n_cut, n_all)), n_cut=n_cut)]


def text_state(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on the last frame, beside the text of the last state (published under the same name)."""
    if not data.states(question.traj_id):
        reason = (
            "the trajectory has no state_summary"
            if data.outline(question.traj_id)
            else data.missing_outline
        )
        return [SkippedQuestion(question, reason)]
    if _last_action(data, question) is None:
        return [SkippedQuestion(question, "no state is told before the question's moment")]
    return [QuestionVariant(question, (len(data.frames_until(question)) - 1,))]


def state_parts(
    data: NiehSet, sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return the text of the last state, then the last frame."""
    last = _last_action(data, sample.question)
    assert last is not None  # or there were no sample
    state = data.states(sample.question.traj_id)[last]
    return [f" State: {state}{VIEW_FOLLOWS}", *frames]


def _last_action(data: NiehSet, question: Question) -> int | None:
    """Return the last action with a state that was over at a question's moment."""
    states = data.states(question.traj_id)
    if question.moment is None:
        return max(states)
    end = len(data.frames_until(question))
    shown = data.action_frames(question.traj_id)
    done = (action for action in states if action in shown and shown[action][-1] < end)
    return max(done, default=None)


def clip_retrieval(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on the `top_k` frames most similar to the question, in time order (published, k = 10).

    Of equally similar frames the earlier ones are taken; a trajectory of fewer frames is shown
    whole.
    """
    from model_adapters.hf.vectors import nearest

    retriever = _retriever(settings)
    try:
        vectors = retriever.frames(data.frames_until(question))
    except DataError as error:
        return [SkippedQuestion(question, str(error))]
    return [
        QuestionVariant(question, nearest(vectors, retriever.text(question.text), settings.top_k))
    ]


def retriever_identity(_data: NiehSet, settings: ContextSettings) -> dict[str, Any]:
    """Return the identity of the retriever: another one finds other frames."""
    return {"retriever": _retriever(settings).identity()}


def _retriever(settings: ContextSettings) -> "Retriever":
    from model_adapters.hf.retrieval import open_retriever

    return open_retriever(settings.clip_model, settings.retriever_revision)
