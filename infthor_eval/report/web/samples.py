"""Samples as the page's browser has them: what was asked, and the result of each run."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Generic, TypeVar

import msgspec

from infthor_eval.report.descriptions import StepRow
from infthor_eval.runs import StoredFrames

T = TypeVar("T", bound=Hashable)


class FrameFacts(msgspec.Struct, frozen=True, omit_defaults=True):
    """What the set's log says of a frame.

    Attributes:
        step: number of the step; None if it is not known.
        action: the action before the frame, in the log's words; empty for the first frame, and
            where the log has none.
        error: why the simulator refused the action; empty if it did not.
        objects: types of the visible objects.
        held: types of the objects in the agent's hand.
        pose: the agent's pose in words; empty if the log has none.
        changed: types of what is in view and differs from the same frame of the twin.
    """

    step: int | None = None
    action: str = ""
    error: str = ""
    objects: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    pose: str = ""
    changed: tuple[str, ...] = ()


class Numbered(Generic[T]):
    """Values that samples refer to by number, each once."""

    def __init__(self) -> None:
        self._numbers: dict[T, int] = {}

    @property
    def values(self) -> list[T]:
        """The values in the order of their numbers."""
        return list(self._numbers)

    def number(self, value: T) -> int:
        """Return the number of a value, a new one if it was not there."""
        return self._numbers.setdefault(value, len(self._numbers))


class TimelineFrame(msgspec.Struct, frozen=True, omit_defaults=True):
    """A frame of a trajectory.

    Attributes:
        index: place in the trajectory, from 0 on.
        picture: number of the thumbnail; None if there was no room for it.
        is_clue: whether the frame is evidence for the answer.
        differs: whether the other samples of its group have another picture there.
        facts: number of what is known of the frame; None if nothing is.
    """

    index: int
    picture: int | None = None
    is_clue: bool = False
    differs: bool = False
    facts: int | None = None


class Timeline(msgspec.Struct, frozen=True, omit_defaults=True):
    """A trajectory, and the frames of it that are shown.

    Attributes:
        n_frames: number of frames of the trajectory.
        frames: the shown ones in time order.
        note: a remark on the choice of frames.
        recalled: further ones, which some run's memory recalled.
    """

    n_frames: int
    frames: tuple[TimelineFrame, ...] = ()
    note: str = ""
    recalled: tuple[TimelineFrame, ...] = ()

    def renumbered(self, numbers: Sequence[int]) -> "Timeline":
        """Return the same timeline, with other numbers of facts."""

        def renumber(frame: TimelineFrame) -> TimelineFrame:
            if frame.facts is None:
                return frame
            return msgspec.structs.replace(frame, facts=numbers[frame.facts])

        frames = tuple(map(renumber, self.frames))
        return msgspec.structs.replace(
            self, frames=frames, recalled=tuple(map(renumber, self.recalled))
        )


class Prompt(msgspec.Struct, frozen=True, omit_defaults=True):
    """The request of a sample as it was sent, as far as it is known.

    Attributes:
        parts: see `StoredRequest`; None stands for the sample's title.
        shown: see `StoredRequest`.
        after: number of the prompt that it continues; None if it begins anew.
        problem: why it is not known; empty if it is.
        note: a remark.
    """

    parts: tuple[str | StoredFrames | None, ...] = ()
    shown: tuple[tuple[int, int], ...] = ()
    after: int | None = None
    problem: str = ""
    note: str = ""


class PageStep(StepRow, frozen=True, omit_defaults=True):
    """A step of an episode on the page; `picture` is the number of the frame after it."""

    picture: int | None = None


class SampleResult(msgspec.Struct, frozen=True, omit_defaults=True):
    """The result of a run on a sample.

    Attributes:
        outcome: "right", "partly", "wrong", "failed", "not asked" or "excluded".
        reply: the reply, or how the episode ended.
        scores: scores by metric.
        reason: why the sample failed or was excluded.
        faults: faults after which it was retried.
        seconds: time it took.
        tokens: number of context tokens, of cached ones among them, and of reply tokens; None if
            unknown.
        details: further facts by name.
        steps: steps of an episode.
        start: number of the thumbnail of the frame before the first step.
        map: number of the picture of the map at the end.
        note: how the replay differs from the recorded episode.
        prompt: number of the request among the prompts of the page; None if the suite shows none.
        traceback: number of the failure's traceback among those of the page; None if there is none.
        why: number of the explanation of its scores among those of the page; None if there is none.
        recalled: what a memory recalled: places of frames in the trajectory, and texts.
    """

    outcome: str
    reply: str = ""
    scores: Mapping[str, float] = {}
    reason: str = ""
    faults: tuple[str, ...] = ()
    seconds: float = 0.0
    tokens: tuple[int | None, int | None, int | None] = (None, None, None)
    details: Mapping[str, str] = {}
    steps: tuple[PageStep, ...] = ()
    start: int | None = None
    map: int | None = None
    note: str = ""
    prompt: int | None = None
    traceback: int | None = None
    why: int | None = None
    recalled: tuple[int | str, ...] = ()


class PageSample(msgspec.Struct, frozen=True, omit_defaults=True):
    """A question or an episode, with the result of each run of the page.

    Attributes:
        suite: name of the suite.
        task: name of the task.
        id: the question's or the episode's id.
        variant: one of the task's ways of evaluating it; empty if there is one.
        cluster: the trajectory.
        kind: type of the question or the episode.
        clues: number of clues in words; empty for none.
        title: the question, or the instruction.
        target: the gold answers, or the goal.
        results: a result per run of the page; None for runs that did not evaluate the sample, or
            not all of its members.
        timeline: the trajectory that the sample is about.
        members: the samples that are one together; none for a sample by itself.
    """

    suite: str
    task: str
    id: str
    cluster: str
    title: str
    results: tuple[SampleResult | None, ...]
    variant: str = ""
    kind: str = ""
    clues: str = ""
    target: str = ""
    timeline: Timeline | None = None
    members: tuple["PageSample", ...] = ()

    @property
    def parts(self) -> tuple["PageSample", ...]:
        """Its members, or itself if it has none."""
        return self.members or (self,)

    def spread_over(self, n_runs: int, run_indices: Sequence[int]) -> "PageSample":
        """Return the same sample for a page of more runs: `run_indices` are its results' places."""
        results: list[SampleResult | None] = [None] * n_runs
        for run_index, result in zip(run_indices, self.results, strict=True):
            results[run_index] = result
        members = tuple(member.spread_over(n_runs, run_indices) for member in self.members)
        return msgspec.structs.replace(self, results=tuple(results), members=members)
