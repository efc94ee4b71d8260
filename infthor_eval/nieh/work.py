"""What a task asks: every question of its set in every way its context knows, and what cannot be asked."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.hub_data import default_folder
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Case, Settings, Unfit, context_named

__all__ = ["LeftOutCase", "Work", "find_set", "find_work", "open_set"]


@dataclass(frozen=True)
class LeftOutCase:
    """A question in one way of a context that cannot be asked, and why."""

    question: Question
    variant: str
    reason: str


@dataclass
class Work:
    """The work of one task.

    Attributes:
        data: the set.
        cases: what is asked.
        left_out: what is not.
        sources: what the frames depend on besides the set and the settings (`Context.sources`).
    """

    data: NiehSet
    cases: list[tuple[Question, Case]] = field(default_factory=list)
    left_out: list[LeftOutCase] = field(default_factory=list)
    sources: dict[str, Any] = field(default_factory=dict)


@lru_cache(maxsize=8)
def open_set(root: str) -> NiehSet:
    """The set in a folder, read once per process; `open_set.cache_clear()` has it read again."""
    return NiehSet(Path(root))


def find_set(data: str | None = None, bundled: str | None = None, **_: object) -> NiehSet:
    """The set of a task.

    Args:
        data: folder of an NIEH set; None is the published set where `infthor-eval fetch nieh` put it.
        bundled: name of a set that comes with the package; `data` is not looked at then.

    Raises:
        UsageError: there is none.
        DataError: it cannot be read.
    """
    if bundled:
        return open_set(str(packaged_folder(f"sets/{bundled}")))
    if data is None and not default_folder().is_dir():
        raise UsageError(
            "no NIEH set to ask about; give its folder with --data, or fetch the published one: fetch nieh"
        )
    return open_set(str(data or default_folder()))


def find_work(config: Mapping[str, Any]) -> Work:
    """Everything that a task asks.

    Args:
        config: `dataset_kwargs` of the task file and lm-eval's metadata: the name of the context, what `find_set`
            takes, and the context's settings (`infthor_eval.nieh.contexts.Settings`).

    Raises:
        UsageError: there is no set, the context is unknown, or it lacks a setting.
        DataError: the set cannot be read.
    """
    context, settings = context_named(config["context"]), Settings.read(config)
    work = Work(find_set(**config))
    work.sources = context.sources(work.data, settings)
    work.left_out += [LeftOutCase(item.question, "", item.reason) for item in work.data.skipped]
    problems: dict[FrameRef, str | None] = {}
    for question in work.data.questions:
        for case in context.cases(work.data, question, settings):
            if isinstance(case, Unfit):
                work.left_out.append(LeftOutCase(question, case.variant, case.reason))
            elif problem := _problem(context.shown(work.data, question, case), problems):
                work.left_out.append(LeftOutCase(question, case.variant, problem))
            else:
                work.cases.append((question, case))
    return work


def _problem(frames: list[FrameRef], known: dict[FrameRef, str | None]) -> str | None:
    """Why one of the frames cannot be shown; None where all can. Each frame's file is looked at once."""
    for frame in frames:
        if frame not in known:
            known[frame] = frame.problem()
        if known[frame]:
            return known[frame]
    return None
