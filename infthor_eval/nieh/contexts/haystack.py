"""The haystack: a window of a given size with the needle at a given depth (published: `haystack`).

One needle lies at depth d of the window of n frames when the window starts d_index * (n // 5) frames before it, d_index
being the depth's place in the published grid 0, .2, .4, .6, .8. Several needles have no depth: the window is the
clues and frames sampled between them, then around them, in time order. The published code samples without a seed.
"""

import random

from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts.base import ContextSettings, Sample, clue_positions

__all__ = ["haystack"]

_K_TOKENS = 1000  # the published kilo-token
_STEPS = 5  # depths of the published grid


def haystack(data: NiehSet, question: Question, settings: ContextSettings) -> list[Sample | SkippedQuestion]:
    """The windows for one question: one per depth for one needle, a single one for several."""
    clues = clue_positions(data, question)
    n_all, n = len(data.frames(question.traj_id)), settings.n_frames(_K_TOKENS)
    if _is_one_needle(clues):
        return [_at_depth(question, clues, n_all, n, depth) for depth in settings.depths]
    return [_around_several(question, clues, n_all, n, random.Random(f"{settings.seed}/{question.id}/{n}"))]


def _is_one_needle(clues: tuple[int, ...]) -> bool:
    """One clue, or two with nothing between them."""
    return len(clues) == 1 or (len(clues) == 2 and clues[1] - clues[0] == 1)


def _at_depth(question: Question, clues: tuple[int, ...], n_all: int, n: int, depth: float) -> Sample | SkippedQuestion:
    variant = f"depth={depth:g}"
    if n < len(clues):
        return SkippedQuestion(question, "the clues do not fit the window", variant)
    start = clues[0] - round(depth * _STEPS) * (n // _STEPS)
    if start < 0 or start + n > n_all:
        return SkippedQuestion(question, "the window reaches outside the trajectory", variant)
    if clues[-1] >= start + n:
        return SkippedQuestion(question, "the second of two adjacent clues lies behind the window", variant)
    return Sample(question, tuple(range(start, start + n)), variant)


def _around_several(
    question: Question, clues: tuple[int, ...], n_all: int, n: int, draw: random.Random
) -> Sample | SkippedQuestion:
    if n < len(clues):
        return SkippedQuestion(question, "the clues do not fit the window")
    if n > n_all:
        return SkippedQuestion(question, "the window reaches outside the trajectory")
    between = [position for position in range(clues[0], clues[-1]) if position not in clues]
    around = [*range(clues[0]), *range(clues[-1] + 1, n_all)]
    missing = n - len(clues)
    chosen = draw.sample(between, min(missing, len(between)))
    chosen += draw.sample(around, missing - len(chosen))
    return Sample(question, tuple(sorted([*clues, *chosen])))
