"""Making the twins of many trajectories into one set; the same command resumes an interrupted run.

The draft of each trajectory is written when its worlds are complete, and is not made again. The
balanced choice of questions is made at the end, from all drafts, so it does not depend on the
workers.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Generic, TypeVar

import msgspec
from msgspec.structs import replace

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource
from infthor_eval.formats.twins import PairedQuestion, TwinPair, write_pairs
from infthor_eval.generation.replay_set import Selection, wrap_malformed
from infthor_eval.generation.simulator_jobs import (
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
)
from infthor_eval.generation.twins.drafting import Draft, TwinDraft, TwinSettings
from infthor_eval.generation.twins.final_tasks import (
    TRAJECTORIES,
    FinalTaskDraft,
    draft_final_tasks,
)
from infthor_eval.generation.twins.replays import MOST_MARKS
from infthor_eval.grouping import grouped
from infthor_eval.storage.files import file_name, is_written, write_atomically
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs

_PAIRS_A_PLACEBO = 4
_MOST = 0.3  # of a set's pairs are of one kind, if there are enough kinds for that
_QUESTIONS = "qa_set_twins.csv"
_DRAFTS = "drafts"  # folder in that of the set
_HINT = "remove it, or choose another --out"

# Makes the twins of a trajectory, given its hash, settings, and a simulator and the set's folder.
DraftTwins = Callable[..., TwinDraft]
_Item = tuple[TrajectorySource, Trajectory]
_Draft = TypeVar("_Draft", TwinDraft, FinalTaskDraft)


@dataclass(frozen=True)
class _ChosenQuestion:
    """A question of a pair of worlds, at each of its moments, in order."""

    pair: TwinPair
    rungs: tuple[PairedQuestion, ...]

    @classmethod
    def of_pair(cls, pair: TwinPair) -> "list[_ChosenQuestion]":
        """Return the questions of a pair of worlds; those on the same evidence are one."""
        ladders: dict[tuple[str, int | None], list[PairedQuestion]] = {}
        for question in pair.questions:
            ladders.setdefault((question.text, pair.evidence(question.moment)), []).append(question)
        return [cls(pair, tuple(rungs)) for rungs in ladders.values()]

    @property
    def question(self) -> PairedQuestion:
        """The question at its first moment."""
        return self.rungs[0]

    @property
    def fact(self) -> str:
        """Name of the fact, in the whole set."""
        return f"{self.pair.id}/{self.question.fact}"

    @property
    def ages(self) -> list[int]:
        """Number of frames since the evidence at each moment; none of a question at the end."""
        evidence = self.pair.evidence(self.question.moment) or 0
        return [it.moment - evidence for it in self.rungs if it.moment is not None]


class _EditNumbers(msgspec.Struct):
    """What every set of twins counts.

    Attributes:
        trajectories: number of trajectories that twins were made of.
        resumed: number of these of earlier runs.
        proposed: number of proposed edits by kind.
        kept: number of those that became twins, by kind.
        rejected: number of the others by reason.
    """

    trajectories: int
    resumed: int
    proposed: dict[str, int]
    kept: dict[str, int]
    rejected: dict[str, int]


class TwinSummary(_EditNumbers):
    """Numbers of a set of twins, as `--json` prints them.

    Attributes:
        found: number of paired questions before the choice.
        pairs: number of paired questions in the set.
        facts: number of facts that they are about.
        by_kind: paired questions in the set by kind of edit.
        by_form: paired questions in the set by form.
        by_age: paired questions in the set by the number of frames since their evidence, at
            moments.
        placebos: number of placebo pairs in the set, at all moments.
        failures: trajectories that twins cannot be made of, one line each.
        seconds: wall time of this run.
    """

    found: int
    pairs: int
    facts: int
    by_kind: dict[str, int]
    by_form: dict[str, int]
    by_age: dict[int, int]
    placebos: int
    failures: list[str]
    seconds: float


@dataclass(frozen=True)
class _DraftOutcome(Generic[_Draft]):
    """The outcome of one trajectory: its draft, or why there is none."""

    draft: _Draft | None = None
    is_resumed: bool = False
    failure: str = ""


def make_twins(
    selection: Selection,
    launch: Launch,
    out: Path,
    settings: TwinSettings,
    draft: DraftTwins,
    *,
    per_trajectory: int = 25,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> TwinSummary:
    """Make a set of twins.

    Args:
        selection: the trajectories.
        launch: simulator that each worker starts.
        out: folder of the set; created if it does not exist.
        settings: how twins are made.
        draft: makes the twins of a trajectory, such as `draft_twins`; pickled for workers.
        per_trajectory: most paired questions of one trajectory.
        worker_settings: number and place of the workers; they do not change the set.
        advance: called after each trajectory, with True if an earlier run made its draft.
        notify: called with messages about the workers.
    """
    started = time.monotonic()
    for name in ("metadata", _DRAFTS):
        (out / name).mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, launch.label, launch.frames)
    run_job = partial(_draft_item, out=out, settings=settings, form=TwinDraft, draft=draft)
    start = partial(SimulatorWorker, partial(Simulator, launch, max_copies=MOST_MARKS), run_job)
    items = selection.items

    def failed(number: int, error: InfthorError) -> _DraftOutcome[TwinDraft]:
        return _DraftOutcome[TwinDraft](failure=_failure_line(items[number], error))

    outcomes = collect_outcomes(run_jobs(start, items, worker_settings, notify), failed, advance)
    drafts = [outcome.draft for outcome in outcomes if outcome.draft is not None]
    _require_distinct(drafts)
    chosen = choose_pairs([draft.pairs for draft in drafts], per_trajectory)
    _write_set(out, chosen)
    failures = [failure.message for failure in selection.failures]
    failures += [outcome.failure for outcome in outcomes if outcome.failure]
    n_resumed = sum(outcome.is_resumed for outcome in outcomes)
    numbers = _Numbers(drafts, chosen)
    return numbers.summary(n_resumed, failures, round(time.monotonic() - started, 1))


def _require_distinct(drafts: Iterable[TwinDraft]) -> None:
    names = Counter(name for draft in drafts for pair in draft.pairs for name in pair.traj_ids)
    for name, count in names.most_common(1):
        if count > 1:
            raise DataError(f"{name}: two worlds have this name; choose another --seed and --out")


def _write_set(out: Path, chosen: Sequence[_ChosenQuestion]) -> None:
    """Write pairs and questions; both worlds' questions have the name of their pair."""
    in_order = sorted(chosen, key=lambda one: (one.pair.id, one.question.text, one.ages))
    by_pair = grouped((one.pair.id, one) for one in in_order)
    pairs: list[TwinPair] = []
    questions: list[Question] = []
    for group in by_pair.values():
        asked = [(one, rung) for one in group for rung in one.rungs]
        pairs.append(replace(group[0].pair, questions=tuple(rung for _, rung in asked)))
        for side in (0, 1):
            questions += [
                _question(one, rung, number, side) for number, (one, rung) in enumerate(asked, 1)
            ]
    write_pairs(out, pairs)
    write_questions(out / _QUESTIONS, questions)


