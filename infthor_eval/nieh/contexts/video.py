"""The trajectory as a video."""

import hashlib
from collections.abc import Sequence
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts.base import ContextSettings, Sample

__all__ = ["video", "video_frames", "video_identity", "video_positions"]

_PER_SECOND = 10  # frames of the trajectory a second of its video


def video(data: NiehSet, question: Question, _settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """Ask on the trajectory's mp4 at one frame per second, or on every frame if it has none (published: `video`).

    Models are given the frames as images, also those with an input for videos, so that all of them answer from the same
    frames. The variant names the source, so that the two are not mixed up in a result.
    """
    try:
        frames = video_frames(data, question.traj_id)
    except DataError as error:
        return [SkippedQuestion(question, str(error), "source=mp4")]
    is_video = data.video(question.traj_id) is not None
    return [Sample(question, tuple(range(len(frames))), "source=mp4" if is_video else "source=frames")]


def video_frames(data: NiehSet, traj_id: str) -> Sequence[FrameRef]:
    """Return the shown frames.

    Raises:
        DataError: the trajectory has a video that cannot be decoded.
    """
    path = data.video(traj_id)
    return data.frames(traj_id) if path is None else data.video_frames(traj_id)


def video_positions(data: NiehSet, sample: Sample) -> Sequence[int]:
    """Return the frames of the trajectory that the shown ones are, by the video's 10 frames per second."""
    is_video = data.video(sample.question.traj_id) is not None
    return [_PER_SECOND * second for second in sample.frames] if is_video else sample.frames


def video_identity(data: NiehSet, _settings: ContextSettings) -> dict[str, Any]:
    """Return the hash of the videos and their decoder; the set's own fingerprint does not cover videos."""
    digest = hashlib.blake2b(digest_size=16)
    for traj_id in sorted({question.traj_id for question in data.questions}):
        if data.video(traj_id) is not None:
            digest.update(f"{traj_id}:{_name(data, traj_id)}\n".encode())
    return {"videos": digest.hexdigest()}


def _name(data: NiehSet, traj_id: str) -> str:
    try:
        return data.video_frames(traj_id)[0].path.parent.name
    except DataError:
        return "broken"  # its questions are skipped, with the reason
