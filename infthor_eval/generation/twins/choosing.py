"""The balanced choice of paired questions from the drafts of many trajectories."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from infthor_eval.formats.twins import PairedQuestion, TwinPair

_MOST = 0.3  # of a set's pairs are of one kind, if there are enough kinds for that


@dataclass(frozen=True)
class ChosenQuestion:
    """A question of a pair of worlds."""

    pair: TwinPair
    question: PairedQuestion

    @property
    def fact(self) -> str:
        """Name of the fact, in the whole set."""
        return f"{self.pair.id}/{self.question.fact}"


def choose_pairs(
    trajectories: Sequence[Sequence[TwinPair]], per_trajectory: int
) -> list[ChosenQuestion]:
    """Choose paired questions, so that kinds, forms and facts are about as frequent as each other.

    Args:
        trajectories: the pairs of worlds of each trajectory.
        per_trajectory: most questions of one trajectory.
    """
    counts: Counter[tuple[str, str]] = Counter()
    remaining = [
        [ChosenQuestion(pair, question) for pair in pairs for question in pair.questions]
        for pairs in trajectories
    ]
    chosen: list[ChosenQuestion] = []
    # Round by round, so that no trajectory takes all of what is seldom.
    for _ in range(per_trajectory):
        for candidates in remaining:
            if candidates:
                best = min(candidates, key=lambda candidate: _use(counts, candidate))
                candidates.remove(best)
                chosen.append(best)
                counts.update(_keys(best))
    return _without_excess(chosen)


def _keys(candidate: ChosenQuestion) -> list[tuple[str, str]]:
    return [
        ("fact", candidate.fact),
        ("kind", candidate.pair.kind),
        ("form", candidate.question.form),
    ]


def _use(counts: Counter[tuple[str, str]], candidate: ChosenQuestion) -> tuple[int, int, str]:
    fact, kind, form = (counts[key] for key in _keys(candidate))
    return fact, kind + form, f"{candidate.pair.id}/{candidate.question.text}"


def _without_excess(chosen: Iterable[ChosenQuestion]) -> list[ChosenQuestion]:
    """Leave out the last of kinds that are too frequent."""
    kept = list(chosen)
    kinds = Counter(candidate.pair.kind for candidate in kept)
    while kept and len(kinds) * _MOST > 1:
        kind, count = max(kinds.items(), key=lambda item: (item[1], item[0]))
        if count <= _MOST * len(kept):
            break
        last = max(index for index, one in enumerate(kept) if one.pair.kind == kind)
        del kept[last]
        kinds[kind] -= 1
    return kept
