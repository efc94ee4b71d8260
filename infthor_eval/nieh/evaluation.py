"""NIEH set up for a run: the questions of its tasks, answered a trajectory at a time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import groupby
from typing import Any

from infthor_eval.errors import DataError, InfthorError, ModelError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.asking.answerers import Answerer, answerer_of
from infthor_eval.nieh.asking.answering import answer_units
from infthor_eval.nieh.asking.baselines import Baseline
from infthor_eval.nieh.asking.recalling import apply_recall, asks_model
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig
from infthor_eval.nieh.docs import doc_of, doc_target, prompt_of
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.prompts import PUBLISHED_MAIN
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.task import NiehTask, PreparedTask
from infthor_eval.nieh.units import NiehUnit
from infthor_eval.runs import (
    Cost,
    Group,
    Session,
    Skipped,
    TaskRequest,
    UnitKey,
    UnitRecord,
    UnitSample,
    Workload,
)
from model_adapters import Model, Subject, check_decoding


class NiehEvaluation:
    """NIEH set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[NiehOptions]) -> None:
        """Read the tasks and their sets.

        Raises:
            UsageError: a task without its data or with nothing that can be asked, a retriever that
                cannot be loaded, or an option that has no effect on any of the tasks.
            DataError: a task file or a set is not valid.
        """
        self._options = request.options
        self._tasks = [NiehTask(file, request) for file in request.tasks]
        _refuse_empty([task.task_samples for task in self._tasks], self._tasks)
        self._refuse_unused()

    def bind(self, subject: Subject) -> "BoundNieh":
        """See `infthor_eval.runs.Evaluation.bind`."""
        answerer = answerer_of(subject)
        _refuse_without_frames(subject, self._tasks)
        _refuse_incapable(subject, self._options, self._tasks)
        tokens = self._tokens_per_frame(answerer)
        tasks = {task.name: task for task in self._tasks}
        prepared = {name: task.prepare(tokens) for name, task in tasks.items()}
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

    def _tokens_per_frame(self, answerer: Answerer) -> int | None:
        """Return the size of a frame where a context is measured in it: the option's value, or the
        subject's own."""
        measured = next((task for task in self._tasks if task.needs_size), None)
        if measured is None or self._options.tokens_per_frame is not None:
            return self._options.tokens_per_frame
        return _measure_frame(measured.data, answerer)

    def _config(self, tasks: dict[str, NiehTaskConfig], tokens_per_frame: int | None) -> NiehConfig:
        options = self._options
        return NiehConfig(
            tasks=tasks,
            k_tokens=options.k_tokens,
            tokens_per_frame=tokens_per_frame,
            frames=options.frames,
            prompt=None if options.prompt == PUBLISHED_MAIN else options.prompt,
            repeats=options.repeats,
            **self._memory(),
        )

    def _memory(self) -> dict[str, Any]:
        """Return the options of the memory, as far as there are any."""
        names = ("memory", "memory_args", "budget")
        return {
            name: value for name in names if (value := getattr(self._options, name)) is not None
        }

    def _refuse_unused(self) -> None:
        """Refuse options without effect: they would only change the run's config, or mislead."""
        names = ", ".join(task.name for task in self._tasks)
        measured = any(task.needs_size for task in self._tasks)
        for name in ("k_tokens", "tokens_per_frame"):
            value = getattr(self._options, name)
            if value is not None and not measured:
                raise UsageError(
                    f"--{name.replace('_', '-')} {value}: no context of {names} has a size in "
                    "tokens; leave it out, or ask nieh_haystack or nieh_truncate_head"
                )
        for name in ("context", "ctx_size"):
            value = getattr(self._options, name)
            if value is not None and not any(task.takes_context for task in self._tasks):
                raise UsageError(
                    f"--{name.replace('_', '-')} {value}: no task of {names} leaves its context "
                    "open; leave it out, or ask nieh_twins"
                )
        for name, value in self._memory().items():
            if not any(task.takes_memory for task in self._tasks):
                raise UsageError(
                    f"--{name.replace('_', '-')} {value}: no task of {names} leaves its memory "
                    "open; leave it out, or ask nieh_memory"
                )
        if self._options.prompt is not None and not any(task.takes_prompt for task in self._tasks):
            raise UsageError(
                f"--prompt {self._options.prompt}: no task of {names} leaves its words open; leave "
                "it out, or ask nieh_full"
            )
        if (self._options.retriever or self._options.retriever_revision) and not self._depends_on(
            "retriever"
        ):
            raise UsageError(
                f"--retriever: no context of {names} retrieves frames; leave it out, or ask "
                "nieh_clip_retrieval or nieh_memory_frames, or --memory clip"
            )
        if self._options.trajectories and not self._depends_on("trajectories"):
            raise UsageError(
                f"--trajectories: no context of {names} tells of the trajectory beside its frames; "
                "leave it out, or ask nieh_interleaved or nieh_text_state"
            )

    def _depends_on(self, source: str) -> bool:
        """Return whether a context of the tasks reads a source beside the set."""
        return any(source in task.sources for task in self._tasks)


class PreparedEvaluation:
    """Samples of known contexts set up for a run of a model; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, prepared: Mapping[str, PreparedTask]) -> None:
        """Take tasks by name."""
        self._prepared = prepared

    def bind(self, subject: Subject) -> "BoundNieh":
        """See `infthor_eval.runs.Evaluation.bind`."""
        return BoundNieh(Workload(_groups(self._prepared)), self._prepared, answerer_of(subject))


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
        task = group.units[0].key.task
        answerer = self._answerer
        yield from answer_units(
            group.units,
            self._prepared[task],
            answerer.video_input,
            answerer.open(task),
            answerer.open_notebook(session),
            session,
        )

    def to_sample(self, record: UnitRecord[NiehAnswer]) -> UnitSample:
        """See `infthor_eval.runs.BoundEvaluation.to_sample`."""
        prepared = self._prepared[record.task]
        number = self._numbers[record.key.once]
        sample = prepared.task_samples.samples[number]
        if record.payload.recall is not None:
            sample = apply_recall(sample, record.payload.recall)
        videos = bool(self._answerer.video_input)
        return UnitSample(
            number=number,
            doc=doc_of(prepared.task_samples, sample),
            target=doc_target(sample.question),
            prompt=prompt_of(prepared.task_samples, sample, videos=videos),
            settings=prepared.generation_kwargs,
            reply=record.payload.reply or "",
        )

    def close(self) -> None:
        """Nothing is held."""

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Positions of the samples in their tasks."""
        return {
            UnitKey(name, sample.question.id, sample.variant): number
            for name, prepared in self._prepared.items()
            for number, sample in enumerate(prepared.task_samples.samples)
        }


def _groups(prepared: Mapping[str, PreparedTask], repeats: int = 1) -> list[Group[NiehUnit]]:
    """Return a group per task and trajectory: its samples share what is encoded of that.

    Twins of one trajectory are one group: they have the frames before their first difference in
    common.
    """
    groups = []
    for task, ready in prepared.items():
        ordered = sorted(ready.task_samples.samples, key=lambda sample: sample.question.cluster)
        for _, samples in groupby(ordered, key=lambda sample: sample.question.cluster):
            same = sorted(samples, key=lambda sample: sample.question.traj_id)
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
