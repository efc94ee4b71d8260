"""NIEH as a suite: questions about needles in an embodied haystack."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from itertools import groupby
from typing import Any, ClassVar

from infthor_eval.errors import UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.answering import NiehUnit, TaskPlan, answered
from infthor_eval.nieh.baselines import BASELINES
from infthor_eval.nieh.contexts import context_named
from infthor_eval.nieh.docs import doc_of, doc_prompt, doc_target
from infthor_eval.nieh.metrics import Metrics, metrics_of
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.records import RECORDS, NiehAnswer
from infthor_eval.nieh.respondents import respondent
from infthor_eval.nieh.samples import TaskSamples, find_samples, find_set, open_set
from infthor_eval.nieh.summary import NiehSummary, summarise
from infthor_eval.nieh.tables import tables
from infthor_eval.runs import (
    Cost,
    Group,
    RecordTypes,
    RunHeader,
    RunSummary,
    SampleView,
    Session,
    Skipped,
    Subject,
    TaskFile,
    TaskRequest,
    UnitKey,
    UnitRecord,
    Workload,
)
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.suite import Need
from infthor_eval.tables import Table
from model_adapters import Decoding

__all__ = ["NiehEvaluation", "NiehSuite"]

_NEEDED = ("custom_dataset", "dataset_kwargs", "doc_to_text", "generation_kwargs", "process_results", "test_split")


class NiehSuite:
    """The suite."""

    name: ClassVar[str] = "nieh"
    needs: ClassVar[Need] = "conversation"
    options: ClassVar[type] = NiehOptions
    baselines = BASELINES
    records: ClassVar[RecordTypes] = RECORDS

    def prepare(self, request: TaskRequest) -> "NiehEvaluation":
        """See `Suite.prepare`."""
        return NiehEvaluation(request)

    def summarise(self, header: RunHeader, records: Sequence[UnitRecord[NiehAnswer]]) -> NiehSummary:
        """See `Suite.summarise`."""
        return summarise(header.identity, records)

    def scores(self, record: UnitRecord[NiehAnswer]) -> Mapping[str, float]:
        """See `Suite.scores`."""
        return record.payload.scores

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        return tables(runs)


class _Task:
    """A task file, read: what is known of a task before the model is there."""

    def __init__(self, file: TaskFile, request: TaskRequest) -> None:
        """Check the file and find what it asks, unless that depends on the model.

        Raises:
            UsageError: a setting that does not fit, or there is no set.
            DataError: the file or the set is not what it should be.
        """
        file.require(*_NEEDED)
        self.file = file
        self._limit = request.limit
        self._config: dict[str, Any] = _told(request) | file.settings["dataset_kwargs"]
        self.decoding: Decoding = decoding_of(file.settings["generation_kwargs"], request.seed, file.name)
        self.metrics: Metrics = metrics_of(file)
        self.data: NiehSet = find_set(**self._config)
        self.needs_size = context_named(self._config["context"]).needs_model
        self.found: TaskSamples | None = None if self.needs_size else find_samples(self._config, self._limit)

    def plan(self, tokens_per_frame: int | None) -> TaskPlan:
        """How its samples become records, now that the size of a frame is known where it matters."""
        if self.found is None:
            self.found = find_samples(self._config | {"tokens_per_frame": tokens_per_frame}, self._limit)
        return TaskPlan(self.found, self.decoding, self.metrics)

    def identity(self, plan: TaskPlan) -> dict[str, Any]:
        """What its numbers depend on, as JSON values."""
        found, names = plan.found, plan.metrics.names
        skipped = [{"question_id": i.question.id, "variant": i.variant, "reason": i.reason} for i in found.skipped]
        return {
            "config": dict(self.file.settings),
            "decoding": plan.decoding.document(),
            "metrics": {"names": list(names), **plan.metrics.identity},
            "data": found.data.fingerprint,
            "simulator": found.data.simulator,
            "sources": dict(found.sources),
            "n_samples": len(found.samples),
            "skipped": skipped,
        }


def _told(request: TaskRequest) -> dict[str, Any]:
    """What a run tells its tasks beside their files' own settings."""
    ours = {"data": str(request.data) if request.data else None, **asdict(request.options)}
    return {"seed": request.seed} | {key: value for key, value in ours.items() if value is not None}


