"""Samples as the page's browser has them: what was asked, and what each run made of it."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

__all__ = ["Frame", "Result", "Sample", "StepRow", "Timeline", "outcome"]


class Frame(msgspec.Struct, frozen=True, omit_defaults=True):
    """A frame of a trajectory.

    Attributes:
        at: its place, from 0 on.
        picture: number of its thumbnail; None where there was no room for it.
        is_clue: whether it holds evidence.
    """

    at: int
    picture: int | None = None
    is_clue: bool = False


class Timeline(msgspec.Struct, frozen=True, omit_defaults=True):
    """A trajectory, and the frames of it that are shown.

    Attributes:
        n_frames: of the trajectory.
        frames: in time order.
        note: what must be said of them.
    """

    n_frames: int
    frames: tuple[Frame, ...] = ()
    note: str = ""


class StepRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """An action in an episode.

    Attributes:
        action: in words; empty where there was none that could be tried.
        reply: what the model said, where that is not the action.
        wrong: what was wrong with it.
        reward: what it earned; None where steps earn nothing by themselves.
        told: other numbers, in words.
        picture: number of the thumbnail of what was seen after it.
    """

    action: str = ""
    reply: str = ""
    wrong: str = ""
    reward: float | None = None
    told: str = ""
    picture: int | None = None


class Result(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a run made of a sample.

    Attributes:
        outcome: "right", "partly", "wrong", "failed" or "left out".
        said: the reply, or how the episode ended.
        scores: by metric.
        why: why it failed or was left out.
        faults: what was survived on the way.
        seconds: that it took.
        tokens: of context, cached and of reply; None where they are not known.
        steps: of an episode.
        first: number of the thumbnail of what was seen before the first step.
        map: number of the picture of the room, or of the arm's reach, at the end.
        note: what must be said of the pictures.
    """

    outcome: str
    said: str = ""
    scores: Mapping[str, float] = {}
    why: str = ""
    faults: tuple[str, ...] = ()
    seconds: float = 0.0
    tokens: tuple[int | None, int | None, int | None] = (None, None, None)
    steps: tuple[StepRow, ...] = ()
    first: int | None = None
    map: int | None = None
    note: str = ""


class Sample(msgspec.Struct, frozen=True, omit_defaults=True):
    """What was asked of one or several runs.

    Attributes:
        suite: the kind of evaluation.
        task: the task.
        id: of the question or the episode.
        variant: of several ways of asking it.
        cluster: the trajectory.
        kind: type of question, of plan, or of errand.
        clues: column of Table 4; empty where there are none of it.
        title: the question, or what was to be done.
        wanted: the gold answers, or the goal.
        results: a result per run of the page; None where a run does not have it.
        timeline: of the trajectory that a question is about.
    """

    suite: str
    task: str
    id: str
    cluster: str
    title: str
    results: tuple[Result | None, ...]
    variant: str = ""
    kind: str = ""
    clues: str = ""
    wanted: str = ""
    timeline: Timeline | None = None

    def among(self, n_runs: int, places: Sequence[int]) -> "Sample":
        """The same sample on a page of more runs: its results stand in these places."""
        results: list[Result | None] = [None] * n_runs
        for place, result in zip(places, self.results, strict=True):
            results[place] = result
        return msgspec.structs.replace(self, results=tuple(results))


def outcome(record: Any, score: float) -> str:
    """How a unit came out.

    Args:
        record: of the unit.
        score: its score, where 1 is right.
    """
    if record.excluded is not None:
        return "left out"
    if record.failure is not None:
        return "failed"
    return "right" if score >= 1 else "partly" if score > 0 else "wrong"
