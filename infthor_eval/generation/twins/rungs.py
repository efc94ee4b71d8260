"""The moments at which twins are asked: at growing distances from their evidence.

Evidence is a frame that differs between the worlds: it shows what was changed. While no further one
follows, the same question can be asked again and again, and only its evidence is older each time.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from infthor_eval.formats.twins import ComparedFrame, PairedQuestion
from infthor_eval.generation.twins.episode import Episode

_MOST = 3  # ladders of a pair of worlds: those that reach farthest
_SHORTEST = 100  # actions of a stretch


def stretches(episode: Episode) -> Iterator[Episode]:
    """Yield the episode, its first half, the half of that and so on, each to the end of a sub-goal.

    What is touched later is free in a stretch that ends before.
    """
    ends = {low.high_idx: at for at, low in enumerate(episode.trajectory.plan.low_actions, 1)}
    yield episode
    wanted = len(episode.trajectory.plan.low_actions) / 2
    while wanted >= _SHORTEST:
        ended = [high_idx for high_idx, end in ends.items() if end <= wanted]
        if ended:
            yield episode.until(max(ended) + 1)
        wanted /= 2


def ladders(frames: Sequence[ComparedFrame], rungs: Sequence[int]) -> list[list[int]]:
    """Return the moments of each ladder: so many frames after a differing one, before the next.

    Args:
        frames: how the frames of two worlds compare.
        rungs: numbers of frames since the evidence, ascending.
    """
    differing = [at for at, frame in enumerate(frames) if not frame.same]
    found = []
    for evidence, following in pairwise([*differing, len(frames)]):
        found.append([evidence + rung for rung in rungs if evidence + rung < following])
    reaching = sorted(found, key=lambda moments: (-len(moments), moments))
    return [moments for moments in reaching[:_MOST] if moments]


def that_stay(asked: Sequence[Sequence[PairedQuestion]]) -> Iterator[PairedQuestion]:
    """Yield the questions of a ladder whose answers are the same at each rung up to theirs.

    Args:
        asked: the questions at each of its moments, in order.
    """
    first = {question.text: question.answers for question in asked[0]}
    for questions in asked:
        staying = [one for one in questions if first.get(one.text) == one.answers]
        yield from staying
        first = {one.text: one.answers for one in staying}
