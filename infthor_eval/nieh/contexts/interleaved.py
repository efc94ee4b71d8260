"""Goals, actions and frames of a trajectory in order: in the published words (published:
`interleaved`), or with plans as agents are trained on it (`traj.txt`)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import takewhile

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.outline import Outline
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.formats.reading import read_text
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, QuestionVariant

_STATE = " State: "  # text before frames
_MARK = "<image>"  # the place of a frame in traj.txt
_ACT = "<|act|>"  # the end of an action there


def interleaved(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on each task's goal and the frame before it, then every action with its frames."""
    outline = data.outline(question.traj_id)
    if outline is None:
        return [SkippedQuestion(question, data.missing_outline)]
    layout = _layout(outline, data.action_frames(question.traj_id))
    return [_until_moment(data, question, [part for part in layout if isinstance(part, int)])]


def interleaved_parts(
    data: NiehSet, sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return the texts with the frames in their places."""
    outline = data.outline(sample.question.traj_id)
    assert outline is not None  # or there were no sample
    layout = _layout(outline, data.action_frames(sample.question.traj_id))
    return _with_frames(layout, sample, frames)


def _until_moment(data: NiehSet, question: Question, positions: Sequence[int]) -> QuestionVariant:
    """Return the sample with these frames, up to the question's moment."""
    end = len(data.frames_until(question))
    return QuestionVariant(question, tuple(takewhile(lambda position: position < end, positions)))


def _with_frames(
    layout: Iterable[str | int], sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return texts with frames in the places of numbers; of a question at a moment, up to the last
    of its frames: what comes after it tells of later actions."""
    left = iter(frames)
    parts: list[ContextPart] = []
    end = 0
    for part in layout:
        frame = next(left, None) if isinstance(part, int) else part
        if frame is None:
            break
        parts.append(frame)
        end = len(parts) if isinstance(part, int) else end
    return parts if sample.question.moment is None else parts[:end]


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


def interleaved_plans(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on goals, plans, frames and actions in time order; of an action's frames, on the last."""
    n_frames = len(data.frames(question.traj_id))
    done = _actions_before_marks(_sequence_text(data.folder(question.traj_id)))
    n_actions = max(done, default=0)
    if n_actions + 1 == n_frames:
        return [_until_moment(data, question, done)]
    after_actions = [0, *(frames[-1] for frames in data.action_frames(question.traj_id).values())]
    if n_actions + 1 != len(after_actions):
        reason = (
            f"traj.txt has {n_actions} actions, which fit neither the frames nor expert_log.json"
        )
        return [SkippedQuestion(question, reason)]
    return [_until_moment(data, question, [after_actions[number] for number in done])]


def _actions_before_marks(text: str) -> list[int]:
    """Return the number of actions before each frame mark. The frame after a goal shows the result
    of the last one."""
    done = []
    n_actions = 0
    for before in text.split(_MARK)[:-1]:
        n_actions += before.rstrip().endswith(_ACT)
        done.append(n_actions)
    return done


def plans_parts(
    data: NiehSet, sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return the texts of traj.txt with the frames in their places."""
    texts = _sequence_text(data.folder(sample.question.traj_id)).strip().split(_MARK)
    marked = [part for number, text in enumerate(texts) for part in (number, text)][1:]
    return [part for part in _with_frames(marked, sample, frames) if part]


def _sequence_text(folder: SetPath) -> str:
    return read_text(folder / "traj.txt", "replay the trajectory again")