def _question(chosen: _ChosenQuestion, paired: PairedQuestion, number: int, side: int) -> Question:
    return Question(
        chosen.pair.traj_ids[side],
        paired.text,
        paired.clues,
        paired.answers[side],
        paired.question_type,
        paired.absence[side],
        paired.moment,
        pair=f"{chosen.pair.id}/{number}",
        fact=chosen.fact,
    )


@dataclass(frozen=True)
class _Numbers:
    """Counts drafts, and what was chosen of them."""

    drafts: Sequence[TwinDraft]
    chosen: Sequence[_ChosenQuestion]

    def summary(self, n_resumed: int, failures: list[str], seconds: float) -> TwinSummary:
        """Return the numbers of the set."""
        proposed, kept, rejected = _count_edits(self.drafts)
        found = [_questions(draft.pairs, are_placebos=False) for draft in self.drafts]
        placebos = [len(one.rungs) for one in self.chosen if one.question.is_placebo]
        paired = [one for one in self.chosen if not one.question.is_placebo]
        return TwinSummary(
            trajectories=len(self.drafts),
            resumed=n_resumed,
            proposed=proposed,
            kept=kept,
            rejected=rejected,
            found=sum(map(len, found)),
            pairs=len(paired),
            facts=len({one.fact for one in paired}),
            by_kind=dict(Counter(one.pair.kind for one in paired).most_common()),
            by_form=dict(Counter(one.question.form for one in paired).most_common()),
            by_age=dict(sorted(Counter(age for one in paired for age in one.ages).items())),
            placebos=sum(placebos),
            failures=failures,
            seconds=seconds,
        )


