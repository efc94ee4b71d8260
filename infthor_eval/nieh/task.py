"""The functions behind the NIEH task files in `tasks/nieh/`, called by lm-eval.

A doc refers to its frames by trajectory and question; the set is opened once per process. So docs stay small for
trajectories of thousands of frames, and pixels are decoded only for a model that wants them in the request.
"""

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.hub_data import default_folder
from infthor_eval.formats.nieh_set import LeftOut, NiehSet
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import context_named
from infthor_eval.nieh.prompts import last_line, request_parts
from infthor_eval.nieh.scoring import SCORERS, score

__all__ = [
    "dataset",
    "doc_frames",
    "doc_question",
    "doc_to_image",
    "doc_to_target",
    "doc_to_text",
    "open_set",
    "process_results",
    "task_questions",
]

Doc = dict[str, Any]
_PLACEHOLDER = "<image>"  # lm-eval's own mark for an image in a text


@lru_cache(maxsize=8)
def open_set(root: str) -> NiehSet:
    """The set in a folder, read once per process; `open_set.cache_clear()` has it read again."""
    return NiehSet(Path(root))


def task_questions(
    context: str, data: str | None = None, bundled: str | None = None
) -> tuple[NiehSet, list[Question], list[LeftOut]]:
    """The set of a task, the questions that it asks, and those it cannot ask with the reasons.

    Args:
        context: the context's name (`infthor_eval.nieh.contexts`).
        data: folder of an NIEH set; None is the published set where `infthor-eval fetch nieh` put it.
        bundled: name of a set that comes with the package; `data` is not looked at then.

    Raises:
        UsageError: there is no set, or the context is unknown.
        DataError: the set cannot be read.
    """
    if bundled is None and data is None and not default_folder().is_dir():
        raise UsageError(
            "no NIEH set to ask about; give its folder with --data, or fetch the published one: fetch nieh"
        )
    root = packaged_folder(f"sets/{bundled}") if bundled else Path(data or default_folder())
    nieh_set = open_set(str(root))
    frames_of = context_named(context)
    questions, left_out = [], list(nieh_set.left_out)
    problems: dict[FrameRef, str | None] = {}
    for question in nieh_set.questions:
        frames = frames_of(nieh_set, question)
        problems.update((frame, frame.problem()) for frame in frames if frame not in problems)
        reason = next(filter(None, (problems[frame] for frame in frames)), None)
        if reason:
            left_out.append(LeftOut(question, reason))
        else:
            questions.append(question)
    return nieh_set, questions, left_out


def dataset(
    context: str,
    data: str | None = None,
    bundled: str | None = None,
    pixels: bool = True,
    **_: object,
) -> dict[str, Any]:
    """The docs of a task, one per question (`custom_dataset` of the task files).

    Args:
        context: see `task_questions`; so are `data` and `bundled`.
        pixels: put decoded images into requests, as lm-eval's own models want them. Our models decode by themselves.
        _: further metadata that lm-eval passes to every task.
    """
    from datasets import Dataset

    nieh_set, questions, _left_out = task_questions(context, data, bundled)
    docs = [
        {
            "question_id": question.id,
            "traj_id": question.traj_id,
            "question": question.text,
            "question_type": question.kind or "",
            "clues": list(question.clues),
            "answers": json.dumps(question.answers),
            "context": context,
            "set": str(nieh_set.root),
            "pixels": pixels,
        }
        for question in questions
    ]
    if not docs:
        reasons = "; ".join(f"{reason} ({n})" for reason, n in nieh_set.reasons().most_common(3))
        raise UsageError(f"{nieh_set.root}: no question that can be asked ({reasons or 'the files are empty'})")
    return {"test": Dataset.from_list(docs)}


def doc_question(doc: Doc) -> Question:
    """The question of a doc."""
    return Question(
        traj_id=doc["traj_id"],
        text=doc["question"],
        clues=tuple(doc["clues"]),
        answers=tuple(json.loads(doc["answers"])),
        kind=doc["question_type"] or None,
    )


def doc_frames(doc: Doc) -> tuple[FrameRef, ...]:
    """The frames of a doc's context, in order."""
    return context_named(doc["context"])(open_set(doc["set"]), doc_question(doc))


def doc_to_text(doc: Doc) -> str:
    """The request's text, with a placeholder where each frame goes."""
    parts = request_parts(doc_frames(doc), doc_question(doc))
    return "".join(_PLACEHOLDER if isinstance(part, FrameRef) else part for part in parts)


def doc_to_image(doc: Doc) -> list[Image.Image]:
    """The decoded frames; none where the model takes references instead."""
    return [frame.load() for frame in doc_frames(doc)] if doc["pixels"] else []


def doc_to_target(doc: Doc) -> str:
    """The gold answers as one response would give them."""
    return ", ".join(map(str, doc_question(doc).answers))


def process_results(doc: Doc, results: list[str]) -> dict[str, float]:
    """Both scores of a response."""
    answers = doc_question(doc).answers
    return {scorer: score(last_line(results[0]), answers, scorer) for scorer in SCORERS}
