"""The page on which a person decides about questions that no model answered."""

import base64
import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from urllib.parse import quote

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.validation import DECISIONS, JudgedQuestion
from infthor_eval.pages.one_file import read_part, write_page_file

_read = partial(read_part, __package__)
_IMAGES = "'self' file: data:"  # frames beside the page, from a disk or from a server


def write_inspection_page(path: Path, items: Sequence[JudgedQuestion], data: NiehSet) -> None:
    """Write an HTML file with the questions, their clue frames, gold answers and every reply.

    In a browser a person decides about them and saves the decisions as CSV. Frames are linked from
    the set, not copied.
    """
    values = {
        "items": [_describe(judged, data, path.parent) for judged in items],
        "choices": DECISIONS,
    }
    write_page_file(
        path,
        _read("inspection.html"),
        values,
        style=[_read("inspection.css")],
        script=[_read("inspection.js")],
        images=_IMAGES,
    )


def _describe(judged: JudgedQuestion, data: NiehSet, folder: Path) -> dict[str, object]:
    question = judged.question
    frames = zip(question.clues, data.clue_frames(question), strict=True)
    return {
        "id": question.id,
        "question": question.text,
        "answer": ", ".join(map(str, question.answers)),
        "replies": [
            (model, "(failed)" if reply is None else reply)
            for model, reply in judged.replies.items()
        ],
        "frames": [{"index": i, "url": _address(frame, folder)} for i, frame in frames],
    }


def _address(frame: FrameRef, folder: Path) -> str:
    """Return where a page in `folder` finds a frame; one of a packed set is in the page."""
    if not isinstance(frame.path, Path):
        return f"data:image/png;base64,{base64.b64encode(frame.png()).decode()}"
    return quote(os.path.relpath(frame.path, folder))
