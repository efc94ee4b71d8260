"""The trajectory as a video: the published film of ten frames per second, sampled."""

import hashlib
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.video import FILM_FPS, Video, sample_positions
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextPart, ContextSettings, QuestionVariant


def video(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Ask on the trajectory's film, its mp4, at `fps` frames per second (published: 1 and 2).

    Where there is no mp4, the frames themselves are the film. The variant names the source, so that
    the two are not mixed up in a result. Models without a video input are given the same frames as
    images.
    """
    has_mp4 = data.video(question.traj_id) is not None
    variant = "source=mp4" if has_mp4 else "source=frames"
    try:
        if has_mp4:
            positions = _positions_in_film(data, question, settings.fps)
        else:
            positions = sample_positions(len(data.frames_until(question)), FILM_FPS, settings.fps)
    except DataError as error:
        return [SkippedQuestion(question, str(error), variant)]
    return [QuestionVariant(question, positions, variant, fps=settings.fps)]


def _positions_in_film(data: NiehSet, question: Question, fps: float) -> tuple[int, ...]:
    """Return which of the frames sampled from a trajectory's mp4 are up to a question's moment."""
    n_sampled = len(data.sampled_video(question.traj_id, fps).frames)
    if question.moment is None:
        return tuple(range(n_sampled))
    places = sample_positions(len(data.frames(question.traj_id)), FILM_FPS, fps)
    if len(places) != n_sampled:
        raise DataError(
            f"the film of {question.traj_id} shows {n_sampled} frames where its trajectory has "
            f"{len(places)}, so it is not known which are before the question's moment"
        )
    return tuple(range(bisect_left(places, len(data.frames_until(question)))))


def video_frames(data: NiehSet, traj_id: str, fps: float | None) -> Sequence[FrameRef]:
    """Return the frames that positions refer to: the mp4's samples, or all where there is none."""
    if fps is None:
        raise ValueError("a sample of video lacks the rate of its frames")
    return (
        data.frames(traj_id)
        if data.video(traj_id) is None
        else data.sampled_video(traj_id, fps).frames
    )


def video_positions(data: NiehSet, sample: QuestionVariant) -> Sequence[int]:
    """Return the frames of the trajectory that the shown ones are."""
    traj_id = sample.question.traj_id
    if sample.fps is None or data.video(traj_id) is None:
        return sample.frames
    places = sample_positions(len(data.frames(traj_id)), FILM_FPS, sample.fps)
    return places if sample.question.moment is None else places[: len(sample.frames)]


def video_parts(
    data: NiehSet, sample: QuestionVariant, frames: Sequence[FrameRef]
) -> list[ContextPart]:
    """Return the frames as a video, with the rate at which they were really sampled."""
    traj_id = sample.question.traj_id
    if sample.fps is not None and data.video(traj_id) is not None:
        return [Video(tuple(frames), data.sampled_video(traj_id, sample.fps).fps)]
    n_frames = len(data.frames_until(sample.question))
    return [Video(tuple(frames), len(frames) / n_frames * FILM_FPS)]


def as_images(parts: Iterable[ContextPart]) -> list[ContextPart]:
    """Return parts with each video's frames in its place, for a model without a video input."""
    return [
        shown_part
        for part in parts
        for shown_part in (part.frames if isinstance(part, Video) else (part,))
    ]


def video_identity(data: NiehSet, settings: ContextSettings) -> dict[str, Any]:
    """Return the hash of the videos and their decoder, which the set's own does not cover."""
    digest = hashlib.blake2b(digest_size=16)
    for traj_id in sorted({question.traj_id for question in data.questions}):
        if data.video(traj_id) is not None:
            digest.update(f"{traj_id}:{_name(data, traj_id, settings.fps)}\n".encode())
    return {"videos": digest.hexdigest()}


def _name(data: NiehSet, traj_id: str, fps: float) -> str:
    try:
        return data.sampled_video(traj_id, fps).frames[0].path.parent.name
    except DataError:
        return "broken"  # its questions are skipped, with the reason
