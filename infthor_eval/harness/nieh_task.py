"""NIEH in lm-eval: functions of the task files in `tasks/nieh/`, and the adapter of its requests.

A request is a question. The functions are those of our own runs, in lm-eval's forms.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.harness.requests import Doc
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.docs import doc_of, doc_parts, doc_prompt, doc_target, sample_of, samples_of
from infthor_eval.nieh.evaluation import PreparedEvaluation
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.scoring import scores
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.runs.generation_kwargs import decoding_of

__all__ = [
    "NiehRequests",
    "dataset",
    "doc_to_image",
    "doc_to_target",
    "doc_to_text",
    "pair_accuracy",
    "process_pair",
    "process_results",
]

# lm-eval 0.4.13 reads no entry points; where it imports a task's functions before it looks for the
# model (a task file given by its path), this lets it find ours.
register()


def dataset(**config: Any) -> dict[str, Any]:
    """Build the docs of a task, one per sample (`custom_dataset` of the task files).

    Requests hold decoded images, as lm-eval's own models need them; ours decode the frames
    themselves.

    Args:
        config: see `find_samples`; whatever else lm-eval passes to every task is ignored.

    Raises:
        UsageError: nothing can be asked, a memory would have to ask the model, or as in
            `find_samples`.
        DataError: the set cannot be read.
    """
    from datasets import Dataset

    task_samples = find_samples(config)
    pixels = not model_takes_references()
    if not task_samples.samples:
        counts = Counter(question.reason for question in task_samples.skipped).most_common(3)
        reasons = "; ".join(f"{reason} ({n})" for reason, n in counts) or "its files are empty"
        raise UsageError(f"{task_samples.data.root}: no question of it can be asked: {reasons}")
    samples = recall_all(task_samples) if pixels else task_samples.samples
    return {"test": Dataset.from_list([doc_of(task_samples, sample, pixels) for sample in samples])}


def doc_to_text(doc: Doc) -> str:
    """Return the text of the request, with a placeholder for each frame."""
    return doc_prompt(doc)


def doc_to_image(doc: Doc) -> list[Image.Image]:
    """Return the decoded frames; none where the model takes references instead."""
    return (
        [part.load() for part in doc_parts(doc) if isinstance(part, FrameRef)]
        if doc["pixels"]
        else []
    )


def doc_to_target(doc: Doc) -> str:
    """Return the gold answers as one response would give them."""
    return doc_target(sample_of(doc).question)


def process_results(doc: Doc, results: list[str]) -> dict[str, float]:
    """Return both scores of a response."""
    return scores(results[0], json.loads(doc["answers"]))


def process_pair(doc: Doc, results: list[str]) -> dict[str, Any]:
    """Return both scores of a response, and what `pair_accuracy` needs of one world's."""
    by_scorer = process_results(doc, results)
    side = doc["pair"], doc["variant"], by_scorer["strict"] >= 1
    return {**by_scorer, "pair_accuracy": side}


def pair_accuracy(sides: Sequence[tuple[str, str, bool]]) -> float:
    """Return the share of pairs that are right in both worlds (aggregation of `nieh_twins`).

    Questions whose twin was not asked are in no pair; without any pair it is 0.
    """
    pairs: dict[tuple[str, str], list[bool]] = {}
    for pair, variant, is_right in sides:
        if pair:
            pairs.setdefault((pair, variant), []).append(is_right)
    whole = [rights for rights in pairs.values() if len(rights) == 2]
    return sum(map(all, whole)) / len(whole) if whole else 0.0


class NiehRequests:
    """Questions as requests of lm-eval; see `RequestAdapter`."""

    def prepare(
        self, task: str, docs: Sequence[Doc], generation_kwargs: Mapping[str, Any], seed: int
    ) -> PreparedEvaluation:
        """See `RequestAdapter`."""
        decoding = decoding_of(generation_kwargs, seed, task)
        return PreparedEvaluation(
            {task: PreparedTask(samples_of(docs), decoding, generation_kwargs)}
        )

    def doc_id(self, doc: Doc) -> tuple[str, str]:
        """Return question and variant."""
        return doc["question_id"], doc["variant"]

    def doc_id_of_unit(self, key: UnitKey, cluster: str) -> tuple[str, str]:
        """Return question and variant."""
        return key.id, key.variant

    def response(self, records: Sequence[UnitRecord[NiehAnswer]]) -> str:
        """Return the reply; empty where the model could not answer."""
        return records[0].payload.reply or ""
