"""Who is guessed without whom: questions are held out with their trajectories, in a few folds."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from infthor_eval.nieh.contexts import Sample

__all__ = ["Fit", "Folds", "HoldOut", "folds_of", "guess_held_out", "held_out"]

Folds = Sequence[int]  # the fold of each sample
Fit = Callable[[frozenset[int]], Mapping[int, str]]
"""Learns on all samples but those of some folds, and guesses these, by their positions."""
HoldOut = Callable[[Sample], str]  # the name of what a sample is held out with

_MOST = 6  # each fold, and each two, are guessed from the others


def held_out(
    samples: Sequence[Sample], scenes: Mapping[str, str] = MappingProxyType({})
) -> HoldOut:
    """Return what a sample is left out with: its trajectory, or itself if there is one alone.

    Twins are left out with all twins of their trajectory.

    Args:
        samples: all samples that are guessed.
        scenes: scene by id of the trajectory, to leave out whole scenes.
    """

    def group(sample: Sample) -> str:
        return scenes.get(sample.question.traj_id, sample.question.cluster)

    is_alone = len(set(map(group, samples))) == 1
    return (lambda sample: sample.question.draw_name) if is_alone else group


def folds_of(samples: Sequence[Sample], hold_out: HoldOut) -> Folds:
    """Return the fold of each sample: what is held out together is dealt out by its name."""
    groups = list(map(hold_out, samples))
    fold = {group: place % _MOST for place, group in enumerate(sorted(set(groups)))}
    return [fold[group] for group in groups]


def guess_held_out(fit: Fit, folds: Folds) -> list[str]:
    """Return a guess for each sample, learned on the other folds; an empty text for none."""
    guesses: dict[int, str] = {}
    for fold in sorted(set(folds)):
        guesses |= fit(frozenset({fold}))
    return [guesses[position] for position in range(len(folds))]
