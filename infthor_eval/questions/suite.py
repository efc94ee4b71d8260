"""The smallest suite: a dataset of questions, and a function that scores their replies."""

import inspect
import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cached_property, partial
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

import msgspec

from infthor_eval.errors import AdapterError, UsageError, in_one_line, wrap_user_code
from infthor_eval.facets import Facet
from infthor_eval.formats.frames import FrameRef
from infthor_eval.quantities import Count, Share, require_number
from infthor_eval.questions.asking import (
    BaselineReplier,
    ModelReplier,
    Replier,
    Request,
    answer_requests,
    wrap_metric_errors,
)
from infthor_eval.rates import Rate, clustered_rate, format_percent
from infthor_eval.runs import (
    Group,
    RecordTypes,
    RunConfig,
    RunHeader,
    RunSummary,
    Session,
    StoredRequest,
    TaskConfig,
    TaskFile,
    TaskRequest,
    Unit,
    UnitDoc,
    UnitKey,
    UnitRecord,
    Workload,
)
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.journals.records import Typed
from infthor_eval.runs.limiting import limit_items
from infthor_eval.runs.suite import BaselineSubject, Need
from infthor_eval.settings import NoOptions
from infthor_eval.storage.digests import fingerprint
from infthor_eval.tables import Column, Row, Table
from model_adapters import Decoding, Model, Reply, Subject, check_decoding

ALL = "all"  # of a task's questions, of all kinds


@dataclass(frozen=True)
class Question:
    """A question of a dataset.

    Attributes:
        id: what tells it from the others of its task.
        text: what is asked.
        answer: the gold answer.
        kind: its class, for tables and charts; empty for none.
        cluster: what it shares with questions that are right or wrong together, for intervals;
            empty for nothing.
        pictures: image files that are shown before the text, in their order.
    """

    id: str
    text: str
    answer: str
    kind: str = ""
    cluster: str = ""
    pictures: tuple[Path, ...] = ()

    @property
    def frames(self) -> tuple[FrameRef, ...]:
        """The pictures as models get them."""
        return tuple(map(FrameRef, self.pictures))


class QuestionAnswer(Typed, frozen=True, kw_only=True, tag="question_answer"):
    """The payload of a record: a question and the reply to it.

    Attributes:
        question: its text.
        answer: the gold answer.
        kind: its class; empty for none.
        n_pictures: number of pictures shown before it.
        reply: the reply; None if there is none.
        scores: score of the reply by the scorer's name; empty if there is none.
        thinking: what the model thought before the reply; None if it did not.
    """

    question: str
    answer: str
    kind: str = ""
    n_pictures: Count = 0
    reply: str | None = None
    scores: dict[str, Share] = msgspec.field(default_factory=dict)
    thinking: str | None = None


