"""Sequences as the published models for final tasks learned them: of goals, or behind a memory.

They are those of the branch `dev`, in text, frames and ends. Of goals, as for the Qwen2.5-VL
(`infini_thor_dataset.py`): goals, actions and frames in one turn of the user, no text of a plan, a
system prompt; later windows begin with the goal and the last frame of the window before. Behind a
memory (`infini_dataset_history.py`, `infini_dataset_clip.py`): the goal, the state in words or the
retrieved frames that the trajectory's file has for the action, the current frame, and the action as
the reply.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.grouping import grouped
from infthor_eval.household.sequence_text import ACT, action_part, action_text, task_goal_part
from infthor_eval.plans.history.retrieved import NamedImage, images_of
from infthor_eval.plans.history.segments import Part, PlanSegment
from infthor_eval.plans.plan import tasks_of
from infthor_eval.plans.published.system_prompts import system_prompt
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence, within

MemoryKind = Literal["text", "frames"]
_NAMES = "top20"  # the list of the published trainer
# tokens that the trainer keeps free: its count of the system prompt (1), and 8 of the template's
_FEWER = 9


class _Entry(msgspec.Struct):
    top20: list[str]


def memory_sequences(
    encoder: Encoder,
    data: NiehSet,
    trajectory: Trajectory,
    segments: Sequence[PlanSegment],
    kind: MemoryKind,
    limit: int,
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Yield a sequence for each action that the file has a memory for, in the file's order.

    Args:
        encoder: builds the sequences.
        data: set of the trajectory, with its frames.
        trajectory: the trajectory, with its memory.
        segments: its history.
        kind: which memory.
        limit: most tokens of a sequence, frames expanded; longer ones are skipped.
    """
    memory = _State(data, trajectory) if kind == "text" else _Retrieved(data, trajectory)
    frames = [segments[0].before, *(frame for segment in segments for _, frame in segment.steps)]
    goals = _goals(trajectory)
    for action in memory.actions:
        name = f"{trajectory.traj_id}, action {action}"
        if action not in goals:
            yield SkippedSequence(name, "belongs to no task")
            continue
        try:
            # The first action has no memory.
            before = memory.parts(action) if action else ["Initial state: "]
        except DataError as error:
            yield SkippedSequence(name, str(error))
            continue
        parts = [f"Your task is: {goals[action]}.\n", *before, frames[action], " Next action: "]
        reply = action_text(trajectory.plan.low_actions[action].api_action, Words.PUBLISHED)
        yield within(encoder.answer(name, parts, reply, system_prompt(kind)), limit)


class _State:
    """The states in words."""

    def __init__(self, data: NiehSet, trajectory: Trajectory) -> None:
        self._states = data.states(trajectory.traj_id)
        if not self._states:
            raise DataError(
                "the trajectory has no state_summary, which actions of the form text need"
            )

    @property
    def actions(self) -> Sequence[int]:
        return list(self._states)

    def parts(self, action: int) -> list[Part]:
        state = self._states[action]
        told = f" {state};" if state else ""
        return [f"State: You are in the middle of a room.{told}\n", "Current state: "]


class _Retrieved:
    """The retrieved frames; if none, each earlier action's first and last frame."""

    def __init__(self, data: NiehSet, trajectory: Trajectory) -> None:
        if not trajectory.retrieved_image:
            raise DataError(
                "the trajectory has no retrieved_image, which actions of the form frames need"
            )
        problem = f"retrieved_image is no list {_NAMES} for each action"
        where = f"trajectory {trajectory.traj_id}: {problem}"
        with wrap_errors(where, "restore the file", catch=msgspec.ValidationError):
            self._retrieved = msgspec.convert(
                trajectory.retrieved_image, dict[int, _Entry], strict=False
            )
        self._of_actions = _by_action(images_of(trajectory))
        self._frames = {Path(frame.name).stem: frame for frame in data.frames(trajectory.traj_id)}

    @property
    def actions(self) -> Sequence[int]:
        return list(self._retrieved)

    def parts(self, action: int) -> list[Part]:
        names = self._retrieved[action].top20
        if not names:
            names = [
                name for earlier in range(action) for name in self._of_actions.get(earlier, ())
            ]
        return ["Previous states: ", *map(self._frame, names), "\nCurrent state: "]

    def _frame(self, name: str) -> FrameRef:
        frame = self._frames.get(Path(name).stem)
        if frame is None:
            raise DataError(f"its retrieved frame {name!r:.60} is not in the set")
        return frame


def _by_action(images: Sequence[NamedImage]) -> Mapping[int, Sequence[str]]:
    """Return the first and the last frame of each action, or the one that it has."""
    names_by_action = grouped((image.low_idx, image.image_name) for image in images)
    return {
        action: names if len(names) == 1 else [names[0], names[-1]]
        for action, names in names_by_action.items()
    }


def _goals(trajectory: Trajectory) -> Mapping[int, str]:
    """Return the goal of each low-level action of a task."""
    spans = trajectory.sub_trajs
    tasks = tasks_of(trajectory) if spans else []
    return {
        action: task.text
        for task, span in zip(tasks, spans, strict=True)
        for action in range(*span.low_pddl_idx)
    }


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
    """Yield the texts and frames of each window; `frame_tokens` is the number of tokens of a
    frame."""
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
        last = next(part for part in reversed(window.parts) if isinstance(part, FrameRef))
    yield window.parts


def _most_actions(limit: int, frame_tokens: int) -> int:
    """Return how many actions of one plan stay below the limit."""
    return (limit - 1) // (1 + frame_tokens)


def _texts(parts: Sequence[Part]) -> Iterator[str]:
    return (part for part in parts if isinstance(part, str))
