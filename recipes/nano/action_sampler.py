"""Random histories and plans to learn acting from."""

import random
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.household.sequence_text import action_part, plan_part
from infthor_eval.household.wording import compact_name
from infthor_eval.plans.actors.habits import fill_action, open_action
from infthor_eval.plans.actors.script import PLAN, read_plan
from infthor_eval.plans.history.segments import PlanSegment, restart_at, segment_parts
from infthor_eval.training.action_sequences import windows
from infthor_eval.training.data import read_history, trajectory_names
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence
from recipes.nano.settings import ActingSettings


class ActionSampler:
    """Random training sequences of actions: histories, and synthetic plans.

    Args:
        encoder: builds the sequences.
        folders: folders of replayed sets.
        settings: which of them a step has.
        words: words of plans and actions.

    Attributes:
        skipped: items that could not become a sequence.
    """

    def __init__(
        self, encoder: Encoder, folders: Sequence[Path], settings: ActingSettings, words: Words
    ) -> None:
        self._encoder = encoder
        self._settings = settings
        self._words = words
        self._windows: list[TrainingSequence] = []
        self._single_plans: list[TrainingSequence] = []
        self.skipped: list[SkippedSequence] = []
        recorded: list[tuple[str, list[str]]] = []
        for folder in folders:
            for segments in self._read_histories(NiehSet(folder)):
                for segment in segments:
                    recorded.append((segment.plan, [action for action, _ in segment.steps]))
        self._synthetic = SyntheticPlans(recorded)
        for kind, pool in {"history": self._windows, "plan": self._synthetic}.items():
            if not pool:
                where = ", ".join(map(str, folders))
                raise DataError(f"{where}: no {kind} to learn from; give another set")

    def _read_histories(self, data: NiehSet) -> Iterator[list[PlanSegment]]:
        """Read the histories of a set, skipping those that cannot be read."""
        for name in trajectory_names(data):
            try:
                _, segments = read_history(data, name, self._words)
                limit = self._settings.window_tokens
                history_windows = [*windows(self._encoder, name, segments, limit)]
                plans = [*single_plans(self._encoder, name, segments)]
            except DataError as error:
                self.skipped.append(SkippedSequence(name, str(error)))
                continue
            self._windows += self._without_skipped(history_windows)
            self._single_plans += [plan for plan in plans if plan.n_tokens <= limit]
            yield segments

    def _without_skipped(
        self, encoded: Iterable[TrainingSequence | SkippedSequence]
    ) -> Iterator[TrainingSequence]:
        for sequence in encoded:
            if isinstance(sequence, TrainingSequence):
                yield sequence
            else:
                self.skipped.append(sequence)

    def histories(self, rng: random.Random) -> list[TrainingSequence]:
        """Return random histories with their actions: either windows or single plans."""
        settings = self._settings
        is_single = rng.random() < settings.single_plan_share
        pool = self._single_plans if is_single else self._windows
        n = settings.plans_per_step if is_single else settings.windows_per_step
        return [rng.choice(pool) for _ in range(n)]

    def synthetic_plans(self, rng: random.Random) -> list[TrainingSequence]:
        """Return random synthetic plans with their actions, without frames."""
        sampled = [self._synthetic.sample(rng) for _ in range(self._settings.text_plans_per_step)]
        return [
            self._encoder.actions("synthetic", [plan_part(plan), *map(action_part, actions)])
            for plan, actions in sampled
        ]


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
        plan = _replace_objects(first, [rng.choice(column) for column in columns])
        return plan, [fill_action(action, plan) for action in templates]


def single_plans(
    encoder: Encoder, name: str, segments: Sequence[PlanSegment]
) -> Iterator[TrainingSequence]:
    """Cut a history into sequences of one plan each, with its goal and the frame it begins with."""
    for number, segment in enumerate(segments):
        if segment.steps:
            parts = segment_parts(restart_at(segments, number, number + 1))
            yield encoder.actions(f"{name}, plan {number + 1}", parts)


def _replace_objects(plan: str, types: Sequence[str]) -> str:
    """Return a plan of the usual form with other objects, in the order in which it names them."""
    match = PLAN.fullmatch(plan)
    assert match is not None
    # From the end, so that earlier spans stay valid.
    for group, name in reversed([*enumerate(types, start=2)]):
        start, end = match.span(group)
        word = compact_name(name) if match.group(group).islower() else name
        plan = plan[:start] + word + plan[end:]
    return plan
