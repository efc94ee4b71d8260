"""The last state in words, and the last frame (published: `text_state`)."""

from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample

__all__ = ["state_parts", "text_state"]


def text_state(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on the last frame, beside the text of the last state."""
    if not data.states(question.traj_id):
        reason = (
            "the trajectory has no state_summary"
            if data.outline(question.traj_id)
            else data.missing_outline
        )
        return [SkippedQuestion(question, reason)]
    return [Sample(question, (len(data.frames(question.traj_id)) - 1,))]


def state_parts(data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """Return the text of the last state, then the last frame."""
    states = data.states(sample.question.traj_id)
    return [f" State: {states[max(states)]}; Last agent's view: ", *frames]
