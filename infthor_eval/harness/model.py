"""Our models under lm-eval's command: `lm-eval run --model infthor --model_args adapter=...`."""

from collections.abc import Hashable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from lm_eval.api.instance import Instance
from lm_eval.api.model import LM

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.grouping import grouped
from infthor_eval.harness.registration import NAME, say_model_takes_references
from infthor_eval.harness.requests import Payload, RequestAdapter, SuiteUnit
from infthor_eval.runs import RunHeader, Suite, UnitRecord
from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.work.binding import group_records, require_capability
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.suites import baseline_suites, find_request_adapter, find_suite
from model_adapters import adapter_identity, has_option, identity_of, label, load, refuse_batches

_DEFAULT_DEVICE = "cuda:0"  # lm-eval's default


class InfthorLM(LM):
    """Any model of ours, by name, under lm-eval's command.

    Each request is recorded before the next one starts. lm-eval sorts requests by the length of
    their text, which scatters the questions on one trajectory; here they are grouped again, so that
    they share most. Requests refer to their frames through the doc; images in them are ignored.
    """

    MULTIMODAL = True  # lm-eval asks before it hands over a task with images

    def __init__(
        self,
        adapter: str,
        journal: str | None = None,
        seed: int = 0,
        batch_size: int | str | None = None,
        max_batch_size: int | None = None,
        device: str | None = None,
        **options: object,
    ) -> None:
        """Load a model.

        Args:
            adapter: name of the model (`infthor-eval ls models`).
            journal: folder of a run, resumed if it exists; None to keep the journal for this
                process only.
            seed: seed of everything random in the model.
            batch_size: lm-eval's; passed on to models that take one.
            max_batch_size: lm-eval's; ignored.
            device: lm-eval's; passed on to models that take one, unless it is lm-eval's default.
            options: the model's options.
        """
        super().__init__()
        if adapter in baseline_suites():
            raise UsageError(
                f"{adapter} is a baseline, not a model; run it with infthor-eval --model {adapter}"
            )
        option_texts = {key: str(value) for key, value in options.items()}
        # "auto" means nothing to our models, and 1 is what lm-eval gives by default.
        batch = str(batch_size)
        theirs = {
            "device": None if device == _DEFAULT_DEVICE else device,
            "batch_size": batch if batch.isdigit() and int(batch) > 1 else None,
        }
        option_texts |= {
            key: value
            for key, value in theirs.items()
            if value is not None and has_option(adapter, key)
        }
        say_model_takes_references()
        self._model = load(adapter, option_texts, seed)
        refuse_batches(self._model)
        self._seed = seed
        self._name, self._code = label(adapter, option_texts), adapter_identity(adapter)
        self._scratch = ScratchFolder()
        self._folder = Path(journal) if journal else self._scratch.path
        self._journals: dict[str, Journal[Any]] = {}

    @property
    def tokenizer_name(self) -> str:
        """The model's name; lm-eval keys its caches by it."""
        return self._model.name

    def get_model_info(self) -> dict[str, str]:
        """Return what lm-eval writes about the model beside its results."""
        return {"model_source": NAME, "model_name": self._model.name}

    def generate_until(self, requests: Sequence[Instance]) -> list[str]:
        """Return a response per request; empty without an answer (the journal has the reason)."""
        numbers_of = grouped(
            (_suite_and_task(request), number) for number, request in enumerate(requests)
        )
        responses: dict[int, str] = {}
        for (suite, task), numbers in numbers_of.items():
            of_task = self._respond(
                find_suite(suite), task, [requests[number] for number in numbers]
            )
            responses |= zip(numbers, of_task, strict=True)
        return [responses[number] for number in range(len(requests))]

    def loglikelihood(self, requests: Sequence[Instance]) -> list[Any]:
        """Refuse: no task of ours compares likelihoods."""
        raise ModelError(
            "infthor-eval models answer in words; use a task with output_type generate_until"
        )

    loglikelihood_rolling = loglikelihood

    def _respond(
        self, suite: Suite[SuiteUnit, Payload], task: str, requests: Sequence[Instance]
    ) -> list[str]:
        """Return the responses to the requests of one task."""
        require_capability(self._model, self._name, suite)
        adapter: RequestAdapter[SuiteUnit, Payload] = find_request_adapter(suite.name)
        journal = self._journal(suite)
        encoder = RecordEncoder(suite.records)
        docs = [request.doc for request in requests]
        records: dict[Hashable, list[UnitRecord[Payload]]] = {
            adapter.doc_id(doc): [] for doc in docs
        }
        evaluation = adapter.prepare(task, docs, requests[0].args[1], self._seed)
        with closing(evaluation.bind(self._model)) as bound:
            for group in bound.workload.groups:
                units = [
                    unit
                    for unit in group.units
                    if adapter.doc_id_of_unit(unit.key, unit.cluster) in records
                ]
                part = replace(group, units=units)
                for record in group_records(bound, part, journal, encoder) if units else ():
                    doc_id = adapter.doc_id_of_unit(record.key, record.cluster)
                    records[doc_id].append(journal.append_new(record)[0])
        return [adapter.response(records[adapter.doc_id(doc)]) for doc in docs]

    def _journal(self, suite: Suite[SuiteUnit, Payload]) -> Journal[Payload]:
        """Return the journal of a suite, which is in a folder of the suite's name."""
        if suite.name not in self._journals:
            model = {"name": self._model.name, **identity_of(self._model)}
            config = suite.records.config(host="lm-eval")
            whole = config.complete(suite.name, model, adapter=self._code, seed=self._seed)
            header = RunHeader(suite=suite.name, name=self._name, config=whole)
            self._journals[suite.name] = Journal(self._folder / suite.name, header, suite.records)
        return self._journals[suite.name]


def _suite_and_task(request: Instance) -> tuple[str, str]:
    suite = request.doc.get("suite") if isinstance(request.doc, dict) else None
    if request.task_name is None or not isinstance(suite, str):
        raise ModelError(
            f"{request.task_name}: infthor-eval's models answer its own tasks (tasks/nieh) under "
            "lm-eval"
        )
    return suite, request.task_name
