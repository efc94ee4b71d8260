"""One sample of a run: in words for a terminal, with its frames in the cell of a notebook."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, unknown_name
from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.presenter import Description
from infthor_eval.report.runs import choose_evenly
from infthor_eval.report.web.samples import Prompt, PromptFrames, StepRow
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run, open_runs
from infthor_eval.runs import UnitRecord

_MOST_FRAMES = 24  # in a cell
_SIDE = 150  # pixels of a frame's longer side
_ROOM = 10**7  # bytes of all frames: more than they can have


@dataclass(frozen=True)
class Sample:
    """A sample of a run. A notebook shows it as the last value of a cell.

    Attributes:
        run: the run.
        record: its record in the run's journal.
        data: folder of its data set; None for the one that the run names.
    """

    run: Run
    record: UnitRecord[Any]
    data: Path | None = None

    @property
    def description(self) -> Description:
        """What was asked, in words."""
        return self.run.presenter.describe(self.record)

    @property
    def reply(self) -> str:
        """The reply; empty if there is none."""
        return self.run.presenter.reply(self.record)

    @property
    def scores(self) -> Mapping[str, float]:
        """Each metric, 1 being right; empty for a sample without a result."""
        return self.run.suite.scores(self.record) if self.record.state == "answered" else {}

    @property
    def steps(self) -> Sequence[StepRow]:
        """The steps of an episode; empty for other samples."""
        return self.run.presenter.steps(self.record)

    @cached_property
    def prompt(self) -> Prompt | None:
        """The request as it was sent; None if its suite does not tell it."""
        return self.run.presenter.prompts(self._alone, self.data).get(self.record.key)

    @cached_property
    def frames(self) -> Sequence[FrameRef]:
        """The frames of the request, in their order.

        Raises:
            DataError: they cannot be found.
        """
        return self.run.presenter.request_frames(self._alone, self.data)(self.record)

    @property
    def _alone(self) -> Run:
        """The run with this sample alone, so that no other request is made again."""
        return self.run.with_records((self.record,))

    def lines(self) -> Iterator[str]:
        """Yield the sample in words: what was asked, the reply, and why it got its score."""
        presenter = self.run.presenter
        yield f"{self.run.label}, {self.record.task}, {self.record.key}"
        yield f"  {self.description.title}"
        yield f"  {presenter.target_label}: {self.description.target}"
        if self.record.state != "answered":
            why = self.record.failure or self.record.excluded
            yield f"  {self.record.state}, in no score: {why}"
            return
        yield f"  {presenter.reply_label}: {self.reply or '(empty)'}"
        yield f"  scores: {self._scores_in_words()}"
        for line in presenter.explain(self.record):
            yield f"    {line}"
        for name, value in presenter.details(self.record).items():
            yield f"  {name}: {value}"
        for number, step in enumerate(self.steps, 1):
            yield f"  {number:4d}. {_in_words(step)}"

    def _scores_in_words(self) -> str:
        return ", ".join(f"{name} {score:g}" for name, score in self.scores.items()) or "-"

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        """Return what a notebook shows: frames, request, reply, score. All texts are escaped."""
        from jinja2 import Environment

        template = resources.files(__package__).joinpath("sample.html").read_text(encoding="utf-8")
        pictures, note = self._pictures()
        return (
            Environment(autoescape=True)
            .from_string(template)
            .render(
                sample=self,
                presenter=self.run.presenter,
                pictures=pictures,
                note=note,
                scores=self._scores_in_words(),
                steps=list(map(_in_words, self.steps)),
                request=self._request_in_words(),
            )
        )

    def _pictures(self) -> tuple[Sequence[str], str]:
        """Return the frames as WebP in base64, and a note on those that are not there."""
        store = ThumbnailStore(_ROOM, _SIDE)
        try:
            chosen = choose_evenly(self.frames, _MOST_FRAMES)
            numbers = [store.add(frame.digest, frame.load) for frame in chosen]
        except DataError as error:
            return (), f"no frames: {error}"
        left_out = len(self.frames) - len(chosen)
        note = f"{len(chosen)} of {len(self.frames)} frames, evenly" if left_out else ""
        return [store.encoded[number] for number in numbers if number is not None], note

    def _request_in_words(self) -> str:
        if self.prompt is None:
            return ""
        if self.prompt.problem:
            return f"cannot be shown: {self.prompt.problem}"
        parts = (
            f"[{part.n} {part.what}]\n" if isinstance(part, PromptFrames) else part
            for part in self.prompt.parts
        )
        return "".join(parts) + self.description.title


def find_samples(runs: Sequence[Run], name: str, data: Path | None = None) -> list[Sample]:
    """Return the samples of a name in runs: an id, or a whole key with variant and repetition.

    Raises:
        UsageError: there is none.
    """
    found = [
        Sample(run, record, data)
        for run in runs
        for record in run.records
        if name in (record.id, str(record.key))
    ]
    if not found:
        raise unknown_name("question", name, {record.id for run in runs for record in run.records})
    return found


def load_sample(
    folder: str | os.PathLike[str], name: str, data: str | os.PathLike[str] | None
) -> Sample:
    """See `infthor_eval.load_sample`."""
    runs = open_runs([Path(folder)], warnings.warn)
    return find_samples(runs, name, None if data is None else Path(data))[0]


def _in_words(step: StepRow) -> str:
    """Return a step's action, its reward, and what was wrong with it."""
    reward = "" if step.reward is None else f", reward {step.reward:g}"
    error = f": {step.error}" if step.error else ""
    return f"{step.action or '(no action)'}{reward}{error}"
