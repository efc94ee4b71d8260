"""The frames that a CLIP model finds nearest to the question.

The retriever is imported where it is needed: that takes seconds, which other tasks need not wait.
"""

from typing import TYPE_CHECKING, Any

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextSettings, Sample

if TYPE_CHECKING:
    from model_adapters.hf.retrieval import Retriever


def clip_retrieval(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on the `top_k` frames most similar to the question, in time order (published, k = 10).

    Of equally similar frames the earlier ones are taken; a trajectory of fewer frames is shown
    whole.
    """
    from model_adapters.hf.vectors import nearest

    retriever = _retriever(settings)
    try:
        vectors = retriever.frames(data.frames(question.traj_id))
    except DataError as error:
        return [SkippedQuestion(question, str(error))]
    return [Sample(question, nearest(vectors, retriever.text(question.text), settings.top_k))]


def retriever_identity(_data: NiehSet, settings: ContextSettings) -> dict[str, Any]:
    """Return the identity of the retriever: another one finds other frames."""
    return {"retriever": _retriever(settings).identity()}


def _retriever(settings: ContextSettings) -> "Retriever":
    from model_adapters.hf.retrieval import open_retriever

    return open_retriever(settings.clip_model, settings.retriever_revision)
