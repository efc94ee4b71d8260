"""NIEH set up for a run: what its tasks ask, and the doing of it, a trajectory at a time."""

from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from itertools import groupby
from typing import cast

from infthor_eval.errors import DataError, InfthorError, ModelError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.answering import NiehUnit, answered
from infthor_eval.nieh.docs import doc_of, doc_target, prompt_of
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.respondents import respondent
from infthor_eval.nieh.samples import TaskSamples, open_set
from infthor_eval.nieh.task import NiehTask, PreparedTask
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
from model_adapters import Subject

__all__ = ["NiehEvaluation"]


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
        self._tasks = [NiehTask(file, request) for file in request.tasks]
        self._prepared: dict[str, PreparedTask] = {}
        _refuse_nothing([task.found for task in self._tasks], self._tasks)
        self._refuse_unused()

    def workload(self, subject: Subject) -> Workload:
        """See `infthor_eval.runs.Evaluation.workload`."""
        self._respondent = respondent(subject)
        tokens = self._tokens_per_frame()
        self._prepared = {task.name: task.prepared(tokens) for task in self._tasks}
        _refuse_nothing([prepared.found for prepared in self._prepared.values()], self._tasks)
        self._respondent.read_keys({task.name: partial(task.key, tokens) for task in self._tasks})
        tasks = {task.name: task.identity(self._prepared[task.name]) for task in self._tasks}
        costs = {name: self._respondent.cost(prepared) for name, prepared in self._prepared.items()}
        return Workload(
            groups=[group for name, prepared in self._prepared.items() for group in _groups(name, prepared)],
            skipped=[
                skipped for name, prepared in self._prepared.items() for skipped in _skipped(name, prepared.found)
            ],
            identity={
                "tasks": tasks,
                "k_tokens": self._options.k_tokens,
                "tokens_per_frame": tokens,
                "frames": self._options.frames,
            },
            costs=[Cost(name, cost) for name, cost in costs.items() if cost is not None],
        )

    def run(self, group: Group, session: Session) -> Iterator[UnitRecord[NiehAnswer]]:
        """See `infthor_eval.runs.Evaluation.run`."""
        units = cast(Sequence[NiehUnit], group.units)  # its own groups
        task = units[0].key.task
        yield from answered(units, self._prepared[task], self._respondent.answerer(task, session), session)

    def view(self, record: UnitRecord[NiehAnswer]) -> UnitSample:
        """See `infthor_eval.runs.Evaluation.view`."""
        prepared = self._prepared[record.task]
        number = self._numbers[record.key]
        sample = prepared.found.samples[number]
        settings = next(task.settings for task in self._tasks if task.name == record.task)
        return UnitSample(
            number=number,
            doc=doc_of(prepared.found, sample),
            target=doc_target(sample.question),
            prompt=prompt_of(prepared.found, sample),
            settings=settings["generation_kwargs"],
            reply=record.payload.reply or "",
        )

    def close(self) -> None:
        """Nothing is held."""

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Places of the samples in their tasks."""
        return {
            UnitKey(name, sample.question.id, sample.variant): number
            for name, prepared in self._prepared.items()
            for number, sample in enumerate(prepared.found.samples)
        }

    def _tokens_per_frame(self) -> int | None:
        """The size of a frame where a context is measured in it: as told, or the subject's own."""
        measured = next((task for task in self._tasks if task.needs_size), None)
        if measured is None or self._options.tokens_per_frame is not None:
            return self._options.tokens_per_frame
        return self._measured(measured.data)

    def _measured(self, data: NiehSet) -> int:
        """The subject's size of a frame, by the first frame of the questions that can be read."""
        problems: list[InfthorError] = []
        for question in data.questions:
            for frame in data.clue_frames(question):
                try:
                    return self._respondent.tokens_per_frame(frame)
                except (DataError, ModelError) as error:
                    problems.append(error)
        reasons = [str(problem) for problem in problems] or sorted(data.reasons()) or ["its files are empty"]
        raise UsageError(f"no question of {data.root} can be asked ({reasons[0]}); mend the set, or give another")

    def _refuse_unused(self) -> None:
        """A kilo-token that no context is measured in would only give the run another identity; others mislead."""
        asked = ", ".join(task.name for task in self._tasks)
        measured = any(task.needs_size for task in self._tasks)
        for name in ("k_tokens", "tokens_per_frame"):
            if getattr(self._options, name) is not None and not measured:
                raise UsageError(
                    f"--{name.replace('_', '-')} {getattr(self._options, name)}: no context of {asked} has a size in "
                    "tokens; leave it out, or ask nieh_haystack or nieh_truncate_head"
                )
        if (self._options.retriever or self._options.retriever_revision) and not self._depends_on("retriever"):
            raise UsageError(
                f"--retriever: no context of {asked} retrieves frames; "
                "leave it out, or ask nieh_clip_retrieval or nieh_memory_frames"
            )
        if self._options.trajectories and not self._depends_on("trajectories"):
            raise UsageError(
                f"--trajectories: no context of {asked} tells of the trajectory beside its frames; "
                "leave it out, or ask nieh_interleaved or nieh_text_state"
            )

    def _depends_on(self, source: str) -> bool:
        """Whether a context of the tasks looks at a source beside the set."""
        return any(task.found is not None and source in task.found.sources for task in self._tasks)


def _refuse_nothing(found: Sequence[TaskSamples | None], tasks: Sequence[NiehTask]) -> None:
    """A task of several may have nothing to ask (no window so large fits); all of them may not."""
    if any(samples is None or samples.samples for samples in found):
        return
    reasons = {item.reason for samples in found if samples is not None for item in samples.skipped}
    said = "; ".join(sorted(reasons)[:3]) or "its files are empty"
    raise UsageError(f"no question of {tasks[0].data.root} can be asked ({said}); mend the set, or give another")


def _groups(task: str, prepared: PreparedTask) -> Iterator[Group]:
    """The samples of one trajectory are a group: they share what is encoded of it."""
    ordered = sorted(prepared.found.samples, key=lambda sample: sample.question.traj_id)
    for _, samples in groupby(ordered, key=lambda sample: sample.question.traj_id):
        same = list(samples)
        frames = len({frame for sample in same for frame in sample.frames})
        yield Group([NiehUnit.of(task, sample) for sample in same], frames=frames)


def _skipped(task: str, found: TaskSamples) -> Iterator[Skipped]:
    for item in found.skipped:
        yield Skipped(UnitKey(task, item.question.id, item.variant), item.reason)
