"""Random sampling of the small model's training sequences."""

import random
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.household.sequence_text import MARKS
from infthor_eval.plans.actors.habits import fill_action, open_action
from infthor_eval.plans.actors.script import read_plan, replace_objects
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.training.action_sequences import single_plans, windows
from infthor_eval.training.data import read_history, trajectory_names
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.nano.network import spellings
from infthor_eval.training.nano.question_sampler import QuestionSampler, question_intro
from infthor_eval.training.nano.settings import NanoRecipe

__all__ = ["SequenceSampler", "SyntheticPlans", "corpus_texts"]


def corpus_texts(folders: Sequence[Path], types: Sequence[str]) -> Iterator[str]:
    """Yield all texts of the sets, for training a tokenizer that has their words."""
    for object_type in types:
        yield from spellings(object_type)
        yield object_type
    for folder in folders:
        for path in sorted((folder / "metadata").glob("*/traj.txt")):
            text = path.read_text(encoding="utf-8").replace("<image>", " ")
            for mark in MARKS:
                text = text.replace(mark, "\n")
            yield from text.splitlines()
        for question in NiehSet(folder).questions:
            yield f" {question.text}"
            yield from (f"{space}{answer}" for answer in question.answers for space in ("", " "))
    yield from map(str, range(30))
    yield question_intro()


class SequenceSampler:
    """Random training sequences: questions, histories, and synthetic plans.

    Args:
        encoder: builds the sequences.
        folders: folders of replayed sets with questions.
        dataset: all frames of the sets.
        recipe: recipe of the training.

    Attributes:
        skipped: items that could not become a sequence.

    Raises:
        DataError: there are no questions, no histories or no plans.
    """

    def __init__(
        self,
        encoder: Encoder,
        folders: Sequence[Path],
        dataset: FrameDataset,
        recipe: NanoRecipe,
    ) -> None:
        self._encoder = encoder
        self._dataset = dataset
        self._limit = recipe.window_tokens
        self._words = recipe.words
        self._seed = recipe.seed
        self._rng = random.Random(recipe.seed)
        self._questions = QuestionSampler(
            encoder, folders, dataset, recipe.questions, recipe.window_tokens
        )
        self._windows: list[TrainingSequence] = []
        self._single_plans: list[TrainingSequence] = []
        self.skipped: list[SkippedSequence] = [*self._questions.skipped]
        recorded: list[tuple[str, list[str]]] = []
        for folder in folders:
            for segments in self._read_histories(NiehSet(folder)):
                for segment in segments:
                    recorded.append((segment.plan, [action for action, _ in segment.steps]))
        self._synthetic = SyntheticPlans(recorded)
        self._require_all_kinds(folders)

    def _require_all_kinds(self, folders: Sequence[Path]) -> None:
        kinds = {"question": self._questions, "history": self._windows, "plan": self._synthetic}
        for kind, pool in kinds.items():
            if not pool:
                where = ", ".join(map(str, folders))
                raise DataError(f"{where}: no {kind} to learn from; give another set")

    def _read_histories(self, data: NiehSet) -> Iterator[list[PlanSegment]]:
        """Read the histories of a set, skipping those that cannot be read."""
        for name in trajectory_names(data):
            try:
                _, segments = read_history(data, name, self._words)
                history_windows = [*windows(self._encoder, name, segments, self._limit)]
                plans = [*single_plans(self._encoder, name, segments)]
            except DataError as error:
                self.skipped.append(SkippedSequence(name, str(error)))
                continue
            self._windows += self._without_skipped(history_windows)
            self._single_plans += [plan for plan in plans if plan.n_tokens <= self._limit]
            yield segments

    def _without_skipped(
        self, encoded: Iterable[TrainingSequence | SkippedSequence]
    ) -> Iterator[TrainingSequence]:
        for sequence in encoded:
            if isinstance(sequence, TrainingSequence):
                yield sequence
            else:
                self.skipped.append(sequence)

    def begin_step(self, stage: str, number: int) -> None:
        """Let what is drawn from here on follow from the seed and the step alone."""
        self._rng = random.Random(f"{self._seed}/{stage}/{number}")

    def questions(self, progress: float) -> list[TrainingSequence]:
        """Return random questions with their answers; see `QuestionSampler.draw`."""
        return self._questions.draw(self._rng, progress)

    def histories(
        self, n_windows: int, n_plans: int, single_plan_share: float
    ) -> list[TrainingSequence]:
        """Return random histories with their actions: either windows or single plans.

        Args:
            n_windows: number of windows.
            n_plans: number of single plans.
            single_plan_share: probability of single plans.
        """
        is_single = self._rng.random() < single_plan_share
        pool, n = (self._single_plans, n_plans) if is_single else (self._windows, n_windows)
        return [self._rng.choice(pool) for _ in range(n)]

    def synthetic_plans(self, n: int) -> list[TrainingSequence]:
        """Return random synthetic plans with their actions, without frames."""
        return [
            self._encoder.text_plan("synthetic", *self._synthetic.sample(self._rng))
            for _ in range(n)
        ]

    def frames(self, n: int) -> list[int]:
        """Return the indices of random frames in the dataset."""
        return self._rng.sample(range(len(self._dataset)), min(n, len(self._dataset)))

    def spelling(self, n_spellings: int) -> int:
        """Return the index of a random spelling of names."""
        return self._rng.randrange(n_spellings)


class SyntheticPlans:
    """Plans and actions of experts, each object replaced by one of the same role in a similar plan.

    The words of a plan and the objects of its actions correspond, so a model learns which words
    name which objects.
    """

    def __init__(self, recorded: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Group recorded plans by kind, without those whose actions name no object of the plan."""
        kinds: dict[tuple[str, tuple[str, ...]], list[str]] = defaultdict(list)
        for plan, actions in recorded:
            templates = tuple(open_action(action, plan) for action in actions)
            if templates != tuple(actions):
                kinds[read_plan(plan)[0], templates].append(plan)
        self._kinds = [
            (templates, plans[0], [*zip(*(read_plan(plan)[1] for plan in plans), strict=True)])
            for (_, templates), plans in kinds.items()
        ]
        self._counts = [len(plans) for plans in kinds.values()]

    def __bool__(self) -> bool:
        """Return True if any plan can be sampled."""
        return bool(self._kinds)

    def sample(self, rng: random.Random) -> tuple[str, list[str]]:
        """Return a plan and its actions; kinds are as frequent as in the recorded plans."""
        ((templates, first, columns),) = rng.choices(self._kinds, self._counts)
        plan = replace_objects(first, [rng.choice(column) for column in columns])
        return plan, [fill_action(action, plan) for action in templates]
