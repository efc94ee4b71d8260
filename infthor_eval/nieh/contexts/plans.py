"""A trajectory as agents are trained on it (`traj.txt`): goals, plans, actions, tokens, frames."""

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.formats.reading import read_text
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample

_MARK = "<image>"  # the place of a frame in traj.txt
_ACT = "<|act|>"  # the end of an action there


def interleaved_plans(
    data: NiehSet, question: Question, _settings: ContextSettings
) -> list[Sample | SkippedQuestion]:
    """Ask on goals, plans, frames and actions in time order; of an action's frames, on the last."""
    n_frames = len(data.frames(question.traj_id))
    done = _actions_before_marks(_sequence_text(data.folder(question.traj_id)))
    n_actions = max(done, default=0)
    if n_actions + 1 == n_frames:
        return [Sample(question, tuple(done))]
    after_actions = [0, *(frames[-1] for frames in data.action_frames(question.traj_id).values())]
    if n_actions + 1 != len(after_actions):
        reason = (
            f"traj.txt has {n_actions} actions, which fit neither the frames nor expert_log.json"
        )
        return [SkippedQuestion(question, reason)]
    return [Sample(question, tuple(after_actions[number] for number in done))]


def _actions_before_marks(text: str) -> list[int]:
    """Return the number of actions before each frame mark. The frame after a goal shows the result
    of the last one."""
    done = []
    n_actions = 0
    for before in text.split(_MARK)[:-1]:
        n_actions += before.rstrip().endswith(_ACT)
        done.append(n_actions)
    return done


def plans_parts(data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """Return the texts of traj.txt with the frames in their places."""
    texts = _sequence_text(data.folder(sample.question.traj_id)).strip().split(_MARK)
    parts = (part for pair in zip_longest(texts, frames) for part in pair)
    return [part for part in parts if part]


def _sequence_text(folder: Path) -> str:
    return read_text(folder / "traj.txt", "replay the trajectory again")
