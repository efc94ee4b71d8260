"""Contexts in which text stands between or instead of frames."""

import json
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, Sample

__all__ = ["interleaved", "interleaved_parts", "last_state", "state_parts"]

_MARK = "<image>"  # where a frame stands in traj.txt
_ACT = "<|act|>"  # what ends an action there


def interleaved(data: NiehSet, question: Question, _settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """Goals, frames and actions of the whole trajectory in time order (published: `interleaved`)."""
    n_frames = len(data.frames(question.traj_id))
    done = _actions_before_marks(_sequence_text(data.folder(question.traj_id)))
    n_actions = max(done, default=0)
    if n_actions + 1 == n_frames:
        return [Sample(question, tuple(done))]
    after_actions = [0, *_frames_after_actions(data, question.traj_id)]
    if n_actions + 1 != len(after_actions):
        reason = f"traj.txt has {n_actions} actions, which fit neither the frames nor expert_log.json"
        return [SkippedQuestion(question, reason)]
    return [Sample(question, tuple(after_actions[number] for number in done))]


def _actions_before_marks(text: str) -> list[int]:
    """How many actions each frame mark comes after. The frame behind a goal shows what the last action left."""
    done, n_actions = [], 0
    for before in text.split(_MARK)[:-1]:
        n_actions += before.rstrip().endswith(_ACT)
        done.append(n_actions)
    return done


def interleaved_parts(data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """The texts of traj.txt with the frames in their places."""
    texts = _sequence_text(data.folder(sample.question.traj_id)).strip().split(_MARK)
    parts = (part for pair in zip_longest(texts, frames) for part in pair)
    return [part for part in parts if part]


def last_state(data: NiehSet, question: Question, _settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """The last frame, beside the text of the last state (published: `text_state`)."""
    if not _states(data.folder(question.traj_id)):
        return [SkippedQuestion(question, "the trajectory has no state_summary")]
    return [Sample(question, (len(data.frames(question.traj_id)) - 1,))]


def state_parts(data: NiehSet, sample: Sample, frames: Sequence[FrameRef]) -> list[ContextPart]:
    """The text of the last state, then the last frame."""
    states = _states(data.folder(sample.question.traj_id))
    return [states[max(states, key=int)], *frames]


def _sequence_text(folder: Path) -> str:
    try:
        return (folder / "traj.txt").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{folder / 'traj.txt'}: cannot be read ({error}); replay the trajectory again") from error


def _frames_after_actions(data: NiehSet, traj_id: str) -> list[int]:
    """The last frame of each low-level action: published sets have several (expert_log.json)."""
    path = data.folder(traj_id) / "expert_log.json"
    position = {frame.path.stem: number for number, frame in enumerate(data.frames(traj_id))}
    last: dict[int, int] = {}
    try:
        for image in json.loads(path.read_text(encoding="utf-8"))["images"]:
            last[int(image["low_idx"])] = position[Path(image["image_name"]).stem]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{path}: not a log of actions and their frames ({error}); replay it again") from error
    return [last[action] for action in sorted(last)]


def _states(folder: Path) -> dict[str, str]:
    """Texts by low-level action: from `state_summary.json`, or the trajectory's own field (published form)."""
    own, trajectory = folder / "state_summary.json", folder / "traj_data.json"
    path = own if own.is_file() else trajectory
    if not path.is_file():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        states = found if path == own else found.get("state_summary") or {}
        return {str(int(step)): str(text) for step, text in states.items()}
    except (ValueError, AttributeError) as error:
        raise DataError(f"{path}: state_summary is not a mapping of steps to texts ({error})") from error
