"""NIEH set up for a run: the questions of its tasks, answered a trajectory at a time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import groupby

from infthor_eval.errors import DataError, InfthorError, ModelError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.asking.answering import Answerer, answer_units, answerer_of
from infthor_eval.nieh.asking.baselines import Baseline
from infthor_eval.nieh.asking.recalling import apply_recall, asks_model
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig
from infthor_eval.nieh.docs import doc_of, doc_target, prompt_of
from infthor_eval.nieh.options import NONE, NiehOptions
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.task import NiehTask, PreparedTask
from infthor_eval.nieh.units import NiehUnit
from infthor_eval.runs import (
    Cost,
    Group,
    RunHeader,
    Session,
    Skipped,
    TaskRequest,
    UnitDoc,
    UnitKey,
    UnitRecord,
    Workload,
)
from infthor_eval.settings import config_values, settings_of
from model_adapters import CacheCut, Model, Subject, check_decoding

# What the tasks of a run lack where an option has no effect, by `Setting.where`, and what has it.
_WITHOUT_EFFECT = {
    "size": ("context of {} has a size in tokens", "nieh_haystack or nieh_truncate_head"),
    "context": ("task of {} leaves its context open", "nieh_twins"),
    "memory": ("task of {} leaves its memory open", "nieh_memory"),
    "prompt": ("task of {} leaves its words open", "nieh_full"),
    "retriever": (
        "context of {} retrieves frames",
        "nieh_clip_retrieval or nieh_memory_frames, or --memory clip",
    ),
    "trajectories": (
        "context of {} tells of the trajectory beside its frames",
        "nieh_interleaved or nieh_text_state",
    ),
}


class NiehEvaluation:
    """NIEH set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[NiehOptions]) -> None:
        """Read the tasks and their sets."""
        self._options = request.options
        self._tasks = [NiehTask(file, request) for file in request.tasks]
        _refuse_empty([task.task_samples for task in self._tasks], self._tasks)
        self._refuse_unused()
        self._prepared: dict[int | None, PreparedEvaluation] = {}  # by tokens of a frame

    def bind(self, subject: Subject) -> "BoundNieh":
        """See `infthor_eval.runs.Evaluation.bind`."""
        answerer = answerer_of(subject)
        _refuse_without_frames(subject, self._tasks)
        _refuse_incapable(subject, self._options, self._tasks)
        tokens = self._tokens_per_frame(answerer)
        tasks = {task.name: task for task in self._tasks}
        prepared = self._prepare(tokens).tasks
        _refuse_empty([ready.task_samples for ready in prepared.values()], self._tasks)
        answerer.fit({name: ready.task_samples for name, ready in prepared.items()})
        costs = {name: answerer.cost(ready) for name, ready in prepared.items()}
        workload = Workload(
            groups=_groups(prepared, self._options.repeats),
            skipped=[
                Skipped(UnitKey(name, skipped.question.id, skipped.variant), skipped.reason)
                for name, ready in prepared.items()
                for skipped in ready.task_samples.skipped
            ],
            config=self._config(
                {
                    name: task.config(prepared[name], answerer.video_input)
                    for name, task in tasks.items()
                },
                tokens,
            ),
            costs=[Cost(name, cost) for name, cost in costs.items() if cost is not None],
            independent=not any(asks_model(ready.task_samples) for ready in prepared.values()),
        )
        return BoundNieh(workload, prepared, answerer)

    @property
    def reuses_encodings(self) -> bool:
        """See `infthor_eval.runs.Evaluation`: memories of the cache are cut from one encoding."""
        return any(task.cuts_cache for task in self._tasks)

    def to_doc(self, header: RunHeader[NiehConfig], record: UnitRecord[NiehAnswer]) -> UnitDoc:
        """See `infthor_eval.runs.Evaluation.to_doc`."""
        return self._prepare(header.config.tokens_per_frame).to_doc(header, record)

    def _prepare(self, tokens_per_frame: int | None) -> "PreparedEvaluation":
        """Return the tasks for models that need so many tokens for a frame."""
        if tokens_per_frame not in self._prepared:
            tasks = {task.name: task.prepare(tokens_per_frame) for task in self._tasks}
            self._prepared[tokens_per_frame] = PreparedEvaluation(tasks)
        return self._prepared[tokens_per_frame]

    def _tokens_per_frame(self, answerer: Answerer) -> int | None:
        """Return the size of a frame where a context is measured in it: the option's value, or the
        subject's own."""
        measured = next((task for task in self._tasks if task.needs_size), None)
        if measured is None or self._options.tokens_per_frame is not None:
            return self._options.tokens_per_frame
        return _measure_frame(measured.data, answerer)

    def _config(self, tasks: dict[str, NiehTaskConfig], tokens_per_frame: int | None) -> NiehConfig:
        measured = {"tokens_per_frame": tokens_per_frame}
        return NiehConfig(tasks=tasks, **{**config_values(self._options), **measured})

    def _refuse_unused(self) -> None:
        """Refuse options without effect: they would only change the run's config, or mislead."""
        names = ", ".join(task.name for task in self._tasks)
        for name, declared in settings_of(NiehOptions).items():
            value, where = getattr(self._options, name), declared.setting.where
            if (
                where
                and value != declared.default
                and not any(task.takes(where) for task in self._tasks)
            ):
                lack, other = _WITHOUT_EFFECT[where]
                raise UsageError(
                    f"--{name.replace('_', '-')} {value}: no {lack.format(names)}; leave it out, "
                    f"or ask {other}"
                )


