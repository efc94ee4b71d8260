"""What is asked, as the page is given it: JSON values, and the frames by their place."""

from collections.abc import Iterator
from typing import Any

from infthor_eval.formats.frames import FrameRef
from model_adapters.human.desk import Desk, Question
from model_adapters.protocols import Turn


def state_of(desk: Desk) -> dict[str, Any]:
    """Return what the page shows now.

    `parts` has the texts and frames that a model would be given, in order: `{"text": ...}` or
    `{"frame": n}`, n being the frame's place among all frames.
    """
    version = desk.version
    question = desk.question
    return {
        "version": version,
        "closed": desk.is_closed,
        "stopped": desk.is_stopped,
        "answered": desk.n_answered,
        "question": None if question is None else _question(question),
    }


def frames_of(turns: tuple[Turn, ...]) -> list[FrameRef]:
    """Return all frames, in the order in which a model is given them."""
    return [part for turn in turns for part in turn.parts if isinstance(part, FrameRef)]


def _parts(turns: tuple[Turn, ...]) -> Iterator[dict[str, Any]]:
    n_frames = 0
    for turn in turns:
        for part in turn.parts:
            if isinstance(part, FrameRef):
                yield {"frame": n_frames}
                n_frames += 1
            else:
                yield {"text": str(part)}


def _question(question: Question) -> dict[str, Any]:
    inquiry = question.inquiry
    notice = inquiry.notice
    return {
        "number": question.number,
        "seconds": round(question.clock.seconds or 0.0, 1),
        "title": notice.title,
        "unit": notice.unit,
        "position": inquiry.position,
        "facts": [list(fact) for fact in notice.facts],
        "news": notice.news,
        "words": list(notice.words),
        "replies": list(inquiry.decoding.choices or notice.replies),
        "only": bool(inquiry.decoding.choices),
        "parts": list(_parts(inquiry.turns)),
    }
