"""NIEH in lm-eval: functions of the task files in `tasks/nieh/`, and the adapter of its requests.

A request is a question. The functions are those of our own runs, in lm-eval's forms.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any, NamedTuple

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Answer
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.harness.requests import Doc
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.docs import doc_of, doc_parts, doc_prompt, doc_target, sample_of, samples_of
from infthor_eval.nieh.evaluation import PreparedEvaluation
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.scoring import scores
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.pairs import PAIR_BOUNDS, PairShares
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.runs.generation_kwargs import decoding_of

# lm-eval 0.4.13 reads no entry points; where it imports a task's functions before it looks for the
# model (a task file given by its path), this lets it find ours.
register()


def dataset(**config: Any) -> dict[str, Any]:
    """Build the docs of a task, one per sample (`custom_dataset` of the task files).

    Requests hold decoded images, as lm-eval's own models need them; ours decode the frames
    themselves.

    Args:
        config: see `find_samples`; whatever else lm-eval passes to every task is ignored.
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


class _Side(NamedTuple):
    """One world's question of a pair, with the reply to it."""

    pair: str
    variant: str
    reply: str
    answers: list[Answer]

    def is_right(self, answers: Sequence[Answer]) -> bool:
        """Return True if the reply has full marks for these answers, of either world."""
        return scores(self.reply, answers)["strict"] >= 1


def process_pair(doc: Doc, results: list[str]) -> dict[str, Any]:
    """Return both scores of a response, and what the metrics of pairs need of one world's."""
    side = _Side(doc["pair"], doc["variant"], results[0], json.loads(doc["answers"]))
    return process_results(doc, results) | dict.fromkeys(PAIR_BOUNDS, side)


def net_pairs(sides: Sequence[_Side]) -> float:
    """Return pairs right less pairs exchanged (aggregation of `nieh_twins`).

    Questions whose twin was not asked are in no pair, and placebos count as none; without any pair
    it is 0.
    """
    return _mean(sides, "net_pairs")


def pair_accuracy(sides: Sequence[_Side]) -> float:
    """Return the share of pairs that are right in both worlds; see `net_pairs`."""
    return _mean(sides, "pair_accuracy")


def pairs_exchanged(sides: Sequence[_Side]) -> float:
    """Return the share of pairs with both replies right in the other world; see `net_pairs`."""
    return _mean(sides, "pairs_exchanged")


def _mean(sides: Sequence[_Side], metric: str) -> float:
    pairs: dict[tuple[str, str], list[_Side]] = {}
    for side in sides:
        if side.pair:
            pairs.setdefault((side.pair, side.variant), []).append(side)
    whole = [both for both in pairs.values() if len(both) == 2]
    # A pair with one answer, a placebo, tells nothing of memory.
    telling = [(one, two) for one, two in whole if one.answers != two.answers]
    scores = [_shares(*both).by_metric[metric] for both in telling]
    return fmean(scores) if scores else 0.0


def _shares(one: _Side, two: _Side) -> PairShares:
    return PairShares(
        right=float(one.is_right(one.answers) and two.is_right(two.answers)),
        exchanged=float(one.is_right(two.answers) and two.is_right(one.answers)),
    )


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
