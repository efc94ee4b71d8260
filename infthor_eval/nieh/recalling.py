"""Recalling what a memory shows of a trajectory, for each question on it.

The memory observes the trajectory once, up to the step before the last, and recalls for every question. What it
recalled is in the run's journal, so that a resumed run shows the same and needs no memory for it.
"""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from infthor_eval.errors import InfthorError, ModelError, UsageError
from infthor_eval.formats.digests import fingerprint
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
    wrap_memory_errors,
)
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.contexts.base import clue_positions
from infthor_eval.nieh.recall_settings import RecallSettings
from infthor_eval.nieh.records import NiehRecall
from infthor_eval.nieh.samples import TaskSamples

__all__ = ["FindRecall", "KeepRecall", "Recaller", "apply_recall", "recall_all"]

FindRecall = Callable[[str], NiehRecall | None]  # looks up what was recalled from the same inputs, by their hash
KeepRecall = Callable[[str, NiehRecall], None]

_IN_USE = threading.Lock()  # memories are shared by a process, and serve one trajectory at a time


class Recaller:
    """Recalls for the questions on one trajectory; a context manager, as only one of a process uses a memory."""

    def __init__(self, task_samples: TaskSamples, write: Write | None, find: FindRecall, keep: KeepRecall) -> None:
        """Take a task's samples, what asks the model under test, and where recalls are kept.

        Args:
            task_samples: the samples.
            write: asks the model under test; None if there is none, then memories that need one are refused.
            find: finds an earlier recall.
            keep: keeps a new one.
        """
        self._task_samples, self._write, self._find, self._keep = task_samples, write, find, keep
        self._built: tuple[str, RecallSettings, Memory, float] | None = None
        self._trajectories: dict[str, list[Observation]] = {}

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Reserve the memories of this process within the context; what this has built is not used afterwards."""
        with _IN_USE:
            yield
            self._built = None

    def recall(self, sample: Sample) -> NiehRecall:
        """Return what is recalled for a sample.

        Raises:
            DataError: a frame or the trajectory's metadata cannot be read.
            ModelError: the model under test cannot write what the memory asks for, or the memory recalls what it may
                not: beyond its budget, or what it has not observed.
            UserCodeError: the memory fails.
        """
        settings, question = sample.recall, sample.question
        if settings is None:
            raise ValueError("the sample's context has no memory")
        steps = self._observations(question.traj_id, sample)
        inputs = self._fingerprint(sample, settings, steps)
        known = self._find(inputs)
        if known is not None:
            return known
        memory, build_s = self._build(question.traj_id, settings, steps)
        clues = clue_positions(self._task_samples.data, question) if not question.absence else ()
        shown = _visible(steps, memory)
        query = Query(text=question.text, present=shown[-1], clues=clues if memory.capabilities.privileged else None)
        start = time.perf_counter()
        with wrap_memory_errors(settings.memory):
            recalled = list(memory.recall(query, settings.budget))
        recall_s = time.perf_counter() - start
        check_recalled(recalled, shown[:-1], settings.memory, settings.budget, settings.tokens_per_frame)
        result = NiehRecall(
            recalled=tuple(item if isinstance(item, str) else item.number for item in recalled),
            build_s=round(build_s, 4),
            recall_s=round(recall_s, 4),
        )
        self._keep(inputs, result)
        return result

    def _observations(self, traj_id: str, sample: Sample) -> list[Observation]:
        if traj_id not in self._trajectories:
            self._trajectories[traj_id] = _observations(self._task_samples, sample)
        return self._trajectories[traj_id]

    def _fingerprint(self, sample: Sample, settings: RecallSettings, steps: Sequence[Observation]) -> str:
        return fingerprint(
            {
                "memory": memory_identity(settings.memory, settings.options),
                "budget": [settings.budget, settings.tokens_per_frame],
                "seed": settings.seed,
                "frames": [step.frame.digest for step in steps],
                "question": sample.question.text,
                "clues": list(sample.question.clues),
                "data": self._task_samples.data.fingerprint,
            }
        )

    def _build(self, traj_id: str, settings: RecallSettings, steps: Sequence[Observation]) -> tuple[Memory, float]:
        """Return the memory with the trajectory observed, and the seconds that this took."""
        if self._built is None or self._built[:2] != (traj_id, settings):
            memory = open_memory(settings.memory, settings.options)
            write = self._write if memory.capabilities.writes else None
            if memory.capabilities.writes and write is None:
                raise ModelError(f"the memory {settings.memory} asks the model under test, and there is none")
            facts = TrajectoryFacts(
                name=traj_id, tokens_per_frame=settings.tokens_per_frame, seed=settings.seed, write=write
            )
            start = time.perf_counter()
            with wrap_memory_errors(settings.memory):
                memory.begin(facts)
                for step in _visible(steps, memory)[:-1]:
                    memory.observe(step)
            self._built = traj_id, settings, memory, time.perf_counter() - start
        return self._built[2], self._built[3]


def apply_recall(sample: Sample, recall: NiehRecall) -> Sample:
    """Return a sample with what was recalled for it: these frames and the last one are shown."""
    frames = [item for item in recall.recalled if isinstance(item, int)]
    return replace(sample, frames=(*frames, sample.frames[-1]), recalled=recall.recalled)


def recall_all(task_samples: TaskSamples) -> list[Sample]:
    """Return the samples of a task, with what their memory recalls, for models that are none of ours.

    Raises:
        UsageError: the memory asks the model under test, or recalling fails.
    """
    if not any(sample.recall and sample.recalled is None for sample in task_samples.samples):
        return list(task_samples.samples)
    kept: dict[str, NiehRecall] = {}
    recaller = Recaller(task_samples, None, kept.get, kept.__setitem__)
    by_trajectory = sorted(enumerate(task_samples.samples), key=lambda item: item[1].question.traj_id)
    with recaller.in_use():
        try:
            recalled = {number: apply_recall(sample, recaller.recall(sample)) for number, sample in by_trajectory}
        except InfthorError as error:
            raise UsageError(f"{error}; run the task with `infthor-eval run`, or with --model infthor") from error
    return [recalled[number] for number in range(len(recalled))]


def _visible(steps: Sequence[Observation], memory: Memory) -> list[Observation]:
    """Return the steps as the memory may see them: the simulator's metadata only if it is privileged."""
    return list(steps) if memory.capabilities.privileged else [replace(step, log=None) for step in steps]


def _observations(task_samples: TaskSamples, sample: Sample) -> list[Observation]:
    """Return all steps of a sample's trajectory."""
    data, traj_id = task_samples.data, sample.question.traj_id
    frames = task_samples.all_frames(sample)
    steps = sorted(read_steps(data.folder(traj_id)), key=lambda step: step.img_idx)
    outline = data.outline(traj_id)
    actions = outline.actions if outline else []
    goals = {number: goal for goal, span in (outline.tasks if outline else []) for number in span}
    return [
        Observation(
            number=number,
            frame=frame,
            action=step.action or (actions[step.step] if number and step.step < len(actions) else None),
            goal=goals.get(step.step),
            log=step.object_log,
        )
        for number, (frame, step) in enumerate(zip(frames, steps, strict=True))
    ]
