"""Cross-validation folds: questions are held out with their trajectories."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from infthor_eval.nieh.contexts import QuestionVariant

Folds = Sequence[int]  # the fold of each sample
Fit = Callable[[frozenset[int]], Mapping[int, str]]
"""Learns on all samples but those of some folds, and guesses these, by their positions."""

_MOST = 6  # each fold, and each two, are guessed from the others


def held_out(
    samples: Sequence[QuestionVariant], scenes: Mapping[str, str] = MappingProxyType({})
) -> Callable[[QuestionVariant], str]:
    """Return what names the samples that one of some is held out with: those on its trajectory, or
    on all twins of it; on its scene, if scenes are given by trajectory; itself, if all are on one.
    """

    def group(sample: QuestionVariant) -> str:
        return scenes.get(sample.question.traj_id, sample.question.cluster)

    is_alone = len(set(map(group, samples))) == 1
    return (lambda sample: sample.question.draw_name) if is_alone else group


def folds_of(samples: Sequence[QuestionVariant], scenes: Mapping[str, str]) -> Folds:
    """Return the fold of each sample: what is held out together (`held_out`) is dealt by name."""
    groups = list(map(held_out(samples, scenes), samples))
    fold = {group: place % _MOST for place, group in enumerate(sorted(set(groups)))}
    return [fold[group] for group in groups]


def split(folds: Folds, out: frozenset[int]) -> tuple[list[int], list[int]]:
    """Return the positions of the samples that are not in some folds, and of those that are."""
    known: list[int] = []
    unknown: list[int] = []
    for position, fold in enumerate(folds):
        (unknown if fold in out else known).append(position)
    return known, unknown
