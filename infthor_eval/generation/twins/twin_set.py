"""Making the twins of many trajectories into one set; the same command resumes an interrupted run.

The draft of each trajectory is written when its worlds are complete, and is not made again. The
choice of questions is made at the end, from all drafts, so it does not depend on the workers.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
from msgspec.structs import replace

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.twins import TwinPair, write_pairs
from infthor_eval.generation.replay_set import Selection
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
)
from infthor_eval.generation.twins.choosing import ChosenQuestion, choose_pairs
from infthor_eval.generation.twins.draft_files import (
    DRAFTS,
    DraftOutcome,
    Item,
    count_edits,
    draft_item,
    failure_line,
)
from infthor_eval.generation.twins.drafting import TwinDraft, TwinSettings, draft_twins
from infthor_eval.generation.twins.pairing import ScoreReply
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs

_QUESTIONS = "qa_set_twins.csv"


class TwinSummary(msgspec.Struct):
    """Numbers of a set of twins, as `--json` prints them.

    Attributes:
        trajectories: number of trajectories that twins were made of.
        resumed: number of these of earlier runs.
        proposed: number of proposed edits by kind.
        kept: number of those that are twins, by kind.
        rejected: number of the others by reason.
        found: number of paired questions before the choice.
        pairs: number of paired questions in the set.
        facts: number of facts that they are about.
        by_kind: paired questions in the set by kind of edit.
        by_form: paired questions in the set by form.
        failures: trajectories that twins cannot be made of, one line each.
        seconds: wall time of this run.
    """

    trajectories: int
    resumed: int
    proposed: dict[str, int]
    kept: dict[str, int]
    rejected: dict[str, int]
    found: int
    pairs: int
    facts: int
    by_kind: dict[str, int]
    by_form: dict[str, int]
    failures: list[str]
    seconds: float


def make_twins(
    selection: Selection,
    launch: Launch,
    out: Path,
    settings: TwinSettings,
    score: ScoreReply,
    *,
    per_trajectory: int = 25,
    worker_settings: WorkerSettings,
    progress: Callable[[bool], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> TwinSummary:
    """Make a set of twins.

    Args:
        selection: the trajectories.
        launch: simulator that each worker starts.
        out: folder of the set; created if it does not exist.
        settings: how twins are made.
        score: returns the strict score of a reply for gold answers; pickled for workers.
        per_trajectory: most paired questions of one trajectory.
        worker_settings: number and place of the workers; they do not change the set.
        progress: called after each trajectory, with True if an earlier run made its draft.
        say: called with messages about the workers.

    Raises:
        DataError: the set is another simulator's, or two worlds have one name.
    """
    started = time.monotonic()
    for name in ("metadata", DRAFTS):
        (out / name).mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, launch.label)
    run_job = partial(_draft_one, out=out, settings=settings, score=score)
    start = partial(SimulatorWorker, partial(Simulator, launch), run_job)
    items = selection.items

    def failed(number: int, error: InfthorError) -> DraftOutcome[TwinDraft]:
        return DraftOutcome[TwinDraft](failure=failure_line(items[number], error))

    outcomes = collect_outcomes(run_jobs(start, items, worker_settings, say), failed, progress)
    drafts = [outcome.draft for outcome in outcomes if outcome.draft is not None]
    _require_distinct(drafts)
    chosen = choose_pairs([draft.pairs for draft in drafts], per_trajectory)
    _write_set(out, chosen)
    failures = [failure.message for failure in selection.failures]
    failures += [outcome.failure for outcome in outcomes if outcome.failure]
    n_resumed = sum(outcome.is_resumed for outcome in outcomes)
    numbers = _Numbers(drafts, chosen)
    return numbers.summary(n_resumed, failures, round(time.monotonic() - started, 1))


def _draft_one(
    item: Item, simulator: Simulator, out: Path, settings: TwinSettings, score: ScoreReply
) -> DraftOutcome[TwinDraft]:
    source, trajectory = item
    make = partial(draft_twins, trajectory, source.digest, settings, score, simulator, out)
    return draft_item(item, out, settings, TwinDraft, make)


def _require_distinct(drafts: Iterable[TwinDraft]) -> None:
    names = Counter(name for draft in drafts for pair in draft.pairs for name in pair.traj_ids)
    for name, count in names.most_common(1):
        if count > 1:
            raise DataError(f"{name}: two worlds have this name; choose another --seed and --out")


def _write_set(out: Path, chosen: Sequence[ChosenQuestion]) -> None:
    """Write pairs and questions; both worlds' questions have the name of their pair."""
    by_pair: dict[str, list[ChosenQuestion]] = {}
    for one in sorted(chosen, key=lambda one: (one.pair.id, one.question.text)):
        by_pair.setdefault(one.pair.id, []).append(one)
    pairs: list[TwinPair] = []
    questions: list[Question] = []
    for group in by_pair.values():
        pair = replace(group[0].pair, questions=tuple(one.question for one in group))
        pairs.append(pair)
        for side in (0, 1):
            questions += [_question(one, number, side) for number, one in enumerate(group, 1)]
    write_pairs(out, pairs)
    write_questions(out / _QUESTIONS, questions)


def _question(chosen: ChosenQuestion, number: int, side: int) -> Question:
    paired = chosen.question
    return Question(
        chosen.pair.traj_ids[side],
        paired.text,
        paired.clues,
        paired.answers[side],
        paired.question_type,
        paired.absence[side],
        pair=f"{chosen.pair.id}/{number}",
        fact=chosen.fact,
    )


@dataclass(frozen=True)
class _Numbers:
    """Counts drafts, and what was chosen of them."""

    drafts: Sequence[TwinDraft]
    chosen: Sequence[ChosenQuestion]

    def summary(self, n_resumed: int, failures: list[str], seconds: float) -> TwinSummary:
        """Return the numbers of the set."""
        proposed, kept, rejected = count_edits(self.drafts)
        found = (len(pair.questions) for draft in self.drafts for pair in draft.pairs)
        return TwinSummary(
            trajectories=len(self.drafts),
            resumed=n_resumed,
            proposed=proposed,
            kept=kept,
            rejected=rejected,
            found=sum(found),
            pairs=len(self.chosen),
            facts=len({one.fact for one in self.chosen}),
            by_kind=dict(Counter(one.pair.kind for one in self.chosen).most_common()),
            by_form=dict(Counter(one.question.form for one in self.chosen).most_common()),
            failures=failures,
            seconds=seconds,
        )
