"""The functions behind the NIEH task files in `tasks/nieh/`, called by lm-eval.

A doc refers to its frames by their places in the trajectory; the set is opened once per process. So docs stay small
for trajectories of thousands of frames, and pixels are decoded only for a model that wants them in the request.
"""

import json
from collections import Counter
from typing import Any

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Case, Part, context_named
from infthor_eval.nieh.notes import Notes, Notetaking
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.scoring import SCORERS, score
from infthor_eval.nieh.work import find_work, open_set

__all__ = [
    "dataset",
    "doc_parts",
    "doc_question",
    "doc_to_image",
    "doc_to_target",
    "doc_to_text",
    "process_results",
]

Doc = dict[str, Any]
_PLACEHOLDERS = {FrameRef: "<image>", Notes: "<notes>"}  # the first is lm-eval's own mark for an image in a text


def dataset(pixels: bool = True, **config: Any) -> dict[str, Any]:
    """The docs of a task, one per question and variant (`custom_dataset` of the task files).

    Args:
        pixels: put decoded images into requests, as lm-eval's own models want them. Our models decode by themselves.
        config: see `find_work`; what else lm-eval passes to every task is not looked at.

    Raises:
        UsageError: nothing can be asked, the model would have to take notes, or as in `find_work`.
        DataError: the set cannot be read.
    """
    from datasets import Dataset

    work = find_work(config)
    docs = [
        {
            "question_id": question.id,
            "traj_id": question.traj_id,
            "question": question.text,
            "question_type": question.question_type or "",
            "absence": question.absence,
            "clues": list(question.clues),
            "answers": json.dumps(question.answers),
            "context": config["context"],
            "variant": case.variant,
            "frames": list(case.frames),
            "notes": [case.notes.window, case.notes.max_new_tokens] if case.notes else [],
            "set": str(work.data.root),
            "pixels": pixels,
        }
        for question, case in work.cases
    ]
    if not docs:
        reasons = Counter(item.reason for item in work.left_out).most_common(3)
        said = "; ".join(f"{reason} ({n})" for reason, n in reasons) or "its files are empty"
        raise UsageError(f"{work.data.root}: no question of it can be asked: {said}")
    if pixels and docs[0]["notes"]:
        raise UsageError(
            f"{config['context']}: shows notes that the model takes beforehand, which infthor-eval's runner alone has "
            "it do; run the task with `infthor-eval run`"
        )
    return {"test": Dataset.from_list(docs)}


def doc_question(doc: Doc) -> Question:
    """The question of a doc."""
    return Question(
        traj_id=doc["traj_id"],
        text=doc["question"],
        clues=tuple(doc["clues"]),
        answers=tuple(json.loads(doc["answers"])),
        question_type=doc["question_type"] or None,
        absence=doc["absence"],
    )


def doc_parts(doc: Doc) -> list[Part]:
    """What a model is shown and told for a doc: the context's parts, and last the text with the question."""
    notes = Notetaking(*doc["notes"]) if doc["notes"] else None
    case = Case(tuple(doc["frames"]), doc["variant"], notes=notes)
    return context_named(doc["context"]).request(open_set(doc["set"]), doc_question(doc), case)


def doc_to_text(doc: Doc) -> str:
    """The request's text, with a placeholder where each frame, and the model's notes, go."""
    return "".join(part if isinstance(part, str) else _PLACEHOLDERS[type(part)] for part in doc_parts(doc))


def doc_to_image(doc: Doc) -> list[Image.Image]:
    """The decoded frames; none where the model takes references instead."""
    return [part.load() for part in doc_parts(doc) if isinstance(part, FrameRef)] if doc["pixels"] else []


def doc_to_target(doc: Doc) -> str:
    """The gold answers as one response would give them."""
    return ", ".join(map(str, doc_question(doc).answers))


def process_results(doc: Doc, results: list[str]) -> dict[str, float]:
    """Both scores of a response."""
    answers = doc_question(doc).answers
    return {scorer: score(last_line(results[0]), answers, scorer) for scorer in SCORERS}
