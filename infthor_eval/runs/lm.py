"""Our models as a guest of lm-eval: the `LM` that its evaluator drives."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from lm_eval.api.instance import Instance
from lm_eval.api.model import LM

from infthor_eval.errors import DataError, ModelError
from infthor_eval.nieh.task import doc_parts, doc_question
from infthor_eval.runs.answering import answerer_for
from infthor_eval.runs.journal import Journal, Observer, UnitRecord
from infthor_eval.runs.units import Unit, by_shared_context
from model_adapters import Bound, Model, Reply

__all__ = ["JournaledLM"]


class JournaledLM(LM):
    """Answers lm-eval's requests in the order that shares most, and records each before the next is begun.

    lm-eval sorts requests by the length of their text, which scatters the questions on one trajectory; here they
    are grouped again. Requests refer to their frames through the doc; images in them are not looked at.
    """

    MULTIMODAL = True  # lm-eval asks before it hands over a task with images

    def __init__(
        self,
        model: Model | Bound,
        journal: Journal,
        observe: Observer | None = None,
    ) -> None:
        """Drive a model.

        Args:
            model: what answers.
            journal: where each answer goes, and where those of an earlier, stopped run are found.
            observe: told of each record.
        """
        super().__init__()
        self._answerer = answerer_for(model, journal)
        self._name = model.name
        self._journal = journal
        self._observe = observe or (lambda *_: None)

    @property
    def tokenizer_name(self) -> str:
        """The model's name; lm-eval keys its caches by it."""
        return self._name

    def generate_until(self, requests: Sequence[Instance]) -> list[str]:
        """One response per request; empty where the model could not answer (the journal has the reason)."""
        units = [_unit(request) for request in requests]
        replies: dict[tuple[str, str, str], str | None] = {}
        for group in by_shared_context(units):
            for record in self._records(group):
                replies[record.key] = record.reply
        return [replies[unit.key] or "" for unit in units]

    def loglikelihood(self, requests: Sequence[Instance]) -> list[tuple[float, bool]]:
        """Not offered: no task of ours compares likelihoods."""
        raise ModelError("infthor-eval models answer in words; use a task with output_type generate_until")

    def loglikelihood_rolling(self, requests: Sequence[Instance]) -> list[float]:
        """Not offered, see `loglikelihood`."""
        raise ModelError("infthor-eval models answer in words; use a task with output_type generate_until")

    def _records(self, group: Sequence[Unit]) -> Iterator[UnitRecord]:
        """The records of units in one context, found in the journal or made, several at a time where that pays."""
        try:
            context = self._answerer.read(group[0].context)
        except (DataError, ModelError) as error:
            yield from [self._keep(_as_record(unit, "", failure=str(error))) for unit in group]
            return
        waiting = []
        for unit in [replace(unit, context=context) for unit in group]:
            record = self._known(unit)
            if record is None:
                waiting.append(unit)
            else:
                yield record
        size = self._answerer.batch_size
        for at in range(0, len(waiting), size):
            yield from self._made(waiting[at : at + size])

    def _known(self, unit: Unit) -> UnitRecord | None:
        """The record of a unit that needs no answering: an earlier run's, or that of a frame that cannot be read."""
        try:
            found = self._journal.answered(unit.key, unit.fingerprint)
        except DataError as error:
            return self._keep(_as_record(unit, "", failure=str(error)))
        if found is not None:
            self._observe(found, True)
        return found

    def _made(self, units: Sequence[Unit]) -> Iterator[UnitRecord]:
        began = time.perf_counter()
        try:
            replies = self._answerer.answer(units)
        except (DataError, ModelError) as error:
            if len(units) > 1:  # one of them may be to blame; the others are answered
                for unit in units:
                    yield from self._made([unit])
            else:
                yield self._keep(_as_record(units[0], units[0].fingerprint, failure=str(error)))
            return
        seconds = (time.perf_counter() - began) / len(units)
        for unit, reply in zip(units, replies, strict=True):
            yield self._keep(_as_record(unit, unit.fingerprint, reply=reply, seconds=seconds))

    def _keep(self, record: UnitRecord) -> UnitRecord:
        self._journal.append(record)
        self._observe(record, False)
        return record


def _unit(request: Instance) -> Unit:
    if request.task_name is None:
        raise ModelError("lm-eval sent a request without its task's name; use lm_eval 0.4.13")
    *context, text = doc_parts(request.doc)
    question, variant = doc_question(request.doc), request.doc["variant"]
    return Unit(request.task_name, question, variant, tuple(context), str(text), request.args[1])


def _as_record(
    unit: Unit, inputs: str, reply: Reply | None = None, failure: str | None = None, seconds: float = 0.0
) -> UnitRecord:
    return UnitRecord(
        task=unit.task,
        question_id=unit.question.id,
        variant=unit.variant,
        fingerprint=inputs,
        traj_id=unit.question.traj_id,
        question=unit.question.text,
        question_type=unit.question.question_type or "",
        n_clues=unit.question.n_clues,
        answers=unit.question.answers,
        reply=reply.text if reply else None,
        failure=failure,
        n_context_tokens=reply.n_context_tokens if reply else 0,
        n_cached_tokens=reply.n_cached_tokens if reply else 0,
        n_reply_tokens=len(reply.token_ids) if reply else 0,
        seconds=round(seconds, 4),
    )