def choose_pairs(
    trajectories: Sequence[Sequence[TwinPair]], per_trajectory: int
) -> list[_ChosenQuestion]:
    """Choose paired questions, so that kinds, forms, facts and numbers of rungs are about as
    frequent as each other, and a placebo for every four of them.

    Args:
        trajectories: the pairs of worlds of each trajectory.
        per_trajectory: most questions of one trajectory; at several moments, one counts once.
    """
    paired = [_questions(pairs, are_placebos=False) for pairs in trajectories]
    chosen = _without_excess(_in_rounds(paired, per_trajectory))
    placebos = [_questions(pairs, are_placebos=True) for pairs in trajectories]
    n_placebos = len(chosen) // _PAIRS_A_PLACEBO
    return [*chosen, *_in_rounds(placebos, per_trajectory)[:n_placebos]]


def _questions(pairs: Iterable[TwinPair], *, are_placebos: bool) -> list[_ChosenQuestion]:
    """Return the questions of some pairs of worlds, placebos or the others."""
    found = chain.from_iterable(map(_ChosenQuestion.of_pair, pairs))
    return [one for one in found if one.question.is_placebo == are_placebos]


def _in_rounds(
    trajectories: Sequence[list[_ChosenQuestion]], per_trajectory: int
) -> list[_ChosenQuestion]:
    """Choose from trajectories in turn, so that none takes all of what is seldom."""
    counts: Counter[tuple[str, str]] = Counter()
    chosen: list[_ChosenQuestion] = []
    for _ in range(per_trajectory):
        for candidates in trajectories:
            if candidates:
                best = min(candidates, key=lambda candidate: _use(counts, candidate))
                candidates.remove(best)
                chosen.append(best)
                counts.update(_keys(best))
    return chosen


def _keys(candidate: _ChosenQuestion) -> list[tuple[str, str]]:
    return [
        ("fact", candidate.fact),
        ("kind", candidate.pair.kind),
        ("form", candidate.question.form),
        ("reach", str(len(candidate.rungs))),
    ]


def _use(counts: Counter[tuple[str, str]], candidate: _ChosenQuestion) -> tuple[int, int, int, str]:
    """Return how much of what a candidate has was chosen; of equals, longer ladders come first."""
    fact, *others = (counts[key] for key in _keys(candidate))
    name = f"{candidate.pair.id}/{candidate.question.text}"
    return fact, sum(others), -len(candidate.rungs), name


def _without_excess(chosen: Iterable[_ChosenQuestion]) -> list[_ChosenQuestion]:
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


class FinalTaskSummary(_EditNumbers):
    """Numbers of a set of twins for agents, as `--json` prints them.

    Attributes:
        pairs: number of pairs.
        failures: trajectories that twins cannot be made of, one line each.
        seconds: wall time of this run.
    """

    pairs: int
    failures: list[str]
    seconds: float


