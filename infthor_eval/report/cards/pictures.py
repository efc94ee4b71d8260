"""Pictures of a set for its card: the frames that answer a question, of both worlds for a pair."""

from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question

_SIDE = 180  # pixels
_GAP = 6
_MOST = 5  # frames in a row


def draw_example(data: NiehSet, path: Path) -> str | None:
    """Draw the clue frames of one question, or of a pair one above the other.

    Args:
        data: the set.
        path: file of the picture, PNG; its folder exists.

    Returns:
        A caption with question and answers; None if no question has frames to show.
    """
    shown = _example(data)
    if not shown:
        return None
    rows = [data.clue_frames(question)[:_MOST] for question in shown]
    _draw(rows).save(path, optimize=True)
    answers = " and ".join(" or ".join(map(str, question.answers)) for question in shown)
    worlds = ", in either world" if len(shown) > 1 else ""
    return f"{shown[0].text} {answers[0].upper()}{answers[1:]}{worlds}."


def _example(data: NiehSet) -> Sequence[Question]:
    """Return a question with several clues but few, with its twin if there is one."""
    if not data.has_frames:
        return ()
    able = [question for question in data.questions if 2 <= len(question.clues) <= _MOST]
    able = able or [question for question in data.questions if question.clues]
    if not able:
        return ()
    first = able[0]
    if not first.pair:
        return (first,)
    return [question for question in data.questions if question.pair == first.pair]


def _draw(rows: Sequence[Sequence[FrameRef]]) -> Image.Image:
    width = max(map(len, rows)) * (_SIDE + _GAP) - _GAP
    sheet = Image.new("RGB", (width, len(rows) * (_SIDE + _GAP) - _GAP), "white")
    for down, frames in enumerate(rows):
        for across, frame in enumerate(frames):
            picture = frame.load().resize((_SIDE, _SIDE), Image.Resampling.LANCZOS)
            sheet.paste(picture, (across * (_SIDE + _GAP), down * (_SIDE + _GAP)))
    return sheet.quantize(128)
