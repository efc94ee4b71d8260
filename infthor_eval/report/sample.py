"""One sample of a run: in words for a terminal, with its frames in the cell of a notebook."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from operator import attrgetter
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, unknown_name
from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.descriptions import THOUGHT, Description, StepRow
from infthor_eval.report.runs import choose_evenly
from infthor_eval.run import Run, open_runs
from infthor_eval.runs import StoredFrames, StoredRequest, UnitRecord

_MOST_FRAMES = 24  # in a cell
_SIDE = 150  # pixels of a frame's longer side
_ROOM = 10**7  # bytes of all frames: more than they can have


@dataclass(frozen=True)
class TokenCounts:
    """Tokens of a sample's requests, of those not encoded again, and of its replies."""

    context: int
    cached: int
    reply: int


@dataclass(frozen=True)
class Sample:
    """A sample of a run, as every reader of runs has it: pages, exports, `show`, notebooks.

    A notebook shows it as the last value of a cell.

    Attributes:
        run: the run.
        record: its record in the run's journal.
        data: folder of its data set; None for the one that the run names.
    """

    run: Run
    record: UnitRecord[Any]
    data: Path | None = None

    @cached_property
    def description(self) -> Description:
        """What was asked, in words."""
        return self.run.presenter.describe(self.record)

    @property
    def question(self) -> str:
        """The question, the plan or the instruction."""
        return self.description.title

    @property
    def target(self) -> str:
        """The gold answers, or the goal."""
        return self.description.target

    @property
    def reply(self) -> str:
        """The reply, or how an episode ended; empty if there is none."""
        return self.run.presenter.reply(self.record)

    @property
    def thinking(self) -> str | None:
        """What the model thought before its reply; None if it did not."""
        return self.details.get(THOUGHT)

    @cached_property
    def details(self) -> Mapping[str, str]:
        """Further facts by name."""
        return self.run.presenter.details(self.record)

    @property
    def is_answered(self) -> bool:
        """Whether it has a result."""
        return self.record.state == "answered"

    @cached_property
    def scores(self) -> Mapping[str, float]:
        """Each metric, 1 being right; empty for a sample without a result."""
        return self.run.suite.scores(self.record) if self.is_answered else {}

    @property
    def outcome(self) -> str:
        """See `Run.outcome`."""
        return self.run.outcome(self.record)

    @property
    def reason(self) -> str:
        """Why it failed or is excluded; empty if it has a result."""
        return self.record.failure or self.record.excluded or ""

    @property
    def is_episode(self) -> bool:
        """Whether it is an episode, and no reply to a request."""
        return self.run.presenter.replay is not None

    @cached_property
    def steps(self) -> Sequence[StepRow]:
        """The steps of an episode; empty for other samples."""
        return self.run.presenter.steps(self.record)

    @cached_property
    def request(self) -> StoredRequest | None:
        """The request as it was sent, of an episode the one before its first step; None if it is
        not known."""
        requests = self.run.requests(self.record)
        parts = tuple(part for request in requests for part in request.stored)
        return StoredRequest(parts, requests[-1].shown) if requests else None

    @property
    def request_problem(self) -> str:
        """Why the request is not known; empty if it is, and for a baseline, which is sent none."""
        if self.request is not None or self.run.is_baseline:
            return ""
        if self.record.request:
            return "it is not in the journal; its line there is missing or bad"
        return f"none was made: {self.reason}" if self.reason else "the run's journal has none"

    def request_text(self, words: Callable[[StoredFrames], str]) -> str | None:
        """Return the request as one text, `words` for frames; None if it is not known."""
        return None if self.request is None else self.request.text(self.question, words)

    @property
    def tokens(self) -> TokenCounts | None:
        """Tokens of its requests and replies; None if they were not counted."""
        tokens = self.record.tokens
        usage = self.record.usage
        if tokens.context is not None and tokens.reply is not None:
            return TokenCounts(tokens.context, tokens.cached or 0, tokens.reply)
        if usage.context or usage.reply:
            return TokenCounts(usage.context, usage.cached, usage.reply)
        return None

    @cached_property
    def frames(self) -> Sequence[FrameRef]:
        """The frames of the request, in their order.

        Raises:
            DataError: they cannot be found.
        """
        return self.run.presenter.request_frames(self.run, self.data)(self.record)

    def lines(self) -> Iterator[str]:
        """Yield the sample in words: what was asked, the reply, and why it got its score."""
        presenter = self.run.presenter
        yield f"{self.run.label}, {self.record.task}, {self.record.key}"
        yield f"  {self.question}"
        yield f"  {presenter.target_label}: {self.target}"
        if not self.is_answered:
            yield f"  {self.record.state}, in no score: {self.reason}"
            return
        yield f"  {presenter.reply_label}: {self.reply or '(empty)'}"
        yield f"  scores: {self._scores_in_words()}"
        for line in presenter.explain(self.record):
            yield f"    {line}"
        for name, value in self.details.items():
            yield f"  {name}: {value}"
        request = self._request_in_words()
        if request:
            yield f"  request: {request}"
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
        # For notebooks alone: runs import this module before their first question.
        from infthor_eval.report.web.thumbnails import ThumbnailStore

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
        problem = self.request_problem
        known = self.request_text(attrgetter("in_words")) or ""
        return f"not known: {problem}" if problem else known


def find_samples(runs: Sequence[Run], name: str, data: Path | None = None) -> list[Sample]:
    """Return the samples of a name in runs: an id, or a whole key with variant and repetition."""
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
