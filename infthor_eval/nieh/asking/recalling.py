"""Recalling what a memory shows of a trajectory, for each question on it.

The memory observes the trajectory once, and recalls on the way: for the questions at a moment it
has observed the steps before it. What it recalled is in the run's journal, so that a resumed run
shows the same and needs no memory for it.
"""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

from infthor_eval.errors import InfthorError, ModelError, UsageError
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import read_steps
from infthor_eval.memory import (
    Memory,
    Observation,
    Query,
    TrajectoryFacts,
    Write,
    check_recalled,
    memory_identity,
    open_memory,
    pieces_of,
    wrap_memory_errors,
)
from infthor_eval.memory.caches import FRAMES
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.contexts.base import RecallSettings
from infthor_eval.nieh.records import NiehRecall
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.storage.deadlines import not_counted
from infthor_eval.storage.digests import fingerprint
from model_adapters import CacheCut

# Looks up what was recalled from the same inputs, by their hash.
FindRecall = Callable[[str], NiehRecall | None]
KeepRecall = Callable[[str, NiehRecall], None]

_IN_USE = threading.Lock()  # memories are shared by a process, and serve one trajectory at a time


class _Built(NamedTuple):
    """A memory that has observed a trajectory up to the step before a moment.

    Attributes:
        steps: the steps up to the moment.
        settings: its settings.
        memory: the memory.
        seen: the steps as it sees them.
        seconds: seconds that it took to observe them.
    """

    steps: Sequence[Observation]
    settings: RecallSettings
    memory: Memory
    seen: Sequence[Observation]
    seconds: float

    def is_before(self, steps: Sequence[Observation], settings: RecallSettings) -> bool:
        """Return True if what has been observed is the beginning of some steps."""
        observed = self.steps[:-1]
        return self.settings == settings and observed == steps[:-1][: len(observed)]


class Recaller:
    """Recalls for questions, by trajectory, while `in_use` reserves this process's memories."""

    def __init__(
        self, task_samples: TaskSamples, write: Write | None, find: FindRecall, keep: KeepRecall
    ) -> None:
        """Take a task's samples, what asks the model under test, and where recalls are kept.

        Args:
            task_samples: the samples.
            write: asks the model under test; None if there is none, then memories that need one are
                refused.
            find: finds an earlier recall.
            keep: keeps a new one.
        """
        self._task_samples = task_samples
        self._write = write
        self._find = find
        self._keep = keep
        self._built: _Built | None = None
        self._identities: dict[RecallSettings, dict[str, Any]] = {}
        self._observed: dict[
            tuple[str, int | None], tuple[list[Observation], list[str]]
        ] = {}  # steps up to a moment and digests of their frames

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Reserve this process's memories within the context; what was built is not used later."""
        with _IN_USE:
            yield
            self._built = None

    def recall(self, sample: QuestionVariant) -> NiehRecall:
        """Return what is recalled for a sample."""
        settings = sample.recall
        question = sample.question
        if settings is None:
            raise ValueError("the sample's context has no memory")
        steps, digests = self._observations(sample)
        inputs = self._fingerprint(sample, settings, digests)
        known = self._find(inputs)
        if known is not None:
            return known
        built = self._build(question, settings, steps)
        memory = built.memory
        past = built.seen[:-1]
        present = built.seen[-1]
        clues: tuple[int, ...] = ()
        if question.has_evidence:
            clues = tuple(sorted(set(self._task_samples.data.clue_positions(question))))
        query = Query(
            text=question.text,
            present=present,
            clues=clues if memory.capabilities.privileged else None,
        )
        start = time.perf_counter()
        with wrap_memory_errors(settings.memory):
            recalled = pieces_of(memory.recall(query, settings.budget), settings.memory)
        recall_s = time.perf_counter() - start
        check_recalled(recalled, past, settings.memory, settings.budget, settings.tokens_per_frame)
        result = NiehRecall(
            recalled=tuple(part if isinstance(part, str) else part.number for part in recalled),
            build_s=round(built.seconds, 4),
            recall_s=round(recall_s, 4),
        )
        self._keep(inputs, result)
        return result

    def _observations(self, sample: QuestionVariant) -> tuple[list[Observation], list[str]]:
        """Return what is observed for a sample's question: blank frames where its clues are hidden,
        which keeps the positions of all others."""
        moment = sample.question.traj_id, sample.question.moment
        if moment not in self._observed:
            steps = _observations(self._task_samples, sample)
            self._observed[moment] = steps, [step.frame.digest for step in steps]
        hidden = self._task_samples.hidden(sample)
        if not hidden:
            return self._observed[moment]
        steps = [
            replace(step, frame=blank_like(step.frame)) if step.number in hidden else step
            for step in self._observed[moment][0]
        ]
        return steps, [step.frame.digest for step in steps]

    def _identity(self, settings: RecallSettings) -> dict[str, Any]:
        if settings not in self._identities:  # it reads the source of a memory of one's own
            self._identities[settings] = memory_identity(settings.memory, settings.options)
        return self._identities[settings]

    def _fingerprint(
        self, sample: QuestionVariant, settings: RecallSettings, digests: Sequence[str]
    ) -> str:
        return fingerprint(
            {
                "memory": self._identity(settings),
                "budget": [settings.budget, settings.tokens_per_frame],
                "seed": settings.seed,
                "frames": digests,
                "question": sample.question.text,
                "clues": list(sample.question.clues),
                "data": self._task_samples.data.fingerprint,
            }
        )

    def _build(
        self, question: Question, settings: RecallSettings, steps: Sequence[Observation]
    ) -> _Built:
        """Return the memory with the steps before the last one observed."""
        built = self._built
        self._built = None  # a memory that fails half-way is not used again
        if built is None or not built.is_before(steps, settings):
            built = _begin(question, settings, self._write)
        if built.steps is not steps:
            seen = _visible(steps, built.memory)
            start = time.perf_counter()
            for step in seen[len(built.steps[:-1]) : -1]:
                with wrap_memory_errors(settings.memory):
                    built.memory.observe(step)
            seconds = built.seconds + time.perf_counter() - start
            built = built._replace(steps=steps, seen=seen, seconds=seconds)
        self._built = built
        return built