class NiehEvaluation:
    """NIEH set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest) -> None:
        """Read the tasks and their sets.

        Raises:
            UsageError: a task without its data or with nothing that can be asked, a retriever that cannot be loaded,
                or an option that none of the tasks looks at.
            DataError: a task file or a set is not what it should be.
        """
        open_set.cache_clear()  # its files may have changed since an earlier run of this process
        self._options: NiehOptions = request.options
        self._tasks = [_Task(file, request) for file in request.tasks]
        self._plans: dict[str, TaskPlan] = {}
        _refuse_nothing([task.found for task in self._tasks], self._tasks)
        self._refuse_unused()

    def workload(self, subject: Subject) -> Workload:
        """See `infthor_eval.runs.Evaluation.workload`."""
        self._respondent = respondent(subject)
        tokens = self._tokens_per_frame()
        self._plans = {task.file.name: task.plan(tokens) for task in self._tasks}
        _refuse_nothing([plan.found for plan in self._plans.values()], self._tasks)
        self._respondent.read_tasks(self._plans)
        tasks = {task.file.name: task.identity(self._plans[task.file.name]) for task in self._tasks}
        costs = {name: self._respondent.cost(plan) for name, plan in self._plans.items()}
        return Workload(
            groups=[group for name, plan in self._plans.items() for group in _groups(name, plan)],
            skipped=[skipped for name, plan in self._plans.items() for skipped in _skipped(name, plan.found)],
            identity={"tasks": tasks, "k_tokens": self._options.k_tokens, "tokens_per_frame": tokens},
            costs=[Cost(name, cost) for name, cost in costs.items() if cost is not None],
        )

    def run(self, group: Group, session: Session) -> Iterator[UnitRecord[NiehAnswer]]:
        """See `infthor_eval.runs.Evaluation.run`."""
        units = [unit for unit in group.units if isinstance(unit, NiehUnit)]
        task = units[0].key.task
        yield from answered(units, self._plans[task], self._respondent.answerer(task, session), session)

    def view(self, record: UnitRecord[NiehAnswer]) -> SampleView:
        """See `infthor_eval.runs.Evaluation.view`."""
        plan = self._plans[record.task]
        number = self._numbers[record.key]
        sample = plan.found.samples[number]
        doc = doc_of(plan.found, sample)
        settings = next(task.file.settings for task in self._tasks if task.file.name == record.task)
        return SampleView(
            number=number,
            doc=doc,
            target=doc_target(sample.question),
            prompt=doc_prompt(doc),
            settings=settings["generation_kwargs"],
            reply=record.payload.reply or "",
        )

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Places of the samples in their tasks."""
        return {
            UnitKey(name, sample.question.id, sample.variant): number
            for name, plan in self._plans.items()
            for number, sample in enumerate(plan.found.samples)
        }

    def _tokens_per_frame(self) -> int | None:
        """The size of a frame where a context is measured in it: as told, or the subject's own."""
        measured = next((task for task in self._tasks if task.needs_size), None)
        if measured is None or self._options.tokens_per_frame is not None:
            return self._options.tokens_per_frame
        data = measured.data
        return self._respondent.tokens_per_frame(data.frames(data.questions[0].traj_id)[0])

    def _refuse_unused(self) -> None:
        """A kilo-token that no context is measured in would only give the run another identity; others mislead."""
        asked = ", ".join(task.file.name for task in self._tasks)
        measured = any(task.needs_size for task in self._tasks)
        for name in ("k_tokens", "tokens_per_frame"):
            if getattr(self._options, name) is not None and not measured:
                raise UsageError(
                    f"--{name.replace('_', '-')} {getattr(self._options, name)}: no context of {asked} has a size in "
                    "tokens; leave it out, or ask nieh_haystack or nieh_truncate_head"
                )
        retrieves = any(task.found is not None and "retriever" in task.found.sources for task in self._tasks)
        if (self._options.retriever or self._options.retriever_revision) and not retrieves:
            raise UsageError(
                f"--retriever: no context of {asked} retrieves frames; "
                "leave it out, or ask nieh_clip_retrieval or nieh_memory_frames"
            )


def _refuse_nothing(found: Sequence[TaskSamples | None], tasks: Sequence[_Task]) -> None:
    """A task of several may have nothing to ask (no window so large fits); all of them may not."""
    if any(samples is None or samples.samples for samples in found):
        return
    reasons = {item.reason for samples in found if samples is not None for item in samples.skipped}
    said = "; ".join(sorted(reasons)[:3]) or "its files are empty"
    raise UsageError(f"no question of {tasks[0].data.root} can be asked ({said})")


def _groups(task: str, plan: TaskPlan) -> Iterator[Group]:
    """The samples of one trajectory are a group: they share what is encoded of it."""
    ordered = sorted(plan.found.samples, key=lambda sample: sample.question.traj_id)
    for _, samples in groupby(ordered, key=lambda sample: sample.question.traj_id):
        yield Group([NiehUnit.of(task, sample) for sample in samples])


def _skipped(task: str, found: TaskSamples) -> Iterator[Skipped]:
    for item in found.skipped:
        yield Skipped(UnitKey(task, item.question.id, item.variant), item.reason)
