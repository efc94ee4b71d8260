"""The work of a run: which sums there are, and what a model answers."""

import random
import time
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.runs import (
    NOTHING,
    Group,
    RunHeader,
    Session,
    TaskFile,
    TaskRequest,
    Tokens,
    Unit,
    UnitDoc,
    UnitKey,
    UnitRecord,
    Usage,
    Workload,
)
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.limiting import limit_items
from infthor_eval.storage.digests import fingerprint
from infthor_sums.suite import Calculator, Sum, SumsConfig
from model_adapters import Decoding, Reply, Subject, wrap_request_errors

__all__ = ["SumsEvaluation"]


class SumsEvaluation:
    """See `infthor_eval.runs.Evaluation`: what is known before the model is loaded."""

    def __init__(self, request: TaskRequest) -> None:
        """Draw the sums of all tasks.

        Raises:
            UsageError: a task file lacks a setting.
        """
        self.question = request.options.question
        self.decodings: dict[str, Decoding] = {}
        self.units: list[Unit[Sum]] = []
        self.settings: dict[str, Mapping[str, object]] = {}
        for task in request.tasks:
            self.decodings[task.name] = decoding_of(
                task.settings.get("generation_kwargs", {}), request.seed, task.name
            )
            self.settings[task.name] = task.settings.get("dataset_kwargs", {})
            units = [_unit(task.name, payload) for payload in _draw_sums(task)]
            self.units += limit_items(units, lambda unit: unit.cluster, request.seed, request.limit)

    def bind(self, subject: Subject) -> "BoundSums":
        """See `Evaluation.bind`."""
        return BoundSums(self, subject)

    def to_doc(self, header: RunHeader[Any], record: UnitRecord[Sum]) -> UnitDoc:
        """See `Evaluation.to_doc`."""
        payload = record.payload
        keys = [unit.key for unit in self.units]
        return UnitDoc(
            number=keys.index(record.key),
            doc={"a": payload.a, "b": payload.b},
            target=str(payload.a + payload.b),
            prompt=self.prompt(payload),
            settings={},
            reply=payload.reply or "",
        )

    def prompt(self, payload: Sum) -> str:
        """Return the question of a sum."""
        return self.question.format(a=payload.a, b=payload.b)


def _draw_sums(task: TaskFile) -> list[Sum]:
    settings = settings_of(task)
    draw = random.Random(task.name)  # the same sums in every run
    pairs = [(a, b) for a in range(settings["below"]) for b in range(settings["below"])]
    return [Sum(a, b) for a, b in sorted(draw.sample(pairs, settings["n"]))]


def _unit(task: str, payload: Sum) -> Unit[Sum]:
    # Units with one cluster are right or wrong together; intervals take that into account.
    return Unit(UnitKey(task, f"{payload.a}+{payload.b}"), f"{payload.a}+", payload)


class BoundSums:
    """See `infthor_eval.runs.BoundEvaluation`."""

    def __init__(self, evaluation: SumsEvaluation, subject: Subject) -> None:
        """Put the units into groups."""
        self._evaluation, self._subject = evaluation, subject
        # A group is done in one place and shares what is expensive: here nothing, in NIEH a
        # trajectory's frames.
        groups = [
            Group(list(units))
            for _, units in groupby(evaluation.units, key=lambda unit: unit.cluster)
        ]
        # What the numbers depend on besides the model: another config is another run.
        config = SumsConfig(
            question=evaluation.question,
            tasks={name: dict(it) for name, it in evaluation.settings.items()},
        )
        self.workload = Workload(groups, config=config)

    def run(self, group: Group[Unit[Sum]], session: Session[Sum]) -> Iterator[UnitRecord[Sum]]:
        """See `BoundEvaluation.run`."""
        for unit in group.units:
            decoding = self._evaluation.decodings[unit.key.task]
            inputs = fingerprint(
                {"prompt": self._evaluation.prompt(unit.payload), "decoding": decoding.document()}
            )
            done = session.find_record(unit, inputs)  # by an earlier run that was stopped
            yield done if done is not None else self._ask(unit, decoding, inputs)

    def _ask(self, unit: Unit[Sum], decoding: Decoding, inputs: str) -> UnitRecord[Sum]:
        payload, start = unit.payload, time.monotonic()
        if isinstance(self._subject, Calculator):
            reply, usage = Reply(str(payload.a + payload.b)), NOTHING
        else:
            with wrap_request_errors(self._subject.name):
                conversation = self._subject.conversation()
                conversation.append(self._evaluation.prompt(payload))
                reply = conversation.reply(decoding)
            usage = Usage.of([reply])
        return unit.record(
            inputs,
            Sum(payload.a, payload.b, reply.text),
            seconds=round(time.monotonic() - start, 4),
            tokens=Tokens(reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens),
            usage=usage,
        )

    def close(self) -> None:
        """See `BoundEvaluation.close`: there is nothing to release."""


def settings_of(task: TaskFile) -> Mapping[str, int]:
    """Return the settings of a task file; raises UsageError if one is missing."""
    settings = task.settings.get("dataset_kwargs", {})
    if not isinstance(settings, Mapping) or not settings.keys() >= {"below", "n"}:
        raise UsageError(
            f"{task.path}: no below and n under dataset_kwargs; write {{below: 20, n: 24}}"
        )
    return settings
