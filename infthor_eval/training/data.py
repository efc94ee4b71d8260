"""Training sequences of replayed sets; those for answering are NIEH questions as evaluated."""

import random
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import Trajectory, read_trajectory
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.samples import TaskSamples, find_samples
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.training.action_sequences import recorded_segments, windows
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence, within
from infthor_eval.training.final_sequences import goal_windows, memory_sequences
from infthor_eval.training.recipe import ActionData, Recipe


@dataclass(frozen=True)
class TrainingData:
    """All training data of a recipe.

    Attributes:
        sequences: sequences in the order of the sets.
        skipped: items that could not become a sequence.
    """

    sequences: Sequence[TrainingSequence]
    skipped: Sequence[SkippedSequence]

    @property
    def n_tokens(self) -> int:
        """Tokens of all sequences, frames expanded."""
        return sum(sequence.n_tokens for sequence in self.sequences)

    @property
    def n_loss_tokens(self) -> int:
        """Tokens with loss."""
        return sum(sequence.n_loss_tokens for sequence in self.sequences)

    def skip_reasons(self) -> Counter[str]:
        """Return the number of skipped items by reason."""
        return Counter(sequence.reason for sequence in self.skipped)


def read_training_data(recipe: Recipe, encoder: Encoder, folders: Sequence[Path]) -> TrainingData:
    """Build a recipe's sequences from replayed sets; what cannot be used is skipped.

    Args:
        recipe: recipe with the kinds of sequences.
        encoder: builds the sequences.
        folders: folders of the sets, in the form of NIEH sets; sequences of questions need a
            question file.
    """
    encoded = [sequence for folder in folders for sequence in _read_set(recipe, encoder, folder)]
    sequences = [sequence for sequence in encoded if isinstance(sequence, TrainingSequence)]
    skipped = [sequence for sequence in encoded if isinstance(sequence, SkippedSequence)]
    if not sequences:
        why = skipped[0].reason if skipped else "there are no trajectories and no questions"
        raise DataError(
            f"{', '.join(map(str, folders))}: no sequence to train on ({why}); give another set"
        )
    return TrainingData(sequences, skipped)


def _read_set(
    recipe: Recipe, encoder: Encoder, folder: Path
) -> Iterator[TrainingSequence | SkippedSequence]:
    if recipe.actions is not None:
        yield from _sample_share(
            _action_items(recipe, recipe.actions, encoder, NiehSet(folder, needs_questions=False)),
            recipe.actions.share,
            recipe.seed,
        )
    if recipe.questions is not None:
        settings = {"seed": recipe.seed} | recipe.questions.settings | {"data": str(folder)}
        for context in recipe.questions.contexts:
            samples = find_samples({**settings, "context": context})
            encoded = question_sequences(encoder, samples, recipe.max_tokens)
            yield from _sample_share(encoded, recipe.questions.share, recipe.seed)


def _action_items(
    recipe: Recipe, actions: ActionData, encoder: Encoder, data: NiehSet
) -> Iterator[TrainingSequence | SkippedSequence]:
    if actions.form == "plans":
        yield from action_sequences(data, encoder, recipe.max_tokens, recipe.words)
        return
    for name in trajectory_names(data):
        try:
            trajectory, segments = read_history(data, name, recipe.words)
            if actions.form == "goals":
                yield from goal_windows(encoder, name, segments, recipe.max_tokens)
            else:
                yield from memory_sequences(
                    encoder, data, trajectory, segments, actions.form, recipe.max_tokens
                )
        except DataError as error:
            yield SkippedSequence(name, str(error))


def action_sequences(
    data: NiehSet, encoder: Encoder, limit: int, words: Words
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Yield the windows of each trajectory of a set, and the items that became no sequence.

    The set has to contain the trajectories; `limit` is the most tokens of a sequence, frames
    expanded.
    """
    for name in trajectory_names(data):
        try:
            yield from windows(encoder, name, read_history(data, name, words)[1], limit)
        except DataError as error:
            yield SkippedSequence(name, str(error))


def trajectory_names(data: NiehSet) -> list[str]:
    """Return the names of all trajectories of a set, including those without questions, sorted."""
    return sorted(path.name for path in data.folder("").iterdir() if path.is_dir())


def read_history(data: NiehSet, name: str, words: Words) -> tuple[Trajectory, list[PlanSegment]]:
    """Return a trajectory of a set and its true history in these words."""
    path = data.outline_file(name)
    if path is None:
        raise DataError("its trajectory is not in the set")
    trajectory = read_trajectory(path)
    steps = sorted(read_steps(data.folder(name)), key=lambda step: step.img_idx)
    return trajectory, recorded_segments(trajectory, steps, data.frames(name), words)


def _sample_share(
    encoded: Iterable[TrainingSequence | SkippedSequence], share: float, seed: int
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Yield a random share of the sequences, and all skipped items."""
    rng = random.Random(seed)
    for sequence in encoded:
        if isinstance(sequence, SkippedSequence) or share >= 1 or rng.random() < share:
            yield sequence


def question_sequences(
    encoder: Encoder, task: TaskSamples, limit: int
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Yield a sequence for each sample of a task in a context, or a skipped item if unusable.

    Args:
        encoder: builds the sequences.
        task: the samples.
        limit: most tokens of a sequence, frames expanded; longer ones are skipped.
    """
    for skipped in task.skipped:
        yield SkippedSequence(_name(skipped.question.id, skipped.variant), skipped.reason)
    for sample in task.samples:
        name = _name(sample.question.id, sample.variant)
        try:
            sequence = _sequence(encoder, task, sample, name)
        except DataError as error:
            yield SkippedSequence(name, str(error))
            continue
        yield within(sequence, limit)


def _sequence(
    encoder: Encoder, task: TaskSamples, sample: QuestionVariant, name: str
) -> TrainingSequence:
    context, text = task.request(sample)
    if sample.awaits_recall:
        raise UsageError("training has no memory; use another context")
    # It has no video input.
    return encoder.answer(name, [*as_images(context), text], doc_target(sample.question))


def _name(question: str, variant: str) -> str:
    return f"{question} {variant}".rstrip()