class QuestionTaskConfig(TaskConfig, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task.

    Attributes:
        decoding: how replies are decoded, as `Decoding.document` has it.
        data: digest of the questions; each picture is in the fingerprint of its record.
        kinds: classes of the questions, in their order.
    """

    decoding: dict[str, Any]
    data: str
    kinds: tuple[str, ...]


class QuestionConfig(RunConfig[QuestionTaskConfig], frozen=True, kw_only=True, omit_defaults=True):
    """The config of a run; `metric` is the scorer's name."""

    metric: str = ""


class QuestionSummary(msgspec.Struct, frozen=True):
    """Mean scores by task, then by kind and for `ALL`; `metric` is the scorer's name."""

    metric: str
    tasks: dict[str, dict[str, Rate]]


class QuestionSuite:
    """A suite of questions; see `infthor_eval.runs.Suite`.

    Another process gets its functions by their names, so they are written at the top of a module.
    """

    needs: ClassVar[Need] = "conversation"
    options: ClassVar[type] = NoOptions
    records: ClassVar[RecordTypes[QuestionAnswer]] = RecordTypes(
        QuestionAnswer, config=QuestionConfig
    )

    def __init__(
        self,
        name: str,
        dataset: Callable[..., Iterable[Question]],
        scorer: Callable[[str, Question], float],
        baselines: Mapping[str, Callable[[Question], str]] | None = None,
    ) -> None:
        """Take the parts of a suite.

        Args:
            name: its name, as task files write it.
            dataset: returns the questions of a task; `dataset_kwargs` of its file are its
                arguments, of the types that its parameters name.
            scorer: returns the score of a reply, from 0 to 1; its name is the metric's.
            baselines: functions that reply without a model, by name.

        Raises:
            UsageError: a function cannot be found by its name, as a lambda.
        """
        self.name = name
        self.metric = getattr(scorer, "__name__", "score")
        self.scorer = scorer
        self._dataset = dataset
        own = baselines or {}
        self.baselines = {each: partial(_Baseline, each, own[each]) for each in own}
        try:
            pickle.dumps(self)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise UsageError(
                f"the suite {name} cannot be sent to workers ({in_one_line(error)}); write its "
                "functions at the top of a module"
            ) from error

    def check_task(self, task: TaskFile) -> None:
        """See `Suite.check_task`."""
        self._arguments(task.settings.get("dataset_kwargs", {}), f"{task.path}: ")

    def prepare(self, request: TaskRequest[Any]) -> "QuestionEvaluation":
        """See `Suite.prepare`."""
        return QuestionEvaluation(self, request)

    def questions(self, dataset_kwargs: Any, where: str = "") -> list[Question]:
        """Return the questions of a task; `where` begins messages.

        Raises:
            UsageError: a setting does not fit, or there are no questions or wrong ones.
            UserCodeError: the dataset fails.
        """
        arguments = self._arguments(dataset_kwargs, where)
        with wrap_user_code(f"{where}the dataset of {self.name} fails", "fix it"):
            questions = list(self._dataset(**arguments))
            problem = _problem_of(questions)
        if problem is not None:
            raise UsageError(f"{where}the dataset of {self.name} {problem}")
        return questions

    def _arguments(self, dataset_kwargs: Any, where: str) -> dict[str, Any]:
        parameters = inspect.signature(self._dataset, eval_str=True).parameters
        settings = msgspec.defstruct(
            "Settings",
            [
                (
                    name,
                    Any if it.annotation is it.empty else it.annotation,
                    msgspec.NODEFAULT if it.default is it.empty else it.default,
                )
                for name, it in parameters.items()
            ],
            kw_only=True,
            forbid_unknown_fields=True,
        )
        try:
            return msgspec.structs.asdict(msgspec.convert(dataset_kwargs, settings))
        except msgspec.ValidationError as error:
            raise UsageError(
                f"{where}dataset_kwargs: {in_one_line(error)}; the settings are "
                f"{', '.join(parameters) or 'none'}"
            ) from error

    def summarise(
        self, header: RunHeader, records: Sequence[UnitRecord[QuestionAnswer]]
    ) -> QuestionSummary:
        """See `Suite.summarise`."""
        tasks = {}
        for task, config in header.config.tasks.items():
            counted = [it for it in records if it.task == task and it.excluded is None]
            everything = _rate(counted)
            by_kind = Facet("kind", "kind", _kind_of, config.kinds).means(counted, _rate)
            tasks[task] = ({} if everything is None else {ALL: everything}) | by_kind
        return QuestionSummary(header.config.metric, tasks)

    def scores(self, record: UnitRecord[QuestionAnswer]) -> Mapping[str, float]:
        """See `Suite.scores`."""
        return record.payload.scores

    def primary_metrics(self, summary: QuestionSummary) -> Mapping[str, Rate]:
        """See `Suite.primary_metrics`."""
        return {task: rates[ALL] for task, rates in summary.tasks.items() if ALL in rates}

    def overview(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.overview`."""
        return [_table(runs, [ALL])]

    def tables(self, runs: Sequence[RunSummary]) -> list[Table]:
        """See `Suite.tables`."""
        tasks = [rates for run in runs for rates in run.summary.tasks.values()]
        return [_table(runs, list(dict.fromkeys(kind for rates in tasks for kind in rates)))]


class _Baseline(BaselineSubject):
    """A baseline: a function of a question."""

    def __init__(self, name: str, predict: Callable[[Question], str], seed: int) -> None:
        super().__init__(seed)
        self.name = name
        self._predict = predict

    def reply(self, request: "_QuestionRequest") -> str:
        """Return the reply to a request; only this one fails with the function."""
        problem = f"{self.name} fails on {request.question.id}"
        with wrap_user_code(problem, "fix it", AdapterError):
            reply = self._predict(request.question)
            if not isinstance(reply, str):
                raise TypeError(f"it gives {reply!r:.60}, which is no text")
            return reply


@dataclass(frozen=True, kw_only=True)
class _QuestionRequest(Request[QuestionAnswer]):
    question: Question
    suite: QuestionSuite

    @cached_property
    def names(self) -> list[str]:
        return list(map(str, self.question.pictures))  # with folders: files have names alike

    @property
    def stored(self) -> StoredRequest:
        """See `Request`."""
        return StoredRequest.of(self.context, self.text, self.question.text, what="pictures")

    def replied(self, reply: Reply, answer: str, thinking: str | None) -> QuestionAnswer:
        return msgspec.structs.replace(self.unit.payload, reply=answer, thinking=thinking)

    def scored(self, payload: QuestionAnswer, answer: str) -> QuestionAnswer:
        metric = self.suite.metric
        with wrap_metric_errors(f"{metric} fails on {self.question.id}"):
            score = require_number(metric, self.suite.scorer(answer, self.question))
            if not 0 <= score <= 1:
                raise ValueError(f"it gives {score:g}; a score is from 0 to 1")
        return msgspec.structs.replace(payload, scores={metric: score})


@dataclass(frozen=True)
class _Task:
    """A task file with its questions: those of the run, and the config of all of them."""

    questions: Mapping[str, Question]
    decoding: Decoding
    generation_kwargs: Mapping[str, Any]
    config: QuestionTaskConfig

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Positions of the questions in the run, by id."""
        return {name: number for number, name in enumerate(self.questions)}

    @classmethod
    def of(cls, suite: QuestionSuite, file: TaskFile, request: TaskRequest[Any]) -> "_Task":
        where = f"{file.path}: "
        questions = suite.questions(file.settings.get("dataset_kwargs", {}), where)
        kwargs = file.settings.get("generation_kwargs", {})
        decoding = decoding_of(kwargs, request.seed, str(file.path))
        config = QuestionTaskConfig(
            settings=dict(file.settings),
            decoding=decoding.document(),
            data=digest_of_questions(questions),
            kinds=tuple(dict.fromkeys(question.kind for question in questions if question.kind)),
        )
        chosen = limit_items(questions, _cluster_of, request.seed, request.limit)
        return cls({question.id: question for question in chosen}, decoding, kwargs, config)


class QuestionEvaluation:
    """Questions set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, suite: QuestionSuite, request: TaskRequest[Any]) -> None:
        """Read the questions of all tasks."""
        self._suite = suite
        self._tasks = {file.name: _Task.of(suite, file, request) for file in request.tasks}

    def bind(self, subject: Subject) -> "BoundQuestions":
        """See `infthor_eval.runs.Evaluation.bind`."""
        if isinstance(subject, Model):
            for name, task in self._tasks.items():
                check_decoding(f"{name}: {subject.name}", subject.capabilities, task.decoding)
        return BoundQuestions(self._suite, self._tasks, subject)

    def to_doc(self, header: RunHeader[Any], record: UnitRecord[QuestionAnswer]) -> UnitDoc:
        """See `infthor_eval.runs.Evaluation.to_doc`."""
        task = self._tasks[record.task]
        question = task.questions[record.id]
        return UnitDoc(
            number=task.numbers[record.id],
            doc={"id": record.id, "question": question.text, "kind": question.kind},
            target=question.answer,
            prompt="<image>" * len(question.pictures) + question.text,
            settings=task.generation_kwargs,
            reply=record.payload.reply or "",
        )


class BoundQuestions:
    """Questions for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(self, suite: QuestionSuite, tasks: Mapping[str, _Task], subject: Subject) -> None:
        """Put the questions of each task into a group for each cluster."""
        self._suite = suite
        self._tasks = tasks
        self._subject = subject
        configs = {name: task.config for name, task in tasks.items()}
        groups = []
        for name, task in tasks.items():
            ordered = sorted(task.questions.values(), key=_cluster_of)
            for _, questions in groupby(ordered, key=_cluster_of):
                groups.append(_group(name, list(questions)))
        config = QuestionConfig(metric=suite.metric, tasks=configs)
        self.workload = Workload(groups, config=config, independent=True)

    def run(
        self, group: Group[Unit[QuestionAnswer]], session: Session[QuestionAnswer]
    ) -> Iterator[UnitRecord[QuestionAnswer]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        replier: Replier
        if isinstance(self._subject, _Baseline):
            replier = BaselineReplier(self._subject.reply)
        else:
            assert isinstance(self._subject, Model)  # a run refuses others before
            replier = ModelReplier(self._subject)
        requests = sorted(map(self._request, group.units), key=lambda request: request.names)
        yield from answer_requests(requests, replier, session)

    def _request(self, unit: Unit[QuestionAnswer]) -> _QuestionRequest:
        task = self._tasks[unit.key.task]
        question = task.questions[unit.key.id]
        return _QuestionRequest(
            unit=unit,
            context=question.frames,
            text=question.text,
            answers=(question.answer,),
            decoding=task.decoding,
            question=question,
            suite=self._suite,
        )

    def close(self) -> None:
        """Nothing is held."""


def digest_of_questions(questions: Iterable[Question]) -> str:
    """Return the digest of questions; of their pictures the names count, not the folders."""
    rows = []
    for it in questions:
        rows.append((*astuple(it)[:-1], [picture.name for picture in it.pictures]))
    return fingerprint({"questions": rows})


def _problem_of(questions: Sequence[Any]) -> str | None:
    """Return what is wrong with what a dataset gives, or None."""
    if not questions:
        return "has no questions; give at least one"
    problem = next(filter(None, map(_problem_with, questions)), None)
    if problem is not None:
        return problem
    digest_of_questions(questions)  # raises for texts that no journal can hold
    ((most, n),) = Counter(question.id for question in questions).most_common(1)
    return f"has {n} questions {most!r:.60}; give each an id of its own" if n > 1 else None


def _problem_with(question: Any) -> str | None:
    if not isinstance(question, Question):
        return f"gives {question!r:.60}; it gives Questions"
    for name in ("id", "text", "answer", "kind", "cluster"):
        value = getattr(question, name)
        if not isinstance(value, str) or (name == "id" and not value):
            return f"gives {value!r:.60} as {name} of {question.id!r:.60}; it is a text"
    if not all(isinstance(picture, Path) for picture in question.pictures):
        return f"gives {question.pictures!r:.60} as pictures of {question.id}; they are Paths"
    if question.kind == ALL:
        return f"calls the kind of {question.id} {ALL}, as all kinds together; rename it"
    return None


def _kind_of(record: UnitRecord[QuestionAnswer]) -> str | None:
    return record.payload.kind or None


def _cluster_of(question: Question) -> str:
    return question.cluster or question.id


def _group(task: str, questions: Sequence[Question]) -> Group[Unit[QuestionAnswer]]:
    units = [
        Unit(
            UnitKey(task, it.id),
            _cluster_of(it),
            QuestionAnswer(
                question=it.text, answer=it.answer, kind=it.kind, n_pictures=len(it.pictures)
            ),
        )
        for it in questions
    ]
    return Group(units, len({picture for it in questions for picture in it.pictures}) or 1)


def _rate(records: Sequence[UnitRecord[QuestionAnswer]]) -> Rate | None:
    """Return the mean score over the records that have one."""
    answered = [record for record in records if record.state == "answered"]
    scores = [score for record in answered for score in record.payload.scores.values()]
    rate = clustered_rate(scores, [record.cluster for record in answered])
    return None if rate is None else rate.out_of(len(records))


def _table(runs: Sequence[RunSummary], kinds: Sequence[str]) -> Table:
    rows = [
        Row(
            (
                run.header.label,
                task,
                *(format_percent(rates.get(kind)) for kind in kinds),
                str(rates[ALL].n),
            )
        )
        for run in runs
        for task, rates in run.summary.tasks.items()
        if ALL in rates
    ]
    columns = (Column("model", False), Column("task", False), *map(Column, (*kinds, "questions")))
    metrics = ", ".join(dict.fromkeys(run.summary.metric for run in runs))
    return Table(f"{metrics}, %, 95 % interval in brackets", columns, tuple(rows))
