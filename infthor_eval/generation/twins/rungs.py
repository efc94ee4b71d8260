"""The moments at which twins are asked: at growing distances from their evidence.

Evidence is a frame that differs between the worlds: it shows what was changed. While no further one
follows, the same question can be asked again and again, and only its evidence is older each time.
"""

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, pairwise

from infthor_eval.formats.twins import ComparedFrame, PairedQuestion
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import Proposal

_MOST = 6  # ladders of a pair of worlds: those that reach farthest
_CONSIDERED = 50  # edits of a kind that are compared by how far their questions may reach
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


def farthest_first(
    proposals: Iterable[Proposal], episode: Episode, rungs: Sequence[int]
) -> list[Proposal]:
    """Return edits with those first whose objects the episode does not show for long.

    Of those that reach the same rung the kind's order stays.
    """
    considered = list(islice(proposals, _CONSIDERED))
    return sorted(considered, key=lambda edit: -bisect_left(rungs, _unseen(edit, episode.history)))


def _unseen(edit: Proposal, history: TrajectoryHistory) -> int:
    """Return the greatest number of frames between two that show objects of an edit, or after."""
    shown = [
        frame
        for frame in range(edit.index, len(history))
        if not edit.keys.isdisjoint(history.objects_in_frame(frame))
    ]
    return max((after - frame for frame, after in pairwise([*shown, len(history)])), default=0)


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
