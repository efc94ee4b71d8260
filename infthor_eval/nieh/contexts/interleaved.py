"""Goals, actions and frames of a trajectory in the published words (published: `interleaved`)."""

from collections.abc import Iterator, Mapping, Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.outline import Outline
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample

_STATE = " State: "  # text before frames


def interleaved(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on each task's goal and the frame before it, then every action with its frames."""
    outline = data.outline(question.traj_id)
    if outline is None:
        return [SkippedQuestion(question, data.missing_outline)]
    layout = _layout(outline, data.action_frames(question.traj_id))
    return [Sample(question, tuple(part for part in layout if isinstance(part, int)))]


def interleaved_parts(
    data: NiehSet, sample: Sample, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return the texts with the frames in their places."""
    outline = data.outline(sample.question.traj_id)
    assert outline is not None  # or there were no sample
    left = iter(frames)
    layout = _layout(outline, data.action_frames(sample.question.traj_id))
    return [next(left) if isinstance(part, int) else part for part in layout]


def _layout(outline: Outline, frames_of: Mapping[int, tuple[int, ...]]) -> Iterator[str | int]:
    """Yield texts, and frames by their position in the trajectory."""
    actions = outline.actions
    for goal, span in outline.tasks:
        yield f"Your task goal: {goal}. "
        yield _STATE
        # The frame from which the first action starts: the last before it, or the first of all.
        yield next(
            (
                frames_of[number][-1]
                for number in range(span.start - 1, -1, -1)
                if number in frames_of
            ),
            0,
        )
        for number in span:
            yield f" Action: {actions[number]}"
            if number in frames_of:
                yield _STATE
                yield from frames_of[number]
