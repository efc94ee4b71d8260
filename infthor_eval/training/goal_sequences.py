"""Sequences of goals, actions and frames in one turn, as for the Qwen2.5-VL of the final tasks.

They are those of `infini_thor_dataset.py` (branch `dev`), in text, frames and ends: no text of a
plan, a system prompt, one turn of the user. Later windows begin with the goal and the last frame of
the window before.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT, action_part, task_goal_part
from infthor_eval.plans.history.segments import Part, PlanSegment
from infthor_eval.plans.published.system_prompts import system_prompt
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence

# tokens that the trainer keeps free: its count of the system prompt (1), and 8 of the template's
_FEWER = 9


@dataclass
class _Window:
    """Parts so far, and their tokens as the trainer counts them."""

    parts: list[Part] = field(default_factory=list)
    n_tokens: int = 0

    def add(self, parts: Sequence[Part], n_tokens: int) -> None:
        self.parts += parts
        self.n_tokens += n_tokens


def goal_windows(
    encoder: Encoder, name: str, segments: Sequence[PlanSegment], limit: int
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Cut a history into sequences of goals, actions and frames, as published: without loose plans.

    Args:
        encoder: builds the sequences.
        name: name of the trajectory.
        segments: history of the trajectory.
        limit: most tokens of a sequence as the trainer counts: a text is one, so that the true
            number is up to a twentieth above. A plan that exceeds it alone ends where it does.

    Raises:
        DataError: a frame cannot be read, or a text contains a mark.
        ModelError: the template refuses the sequence.
    """
    if not segments:
        return
    frame_tokens = encoder.frame_tokens(segments[0].before)
    windows = [
        parts
        for parts in goals_of_actions(segments, limit, frame_tokens)
        if ACT in "".join(_texts(parts))
    ]
    for number, parts in enumerate(windows, start=1):
        yield encoder.actions(
            f"{name}, window {number} of {len(windows)}", parts, system_prompt("goals")
        )


def goals_of_actions(
    segments: Sequence[PlanSegment], limit: int, frame_tokens: int
) -> Iterator[list[Part]]:
    """Yield the texts and frames of each window; `frame_tokens` is the number of tokens of a frame.

    Raises:
        DataError: not one action with its frame fits.
    """
    if 1 + frame_tokens >= limit:
        raise DataError(
            f"max_tokens is {limit}, too few for one action and its frame ({1 + frame_tokens})"
        )
    window = _Window()
    goal = ""
    last = segments[0].before
    for segment in segments:
        if segment.goal is not None:
            goal = task_goal_part(segment.goal)
            window.add([goal, last], 1 + frame_tokens)
        if not segment.in_task:
            continue
        n_actions = min(len(segment.steps), _most_actions(limit, frame_tokens))
        plan = [
            part
            for action, frame in segment.steps[:n_actions]
            for part in (action_part(action), frame)
        ]
        n_tokens = n_actions * (1 + frame_tokens)
        if window.n_tokens + n_tokens >= limit - _FEWER:
            yield window.parts
            window = _Window([goal, last], 1 + frame_tokens)
        window.add(plan, n_tokens)
        last = _last_frame(window.parts)
    yield window.parts


def _most_actions(limit: int, frame_tokens: int) -> int:
    """Return how many actions of one plan stay below the limit."""
    return (limit - 1) // (1 + frame_tokens)


def _last_frame(parts: Sequence[Part]) -> FrameRef:
    return next(part for part in reversed(parts) if isinstance(part, FrameRef))


def _texts(parts: Sequence[Part]) -> Iterator[str]:
    return (part for part in parts if isinstance(part, str))
