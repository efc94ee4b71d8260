"""What watching has in common, of whichever suite the run is."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from infthor_eval.terminal import PlainConsole

__all__ = ["FOLDER", "Wanted", "followed", "heading", "place_of", "refuse_options"]

FOLDER = Path("results/recordings")


class _Moment(Protocol):
    @property
    def note(self) -> str: ...


M = TypeVar("M", bound=_Moment)


@dataclass(frozen=True)
class Wanted:
    """The options of `watch`, as typed."""

    run: Path
    trajectory: str | None
    task: str | None
    plans: str | None
    episode: str | None
    sheet: Path | None
    out: Path | None
    data: str | None
    scenes: Path | None
    fps: float


def refuse_options(wanted: Wanted, suite: str, options: Mapping[str, object]) -> None:
    """See that no option is given that is not for runs of a suite.

    Raises:
        UsageError: one is.
    """
    from infthor_eval.errors import UsageError

    for option, value in options.items():
        if value is not None:
            raise UsageError(f"{option}: is not for runs of {suite}, and {wanted.run} is one; leave it out")


def place_of(parts: Sequence[str], ending: str = ".mp4") -> Path:
    """A file of its own for each choice."""
    name = "-".join(re.sub(r"[^\w.-]", "_", part) for part in parts)
    return FOLDER / f"{name:.200}{ending}"


def heading(parts: Sequence[str], simulator: str) -> str:
    """What stands above each picture."""
    named = "embedded simulator" if simulator == "embedded" else simulator
    return "  ·  ".join([*parts, named])


def followed(moments: Iterable[M], advance: Callable[[], None], notes: PlainConsole) -> Iterator[M]:
    """The same moments, with progress and with what there is to be told of them."""
    for moment in moments:
        if moment.note:
            notes.print(f"otherwise than recorded: {moment.note}")
        advance()
        yield moment
