"""The functions behind the NIEH task files in `tasks/nieh/`, called by lm-eval.

They are the ones that our own run goes through, in lm-eval's forms.
"""

import json
from collections import Counter
from typing import Any

from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.nieh.docs import Doc, doc_of, doc_parts, doc_prompt, doc_target, sample_of
from infthor_eval.nieh.samples import find_samples
from infthor_eval.nieh.scoring import scores

__all__ = ["dataset", "doc_to_image", "doc_to_target", "doc_to_text", "process_results"]

# lm-eval 0.4.13 reads no entry points; where it imports a task's functions before it looks for the model (a task file
# given by its path), this lets it find ours.
register()


def dataset(**config: Any) -> dict[str, Any]:
    """The docs of a task, one per sample (`custom_dataset` of the task files).

    Requests hold decoded images, as lm-eval's own models want them; our models decode by themselves.

    Args:
        config: see `find_samples`; what else lm-eval passes to every task is not looked at.

    Raises:
        UsageError: nothing can be asked, the model would have to take notes, or as in `find_samples`.
        DataError: the set cannot be read.
    """
    from datasets import Dataset

    found, pixels = find_samples(config), not model_takes_references()
    if not found.samples:
        reasons = Counter(item.reason for item in found.skipped).most_common(3)
        said = "; ".join(f"{reason} ({n})" for reason, n in reasons) or "its files are empty"
        raise UsageError(f"{found.data.root}: no question of it can be asked: {said}")
    if pixels and found.samples[0].notes:
        raise UsageError(
            f"{config['context']}: shows notes that the model takes beforehand, which infthor-eval's models alone do; "
            "run the task with `infthor-eval run`, or with --model infthor"
        )
    return {"test": Dataset.from_list([doc_of(found, sample, pixels) for sample in found.samples])}


def doc_to_text(doc: Doc) -> str:
    """The request's text, with a placeholder where each frame, and the model's notes, go."""
    return doc_prompt(doc)


def doc_to_image(doc: Doc) -> list[Image.Image]:
    """The decoded frames; none where the model takes references instead."""
    return [part.load() for part in doc_parts(doc) if isinstance(part, FrameRef)] if doc["pixels"] else []


def doc_to_target(doc: Doc) -> str:
    """The gold answers as one response would give them."""
    return doc_target(sample_of(doc).question)


def process_results(doc: Doc, results: list[str]) -> dict[str, float]:
    """Both scores of a response."""
    return scores(results[0], json.loads(doc["answers"]))