def make_final_tasks(
    selection: Selection,
    launch: Launch,
    out: Path,
    settings: TwinSettings,
    *,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> FinalTaskSummary:
    """Make twins with final tasks; arguments and errors are those of `make_twins`."""
    started = time.monotonic()
    for name in (TRAJECTORIES, _DRAFTS):
        (out / name).mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, launch.label, launch.frames)
    run_job = partial(
        _draft_item, out=out, settings=settings, form=FinalTaskDraft, draft=draft_final_tasks
    )
    start = partial(SimulatorWorker, partial(Simulator, launch), run_job)
    items = selection.items

    def failed(number: int, error: InfthorError) -> _DraftOutcome[FinalTaskDraft]:
        return _DraftOutcome[FinalTaskDraft](failure=_failure_line(items[number], error))

    outcomes = collect_outcomes(run_jobs(start, items, worker_settings, notify), failed, advance)
    failures = [failure.message for failure in selection.failures]
    failures += [outcome.failure for outcome in outcomes if outcome.failure]
    drafts = [outcome.draft for outcome in outcomes if outcome.draft is not None]
    proposed, kept, rejected = _count_edits(drafts)
    return FinalTaskSummary(
        trajectories=len(drafts),
        resumed=sum(outcome.is_resumed for outcome in outcomes),
        proposed=proposed,
        kept=kept,
        rejected=rejected,
        pairs=sum(len(draft.worlds) for draft in drafts),
        failures=failures,
        seconds=round(time.monotonic() - started, 1),
    )


def _draft_item(
    item: _Item,
    simulator: Simulator,
    *,
    out: Path,
    settings: TwinSettings,
    form: type[_Draft],
    draft: Callable[..., _Draft],
) -> _DraftOutcome[_Draft]:
    """Return the draft of a trajectory: of an earlier run if it is the same, else made and written.

    Args:
        item: the trajectory.
        simulator: the simulator in which it is made.
        out: folder of the set.
        settings: how twins are made.
        form: type of the draft.
        draft: makes it.
    """
    source, trajectory = item
    # Not `.json`, so that the set may be read as a folder of trajectories.
    file = out / _DRAFTS / f"{file_name(trajectory.traj_id)}.draft"
    try:
        if is_written(file):
            return _DraftOutcome(_read(file, source.digest, settings, form), is_resumed=True)
        with freeze_existing_objects(), wrap_malformed():
            made = draft(trajectory, source.digest, settings, simulator=simulator, out=out)
        with write_atomically(file) as partial_file:
            partial_file.write_bytes(msgspec.json.encode(made) + b"\n")
    except InfthorError as error:
        return _DraftOutcome(failure=_failure_line(item, error))
    return _DraftOutcome(made)


def _failure_line(item: _Item, error: InfthorError) -> str:
    """Return why twins of a trajectory cannot be made, in one line."""
    source, trajectory = item
    return f"{source.place}: {trajectory.traj_id}: {error}"


def _count_edits(
    drafts: Iterable[Draft],
) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    """Return the numbers of edits proposed and kept by kind, and of those rejected by reason."""
    proposed = Counter[str]()
    kept = Counter[str]()
    reasons = Counter[str]()
    for draft in drafts:
        proposed.update(draft.proposed)
        kept.update(draft.proposed)
        for kind, rejected in draft.rejected.items():
            kept[kind] -= sum(rejected.values())
            reasons.update(rejected)
    return dict(sorted(proposed.items())), dict(sorted(kept.items())), dict(reasons.most_common())


def _read(file: Path, base: str, settings: TwinSettings, form: type[_Draft]) -> _Draft:
    """Return the draft of an earlier run, if it is of the same trajectory and settings."""
    draft = read_json(file, _HINT, form)
    if draft.digest != base:
        raise DataError(f"{file}: made of another trajectory of this name; {_HINT}")
    if draft.settings != settings:
        raise DataError(f"{file}: made with other kinds, seed or --per-kind; {_HINT}")
    return draft