class PreparedEvaluation:
    """Samples of known contexts set up for a run of a model; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, tasks: Mapping[str, PreparedTask]) -> None:
        """Take tasks by name."""
        self.tasks = tasks

    def bind(self, subject: Subject) -> "BoundNieh":
        """See `infthor_eval.runs.Evaluation.bind`."""
        return BoundNieh(Workload(_groups(self.tasks)), self.tasks, answerer_of(subject))

    def to_doc(self, header: RunHeader[NiehConfig], record: UnitRecord[NiehAnswer]) -> UnitDoc:
        """See `infthor_eval.runs.Evaluation.to_doc`."""
        prepared = self.tasks[record.task]
        number = self._numbers[record.key.once]
        sample = prepared.task_samples.samples[number]
        if record.payload.recall is not None:
            sample = apply_recall(sample, record.payload.recall)
        videos = header.config.tasks[record.task].film == "video"
        return UnitDoc(
            number=number,
            doc=doc_of(prepared.task_samples, sample),
            target=doc_target(sample.question),
            prompt=prompt_of(prepared.task_samples, sample, videos=videos),
            settings=prepared.generation_kwargs,
            reply=record.payload.reply or "",
        )

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Positions of the samples in their tasks."""
        return {
            UnitKey(name, sample.question.id, sample.variant): number
            for name, prepared in self.tasks.items()
            for number, sample in enumerate(prepared.task_samples.samples)
        }


class BoundNieh:
    """NIEH for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(
        self, workload: Workload[NiehUnit], prepared: Mapping[str, PreparedTask], answerer: Answerer
    ) -> None:
        """Take the work, the tasks by name, and what answers, fitted to their answer keys."""
        self.workload = workload
        self._prepared = prepared
        self._answerer = answerer

    def run(
        self, group: Group[NiehUnit], session: Session[NiehAnswer]
    ) -> Iterator[UnitRecord[NiehAnswer]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        prepared = self._prepared[group.units[0].key.task]
        yield from answer_units(group.units, prepared, self._answerer, session)

    def close(self) -> None:
        """Nothing is held."""


def _groups(prepared: Mapping[str, PreparedTask], repeats: int = 1) -> list[Group[NiehUnit]]:
    """Return a group per task and trajectory: its samples share what is encoded of that.

    Twins of one trajectory are one group: they have the frames before their first difference in
    common.
    """
    groups = []
    for task, ready in prepared.items():
        ordered = sorted(ready.task_samples.samples, key=lambda sample: sample.question.cluster)
        for _, samples in groupby(ordered, key=lambda sample: sample.question.cluster):
            same = sorted(samples, key=lambda sample: sample.question.place)
            frames = len({(it.question.traj_id, frame) for it in same for frame in it.frames})
            units = [
                NiehUnit.of(task, ready.task_samples, sample, repeat)
                for sample in same
                for repeat in range(1, repeats + 1)
            ]
            groups.append(Group(units, frames))
    return groups


def _measure_frame(data: NiehSet, answerer: Answerer) -> int:
    """Return the subject's size of a frame, by the first readable frame of the questions."""
    problems: list[InfthorError] = []
    for question in data.questions:
        for frame in data.clue_frames(question):
            try:
                return answerer.tokens_per_frame(frame)
            except (DataError, ModelError) as error:
                problems.append(error)
    reasons = (
        [str(problem) for problem in problems] or sorted(data.reasons()) or ["its files are empty"]
    )
    raise UsageError(
        f"no question of {data.root} can be asked ({reasons[0]}); fix the set, or give another"
    )


def _refuse_without_frames(subject: Subject, tasks: Sequence[NiehTask]) -> None:
    """Refuse to ask a model about question files alone, which only baselines can answer."""
    without = next((task.data.root for task in tasks if not task.data.has_frames), None)
    if without is not None and not isinstance(subject, Baseline):
        raise UsageError(
            f"{without}: has questions but no frames, which {subject.name} needs; give a set with "
            "metadata/"
        )


def _refuse_incapable(subject: Subject, options: NiehOptions, tasks: Iterable[NiehTask]) -> None:
    """Refuse a model every reply of which would fail; baselines say the same every time."""
    if not isinstance(subject, Model):
        return
    for name, is_given in (
        ("repeats", options.repeats > 1),
        ("temperature", options.temperature is not None),
    ):
        if is_given and not subject.capabilities.sampling:
            raise UsageError(
                f"--{name}: {subject.name} draws no replies; leave it out, or give another model"
            )
    for task in tasks:
        check_decoding(f"{task.name}: {subject.name}", subject.capabilities, task.decoding)
        if task.cuts_cache and options.frames == NONE:
            raise UsageError("--frames none: a memory in the cache needs frames; leave it out")
        cut = CacheCut(method="") if task.cuts_cache else None
        check_decoding(subject.name, subject.capabilities, replace(task.decoding, cache=cut))


def _refuse_empty(task_samples: Sequence[TaskSamples | None], tasks: Sequence[NiehTask]) -> None:
    """Refuse tasks without any question to ask; some may have none, where no window fits."""
    if any(samples is None or samples.samples for samples in task_samples):
        return
    reasons = {
        skipped.reason
        for samples in task_samples
        if samples is not None
        for skipped in samples.skipped
    }
    listed = "; ".join(sorted(reasons)[:3]) or "its files are empty"
    raise UsageError(
        f"no question of {tasks[0].data.root} can be asked ({listed}); fix the set, or give another"
    )
