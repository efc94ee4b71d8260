"""Conversion between samples and the docs of lm-eval's task functions.

A doc refers to its frames by their positions in the trajectory, and the set is opened once per
process. So docs stay small for trajectories of thousands of frames.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.question import PublishedColumns, Question
from infthor_eval.nieh.contexts import ContextPart, QuestionVariant, context_named
from infthor_eval.nieh.contexts.base import RecallSettings
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.frame_ablations import FrameAblation
from infthor_eval.nieh.samples import TaskSamples, open_set

Doc = dict[str, Any]
# The first is lm-eval's own mark of an image in a text.
_PLACEHOLDERS = {FrameRef: "<image>", Video: "<video>"}


def doc_of(task_samples: TaskSamples, sample: QuestionVariant, pixels: bool = False) -> Doc:
    """Return the doc of a sample; with `pixels` it has decoded images, for lm-eval's own models."""
    question = sample.question
    return {
        "suite": "nieh",
        "question_id": question.id,
        "traj_id": question.traj_id,
        "question": question.text,
        "question_type": question.question_type or "",
        "absence": question.absence,
        "moment": question.moment,
        "published": question.published
        and {"file": question.published.file, "qid": question.published.qid},
        "file": question.file,
        "pair": question.pair,
        "fact": question.fact,
        "base": question.base,
        "clues": list(question.clues),
        "answers": json.dumps(question.answers),
        "context": task_samples.context_name,
        "variant": sample.variant,
        "frames": list(sample.frames),
        "fps": sample.fps,
        "recall": json.dumps(asdict(sample.recall)) if sample.recall else "",
        "recalled": json.dumps(sample.recalled) if sample.recalled is not None else "",
        "set": str(task_samples.data.root),
        "frame_ablation": asdict(task_samples.frame_ablation),
        "prompt": task_samples.prompt,
        "trajectories": str(task_samples.data.trajectories or ""),
        "pixels": pixels,
    }


def sample_of(doc: Doc) -> QuestionVariant:
    """Return the sample of a doc."""
    question = Question(
        traj_id=doc["traj_id"],
        text=doc["question"],
        clues=tuple(doc["clues"]),
        answers=tuple(json.loads(doc["answers"])),
        question_type=doc["question_type"] or None,
        absence=doc["absence"],
        moment=doc["moment"],
        published=PublishedColumns(**doc["published"]) if doc["published"] else None,
        file=doc["file"],
        pair=doc["pair"],
        fact=doc["fact"],
        base=doc["base"],
    )
    return QuestionVariant(
        question,
        tuple(doc["frames"]),
        doc["variant"],
        recall=RecallSettings.of(json.loads(doc["recall"])) if doc["recall"] else None,
        recalled=tuple(json.loads(doc["recalled"])) if doc["recalled"] else None,
        fps=doc["fps"],
    )


def samples_of(docs: Sequence[Doc]) -> TaskSamples:
    """Return the samples of some docs of one task."""
    doc = docs[0]
    context = context_named(doc["context"])
    data = open_set(doc["set"], doc["trajectories"] or None)
    frame_ablation = FrameAblation(**doc["frame_ablation"])
    samples = [sample_of(doc) for doc in docs]
    return TaskSamples(
        data, doc["context"], context, samples, [], {}, frame_ablation, doc["prompt"]
    )


def doc_parts(doc: Doc) -> list[ContextPart]:
    """Return a doc's request for lm-eval's models: films as images, the question's text last."""
    context, text = samples_of([doc]).request(sample_of(doc))
    return [*as_images(context), text]


def doc_prompt(doc: Doc) -> str:
    """Return the text of a doc's request, with placeholders for frames."""
    return prompt_of(samples_of([doc]), sample_of(doc))


def prompt_of(task_samples: TaskSamples, sample: QuestionVariant, *, videos: bool = False) -> str:
    """Return the text of a sample's request, with placeholders for frames (and videos if any)."""
    context, text = task_samples.request(sample)
    parts = context if videos else as_images(context)
    return "".join(
        part if isinstance(part, str) else _PLACEHOLDERS[type(part)] for part in (*parts, text)
    )


def doc_target(question: Question) -> str:
    """Return the gold answers as one reply would give them."""
    return ", ".join(map(str, question.answers))
