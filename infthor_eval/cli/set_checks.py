"""Checks of an NIEH set: what it has, what cannot be used and why, and what each task can ask."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

if TYPE_CHECKING:
    from infthor_eval.nieh.set_contents import SetContents

_SHOWN = 5  # reasons that are named one by one


class Check(msgspec.Struct, frozen=True):
    """The result of one check.

    Attributes:
        name: what is checked.
        state: "ok"; "optional" if it is missing and only some uses need it; "wrong" if every use
            needs it.
        detail: what is installed, or what is missing.
        hint: how to fix it; empty if there is nothing to fix.
    """

    name: str
    state: Literal["ok", "optional", "wrong"]
    detail: str
    hint: str = ""


def set_checks(root: Path, trajectories: Path | None) -> Iterator[Check]:
    """Yield the checks of a set, the contexts last.

    Raises:
        DataError: the folder is no set.
    """
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.nieh.set_contents import read_asked_tasks, read_contents

    contents = read_contents(NiehSet(root))
    yield from _questions(contents)
    yield from _trajectories(contents)
    if not contents.frames:
        missing = "none can be read: tables of the files' own scores can be made, and no more"
        hint = "unpack the set's metadata.tar beside its question files"
        yield Check("frames", "optional", missing, hint)
        return
    n_asked = 0
    for task in read_asked_tasks(root, trajectories):
        n_asked += task.n_asked
        detail = f"{task.n_asked:,} of {task.n_asked + task.skipped.total():,} samples can be asked"
        if task.skipped:
            yield Check(f"task {task.name}", "optional", detail, _in_words(task.skipped))
        else:
            yield Check(f"task {task.name}", "ok", detail)
    if not n_asked:
        yield Check("questions", "wrong", "none can be asked", "the lines above say why")


def _questions(contents: SetContents) -> Iterator[Check]:
    for name, by_type in contents.questions.items():
        types = ", ".join(f"{kind or 'unknown'} {number}" for kind, number in by_type.most_common())
        yield Check(f"questions {name}", "ok", f"{by_type.total():,}: {types}")
    if contents.malformed:
        detail = f"{contents.malformed.total():,} are no question: {_in_words(contents.malformed)}"
        yield Check(
            "rows", "optional", detail, "correct them in the question file, or leave them out"
        )
    if contents.left_out:
        detail = f"{contents.left_out.total():,} questions: {_in_words(contents.left_out)}"
        yield Check("left out", "optional", detail, "they are counted in every result")


def _trajectories(contents: SetContents) -> Iterator[Check]:
    if contents.frames:
        low, high = min(contents.frames), max(contents.frames)
        detail = (
            f"{len(contents.frames):,} of {contents.n_trajectories:,} can be read; "
            f"{sum(contents.frames):,} frames"
        )
        detail += f" ({low:,} to {high:,} each, median {statistics.median(contents.frames):g})"
        if contents.n_unasked:
            detail += f"; {contents.n_unasked:,} more without a question"
        yield Check("trajectories", "ok", detail)
        sizes = {f"{width}x{height}": n for (width, height), n in contents.image_sizes.items()}
        detail = f"in {_counted(contents.image_folders)}; {_counted(sizes)} pixels"
        if done := contents.conversions - Counter({"": contents.conversions[""]}):
            detail += f"; converted for models, as a browser shows them: {_in_words(done)}"
        yield Check("pictures", "ok", detail)
        yield Check("step logs", "ok", _counted(contents.layouts))
    if contents.unreadable:
        more = len(contents.unreadable) - _SHOWN
        reasons = "; ".join(contents.unreadable[:_SHOWN])
        reasons += f"; and {more:,} more" if more > 0 else ""
        detail = f"{len(contents.unreadable):,} cannot be read"
        yield Check("unreadable trajectories", "optional", detail, reasons)


def _counted(numbers: Mapping[str, int]) -> str:
    """Return names, each with its number if there are several."""
    if len(numbers) == 1:
        return next(iter(numbers))
    return ", ".join(f"{name} ({number:,})" for name, number in Counter(numbers).most_common())


def _in_words(reasons: Counter[str]) -> str:
    named = [f"{reason} ({number:,})" for reason, number in reasons.most_common(_SHOWN)]
    more = len(reasons) - _SHOWN
    return "; ".join(named) + (f"; and {more:,} other reasons" if more > 0 else "")