def _begin(question: Question, settings: RecallSettings, write: Write | None) -> _Built:
    """Return a memory that has begun a question's trajectory."""
    memory = open_memory(settings.memory, settings.options)
    write = write if memory.capabilities.writes else None
    if memory.capabilities.writes and write is None:
        raise ModelError(
            f"the memory {settings.memory} asks the model under test, and there is none"
        )
    facts = TrajectoryFacts(
        name=question.cluster,
        tokens_per_frame=settings.tokens_per_frame,
        seed=settings.seed,
        write=None if write is None else _uncounted(write),
    )
    start = time.perf_counter()
    with wrap_memory_errors(settings.memory):
        memory.begin(facts)
    return _Built((), settings, memory, (), time.perf_counter() - start)


def _uncounted(write: Write) -> Write:
    """Return what asks the model; the model's time is none of the memory's, which is limited."""

    def ask(*arguments: Any, **options: Any) -> Any:
        with not_counted():
            return write(*arguments, **options)

    return ask


def apply_recall(
    sample: QuestionVariant, recall: NiehRecall, clues: tuple[int, ...] = ()
) -> QuestionVariant:
    """Return a sample with what was recalled for it: these frames and the last one are shown, or
    kept in the model's cache, which reads all."""
    frames = [number for number in recall.recalled if isinstance(number, int)]
    settings = sample.recall
    cache = open_memory(settings.memory, settings.options).capabilities.cache if settings else None
    if settings is not None and cache is not None:
        cut = CacheCut(
            method=cache,
            budget=settings.budget,
            frames=tuple(frames) if cache == FRAMES else None,
            clues=clues,
        )
        return replace(sample, recalled=recall.recalled, cut=cut)
    return replace(sample, frames=(*frames, sample.frames[-1]), recalled=recall.recalled)


def recall_all(task_samples: TaskSamples) -> list[QuestionVariant]:
    """Return a task's samples, with what their memory recalls, for models that are none of ours."""
    if not any(sample.awaits_recall for sample in task_samples.samples):
        return list(task_samples.samples)
    kept: dict[str, NiehRecall] = {}
    recaller = Recaller(task_samples, None, kept.get, kept.__setitem__)
    by_trajectory = sorted(
        enumerate(task_samples.samples), key=lambda numbered: numbered[1].question.place
    )
    with recaller.in_use():
        try:
            for settings in {sample.recall for _, sample in by_trajectory if sample.recall}:
                if open_memory(settings.memory, settings.options).capabilities.cache:
                    raise UsageError(f"the memory {settings.memory} cuts the model's own cache")
            recalled = {
                number: apply_recall(sample, recaller.recall(sample))
                for number, sample in by_trajectory
            }
        except InfthorError as error:
            raise UsageError(
                f"{error}; run the task with `infthor-eval run`, or with --model infthor"
            ) from error
    return [recalled[number] for number in range(len(recalled))]


def asks_model(task_samples: TaskSamples) -> bool:
    """Return whether a memory of a task asks the model under test."""
    waiting = [sample.recall for sample in task_samples.samples if sample.awaits_recall]
    return any(
        open_memory(settings.memory, settings.options).capabilities.writes
        for settings in set(waiting)
        if settings is not None
    )


def _visible(steps: Sequence[Observation], memory: Memory) -> list[Observation]:
    """Return the steps as the memory may see them: metadata only if it is privileged."""
    return (
        list(steps)
        if memory.capabilities.privileged
        else [replace(step, log=None, step=None) for step in steps]
    )


def _observations(task_samples: TaskSamples, sample: QuestionVariant) -> list[Observation]:
    """Return all steps of a sample's trajectory up to its moment."""
    data = task_samples.data
    traj_id = sample.question.traj_id
    frames = task_samples.all_frames(sample)
    logged = sorted(read_steps(data.folder(traj_id)), key=lambda step: step.img_idx)
    steps = logged if sample.question.moment is None else logged[: len(frames)]
    outline = data.outline(traj_id)
    actions = outline.actions if outline else []
    goals = {number: goal for goal, span in (outline.tasks if outline else []) for number in span}
    return [
        Observation(
            number=number,
            frame=frame,
            action=step.action
            or (actions[step.step] if number and step.step < len(actions) else None),
            goal=goals.get(step.step),
            log=step.object_log,
            step=step,
        )
        for number, (frame, step) in enumerate(zip(frames, steps, strict=True))
    ]
