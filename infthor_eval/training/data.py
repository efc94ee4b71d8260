"""What a recipe is trained on: the sequences of replayed sets, and what none could be made of."""

import random
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import Trajectory, iter_trajectories
from infthor_eval.nieh.samples import find_samples
from infthor_eval.plans.segments import PlanSegment
from infthor_eval.training.action_sequences import recorded_segments, windows
from infthor_eval.training.encoding import Encoder, SkippedItem, TrainingSequence
from infthor_eval.training.question_sequences import question_sequences
from infthor_eval.training.recipe import Recipe

__all__ = ["TrainingData", "action_sequences", "read_history", "read_training_data", "trajectory_names"]


@dataclass(frozen=True)
class TrainingData:
    """All sequences of a recipe.

    Attributes:
        sequences: in the order of the sets.
        left_out: what no sequence could be made of.
    """

    sequences: Sequence[TrainingSequence]
    left_out: Sequence[SkippedItem]

    @property
    def n_tokens(self) -> int:
        """Of all sequences, frames expanded."""
        return sum(sequence.n_tokens for sequence in self.sequences)

    @property
    def n_trained(self) -> int:
        """How many tokens loss is taken on."""
        return sum(sequence.n_trained for sequence in self.sequences)

    def reasons(self) -> Counter[str]:
        """How much was left out, by reason."""
        return Counter(item.reason for item in self.left_out)


def read_training_data(recipe: Recipe, encoder: Encoder, folders: Sequence[Path]) -> TrainingData:
    """The sequences that a recipe makes of replayed sets.

    A trajectory or question that cannot be used is left out and counted; the others are not hurt by it.

    Args:
        recipe: says which sequences.
        encoder: makes them.
        folders: of the sets, in the form of NIEH sets; a question file is needed where there are to be questions.

    Raises:
        UsageError: a setting of the contexts does not fit.
        DataError: a folder is no set, or nothing is left of all.
        ModelError: the model's template refuses what there is.
    """
    found = [item for folder in folders for item in _of_set(recipe, encoder, folder)]
    sequences = [item for item in found if isinstance(item, TrainingSequence)]
    left_out = [item for item in found if isinstance(item, SkippedItem)]
    if not sequences:
        why = left_out[0].reason if left_out else "there are no trajectories and no questions"
        raise DataError(f"{', '.join(map(str, folders))}: no sequence to train on ({why}); give another set")
    return TrainingData(sequences, left_out)


def _of_set(recipe: Recipe, encoder: Encoder, folder: Path) -> Iterator[TrainingSequence | SkippedItem]:
    if recipe.actions is not None:
        yield from _share(
            action_sequences(NiehSet(folder), encoder, recipe.max_tokens), recipe.actions.share, recipe.seed
        )
    if recipe.questions is not None:
        told = {"seed": recipe.seed} | recipe.questions.settings | {"data": str(folder)}
        for context in recipe.questions.contexts:
            made = question_sequences(encoder, find_samples({**told, "context": context}), recipe.max_tokens)
            yield from _share(made, recipe.questions.share, recipe.seed)


def action_sequences(data: NiehSet, encoder: Encoder, limit: int) -> Iterator[TrainingSequence | SkippedItem]:
    """The windows of every trajectory of a set.

    Args:
        data: the set; its trajectories are in it.
        encoder: makes the sequences.
        limit: tokens of a sequence, frames expanded.

    Yields:
        The sequences, and what none could be made of.
    """
    for name in trajectory_names(data):
        try:
            yield from windows(encoder, name, read_history(data, name)[1], limit)
        except DataError as error:
            yield SkippedItem(name, str(error))


def trajectory_names(data: NiehSet) -> list[str]:
    """Names of the trajectories of a set, those without a question too, sorted."""
    return sorted(path.name for path in (data.root / "metadata").iterdir() if path.is_dir())


def read_history(data: NiehSet, name: str) -> tuple[Trajectory, list[PlanSegment]]:
    """A trajectory of a set, and its true history.

    Args:
        data: the set.
        name: of the trajectory.

    Raises:
        DataError: it is not in the set, or its replay does not fit it.
    """
    path = data.outline_file(name)
    if path is None:
        raise DataError("its trajectory is not in the set")
    trajectory = next(iter(iter_trajectories(path)))
    steps = sorted(read_steps(data.folder(name)), key=lambda step: step.img_idx)
    return trajectory, recorded_segments(trajectory, steps, data.frames(name))


def _share(
    made: Iterable[TrainingSequence | SkippedItem], share: float, seed: int
) -> Iterator[TrainingSequence | SkippedItem]:
    """A part of the sequences, drawn by the seed; what was left out is told all the same."""
    draw = random.Random(seed)
    for item in made:
        if isinstance(item, SkippedItem) or share >= 1 or draw.random() < share:
            yield item
