"""The requests of a stored run, made again from its header and its set.

A journal has the texts of a request and the places of its frames, but no pictures; and what a
stranger's journal says was sent is not to be believed. A request that was made again is returned
only if it has the hash in the record, so its frames are those that were sent.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.recalling import apply_recall
from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.contexts import (
    MEMORY,
    ContextPart,
    ContextSettings,
    QuestionVariant,
    context_named,
)
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.frame_ablations import FrameAblation
from infthor_eval.nieh.options import NiehSettings
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.questions.asking import request_fingerprint
from infthor_eval.runs import RunHeader, UnitRecord
from infthor_eval.settings import config_values, read

_RETRIEVED = "clip_retrieval"


class RebuiltRequest(NamedTuple):
    """A request as it was sent.

    Attributes:
        context: what the model saw, frames as references.
        text: the text after it, which ends with the question.
    """

    context: tuple[ContextPart, ...]
    text: str


class RequestRebuilder:
    """Makes the requests of one task of a stored run again."""

    def __init__(self, header: RunHeader[NiehConfig], task: str, data: NiehSet) -> None:
        """Take the run's header, the name of the task, and its set, unchanged since the run."""
        config = header.config.tasks[task]
        kept = config_values(NiehSettings()).keys() | {"seed"}
        of_run = {name: getattr(header.config, name) for name in kept}
        self._settings = read(ContextSettings, of_run | dict(config.dataset_kwargs), task)
        self._context = context_named(config.context)
        ablation = FrameAblation(self._settings.frames, self._settings.seed)
        self._samples = TaskSamples(
            data, config.context, self._context, (), (), {}, ablation, self._settings.words
        )
        self._decoding: Mapping[str, Any] = config.decoding
        self._shows_images = config.film == "images"

    def rebuild(self, record: UnitRecord[NiehAnswer]) -> RebuiltRequest:
        """Return the request of a record."""
        sample = self._find_sample(record)
        parts, text = self._samples.request(sample)
        context = tuple(as_images(parts) if self._shows_images else parts)
        decoding = {**self._decoding, "seed": self._decoding["seed"] + record.repeat - 1}
        if (
            request_fingerprint(context, text, record.payload.answers, decoding)
            != record.fingerprint
        ):
            raise DataError("made again, it is another request than the one that was sent")
        return RebuiltRequest(context, text)

    def _find_sample(self, record: UnitRecord[NiehAnswer]) -> QuestionVariant:
        question = self._samples.data.by_id.get(record.id)
        if question is None:
            raise DataError("its question is not in the set")
        if not record.fingerprint:
            raise DataError("it was not made: its inputs could not be read")
        sample = next(
            (it for it in self._variants(question, record) if it.variant == record.variant), None
        )
        if sample is None:
            raise DataError("the set has no such context of its question")
        return sample

    def _variants(
        self, question: Question, record: UnitRecord[NiehAnswer]
    ) -> Iterator[QuestionVariant]:
        data = self._samples.data
        name = self._samples.context_name
        if name == _RETRIEVED:  # by a model, which may not be there, and takes minutes
            raise DataError(
                "its frames were retrieved by a model, and the journal does not have them"
            )
        if name != MEMORY:
            samples = self._context.samples(data, question, self._settings)
            yield from (sample for sample in samples if isinstance(sample, QuestionVariant))
        elif record.payload.recall is not None:
            every = tuple(range(len(data.frames_until(question))))
            yield apply_recall(QuestionVariant(question, every), record.payload.recall)
