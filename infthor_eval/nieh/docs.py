"""Samples as the docs that lm-eval's task functions pass around, and back.

A doc refers to its frames by their places in the trajectory; the set is opened once per process. So docs stay small for
trajectories of thousands of frames.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import ContextPart, Sample, context_named
from infthor_eval.nieh.notes import Notes, Notetaking
from infthor_eval.nieh.samples import TaskSamples, open_set
from infthor_eval.nieh.stand_ins import StandIns

__all__ = ["Doc", "doc_of", "doc_parts", "doc_prompt", "doc_target", "prompt_of", "sample_of", "samples_of"]

Doc = dict[str, Any]
_PLACEHOLDERS = {FrameRef: "<image>", Notes: "<notes>"}  # the first is lm-eval's own mark for an image in a text


def doc_of(found: TaskSamples, sample: Sample, pixels: bool = False) -> Doc:
    """The doc of a sample.

    Args:
        found: what the task asks.
        sample: one of it.
        pixels: whether requests hold decoded images, as lm-eval's own models want them.
    """
    question = sample.question
    return {
        "suite": "nieh",
        "question_id": question.id,
        "traj_id": question.traj_id,
        "question": question.text,
        "question_type": question.question_type or "",
        "absence": question.absence,
        "clues": list(question.clues),
        "answers": json.dumps(question.answers),
        "context": found.context_name,
        "variant": sample.variant,
        "frames": list(sample.frames),
        "notes": [sample.notes.window, sample.notes.max_new_tokens] if sample.notes else [],
        "set": str(found.data.root),
        "stand_ins": asdict(found.stand_ins),
        "trajectories": str(found.data.trajectories or ""),
        "pixels": pixels,
    }


def sample_of(doc: Doc) -> Sample:
    """The sample of a doc."""
    question = Question(
        traj_id=doc["traj_id"],
        text=doc["question"],
        clues=tuple(doc["clues"]),
        answers=tuple(json.loads(doc["answers"])),
        question_type=doc["question_type"] or None,
        absence=doc["absence"],
    )
    notes = Notetaking(*doc["notes"]) if doc["notes"] else None
    return Sample(question, tuple(doc["frames"]), doc["variant"], notes=notes)


def samples_of(docs: Sequence[Doc]) -> TaskSamples:
    """Return the samples of some docs of one task."""
    doc = docs[0]
    context = context_named(doc["context"])
    data = open_set(doc["set"], doc["trajectories"] or None)
    stand_ins = StandIns(**doc["stand_ins"])
    return TaskSamples(data, doc["context"], context, [sample_of(doc) for doc in docs], [], {}, stand_ins)


def doc_parts(doc: Doc) -> list[ContextPart]:
    """All that a model is shown and told for a doc, the text with the question last."""
    context, text = samples_of([doc]).request(sample_of(doc))
    return [*context, text]


def doc_prompt(doc: Doc) -> str:
    """The request's text, with a placeholder where each frame, and the model's notes, go."""
    return prompt_of(samples_of([doc]), sample_of(doc))


def prompt_of(found: TaskSamples, sample: Sample) -> str:
    """A sample's request as text; see `doc_prompt`."""
    context, text = found.request(sample)
    return "".join(part if isinstance(part, str) else _PLACEHOLDERS[type(part)] for part in (*context, text))


def doc_target(question: Question) -> str:
    """The gold answers as one reply would give them."""
    return ", ".join(map(str, question.answers))
