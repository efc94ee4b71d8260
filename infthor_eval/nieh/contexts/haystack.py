"""The haystack: a window of a given size with the needle in it (published: `haystack`).

Every question is asked once per depth, and reported there. One needle lies at depth d of the window
of n frames when the window starts d_index * (n // 5) frames before it, d_index being the depth's
place in the published grid 0, .2, .4, .6, .8. So do two that follow each other, a put. Needles that
are apart have no depth: each time, other frames between and around them are drawn, from the run's
seed (the published code has none). Three and more that follow each other lie at the last depth
every time. As published, a window around several that follow each other may end one frame past the
trajectory, and then has one frame less.

A question without a needle (an absence) has no depth either: it is asked once, on a window drawn
from the trajectory.
"""

import random
from collections.abc import Sequence

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts.base import ContextSettings, QuestionVariant

_K_TOKENS = 1000  # the published kilo-token
_STEPS = 5  # depths of the published grid
_OUTSIDE = "the window reaches outside the trajectory"


def haystack(
    data: NiehSet, question: Question, settings: ContextSettings
) -> list[QuestionVariant | SkippedQuestion]:
    """Return a question on one window per depth."""
    n_all = len(data.frames_until(question))
    n = settings.n_frames(_K_TOKENS)
    if not question.has_evidence:
        return [_anywhere(question, n_all, n, settings.seed)]
    clues = tuple(sorted(set(data.clue_positions(question))))
    samples: list[QuestionVariant | SkippedQuestion] = []
    for depth in settings.depths:
        draw = random.Random(f"{settings.seed}/{question.draw_name}/{n}/{depth:g}")
        window = _window(clues, n_all, n, round(depth * _STEPS), draw)
        variant = f"depth={depth:g}"
        samples.append(
            SkippedQuestion(question, window, variant)
            if isinstance(window, str)
            else QuestionVariant(question, window, variant)
        )
    return samples


def _window(
    clues: tuple[int, ...], n_all: int, n: int, d_index: int, draw: random.Random
) -> tuple[int, ...] | str:
    """Return the positions of the frames, ascending, or the reason why there is no window."""
    if n < 1:
        return "no frame fits the window"
    if len(clues) == 1:
        return _around(clues[0], n_all, n, d_index, n_all)
    missing = n - len(clues)
    if missing < 0:
        return "the clues do not fit the window"
    if clues[-1] - clues[0] == len(clues) - 1:  # they follow each other
        # As published, the window of several clues may end one frame too late: it is shorter then.
        return _around(clues[0], n_all, n, d_index if len(clues) == 2 else _STEPS - 1, n_all + 1)
    pool = sampling_pool(clues, n_all, n)
    if missing > len(pool):
        return "there are not enough frames between and around the clues"
    return tuple(sorted({*clues, *draw.sample(pool, missing)}))


def _around(needle: int, n_all: int, n: int, d_index: int, last_end: int) -> tuple[int, ...] | str:
    start = needle - d_index * (n // _STEPS)
    if start < 0 or start + n > last_end:
        return _OUTSIDE
    return tuple(range(start, min(start + n, n_all)))


def sampling_pool(clues: Sequence[int], n_all: int, n: int) -> list[int]:
    """Return the frames from which a window around clues that are apart is drawn: those between.

    If these are too few, as many as are missing on either side too. As published, clues can be
    among these: a clue that is drawn takes no second place, and the window is shorter.
    """
    between = [position for position in range(clues[0] + 1, clues[-1]) if position not in clues]
    missing = n - len(clues)
    if len(between) >= missing:
        return between
    before = range(max(0, between[0] - missing), between[0])
    after = range(between[-1] + 1, min(between[-1] + missing + 1, n_all))
    return [*before, *between, *after]


def _anywhere(
    question: Question, n_all: int, n: int, seed: int
) -> QuestionVariant | SkippedQuestion:
    variant = "no needle"
    if n < 1 or n > n_all:
        return SkippedQuestion(question, _OUTSIDE, variant)
    start = random.Random(f"{seed}/{question.draw_name}/{n}").randrange(n_all - n + 1)
    return QuestionVariant(question, tuple(range(start, start + n)), variant)
