"""Pairs of moments: the same words at two moments of one trajectory, with two answers.

They need no second world, so there are some on any trajectory with a log. But whoever knows the
words, both answers and both moments may guess: counts grow, and cupboards are opened early. So
pairs come by two, of the same words and answers: in one pair the one answer is right early and the
other late, in the second pair it is the other way round, at about the same two times. Who goes by
time has one pair right and the other exchanged.

Like twins, they are asked at rungs: so many frames after the newest evidence, at both moments.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, product
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import naming_inconsistency, trajectory_folders
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.recency import (
    Occurrence,
    logged_occurrences,
    occurrences,
    recent,
)
from infthor_eval.generation.twins.pairing import AskedWorld, ScoreReply
from infthor_eval.grouping import grouped
from infthor_eval.storage.digests import digest


@dataclass(frozen=True)
class Ladder:
    """A question on one evidence, asked at rungs.

    Attributes:
        candidate: the question, with its answers and clues.
        rungs: numbers of frames after the newest clue at which they hold.
    """

    candidate: Candidate
    rungs: frozenset[int]

    @property
    def evidence(self) -> int:
        """The newest frame of evidence."""
        return max(self.candidate.clues)

    @property
    def reply(self) -> str:
        """The answers, as a reply gives them."""
        return ", ".join(map(str, self.candidate.answers))


Couple = tuple[Ladder, Ladder]
"""The same words with two answers, in the order of time."""


@dataclass(frozen=True)
class Mirror:
    """Two pairs of the same words and answers, in which the answers come in two orders.

    Attributes:
        early: one of each pair.
        late: the others, with the same answers.
    """

    early: Couple
    late: Couple

    @property
    def pairs(self) -> tuple[Couple, Couple]:
        """Both pairs: the answer that is right early in one is right late in the other."""
        is_mirrored = self.late[0].reply != self.early[0].reply
        late = self.late if is_mirrored else self.late[::-1]
        return (self.early[0], late[0]), (self.early[1], late[1])

    @property
    def ladders(self) -> tuple[Ladder, ...]:
        """The four ladders."""
        return (*self.early, *self.late)

    @property
    def candidate(self) -> Candidate:
        """One of the four questions."""
        return self.early[0].candidate

    @property
    def rungs(self) -> list[int]:
        """The rungs that all four have, ascending."""
        return sorted(frozenset.intersection(*(ladder.rungs for ladder in self.ladders)))

    @property
    def width(self) -> int:
        """Number of frames by which the moments differ that should be one, early or late."""
        return max(_distance(self.early), _distance(self.late))

    @property
    def is_possible(self) -> bool:
        """True if there is a rung, and early and late are farther apart than either is wide."""
        return self.width < _distance((self.early[1], self.late[0])) and bool(self.rungs)

    @property
    def fact(self) -> str:
        """What it is about: both answers."""
        answers = sorted(ladder.reply for ladder in self.early)
        return f"{self.candidate.question_type.removesuffix('_further')}: {' or '.join(answers)}"


@dataclass
class MomentPairs:
    """The pairs on a set.

    Attributes:
        questions: both questions of each pair at each rung, by trajectory.
        trajectories: number of trajectories that could be read.
        skipped: trajectories that could not be read, one line each.
        by_form: number of pairs by form; at several rungs, one counts once.
        by_age: number of pairs by rung.
    """

    questions: list[Question] = field(default_factory=list)
    trajectories: int = 0
    skipped: list[str] = field(default_factory=list)
    by_form: Counter[str] = field(default_factory=Counter)
    by_age: Counter[int] = field(default_factory=Counter)

    def add(self, traj_id: str, mirror: Mirror, numbers: Sequence[int]) -> None:
        """Add two pairs of a trajectory, by the numbers of its frames."""
        for pair in mirror.pairs:
            # Says nothing of the order of the answers.
            name = digest(repr([(it.candidate.text, it.evidence) for it in pair]), 4)
            self.by_form[mirror.candidate.form] += 1
            self.by_age.update(mirror.rungs)
            for ladder, rung in product(pair, mirror.rungs):
                self.questions.append(
                    Question(
                        traj_id,
                        ladder.candidate.text,
                        tuple(numbers[clue] for clue in ladder.candidate.clues),
                        ladder.candidate.answers,
                        ladder.candidate.question_type,
                        moment=numbers[ladder.evidence + rung],
                        pair=f"{traj_id}/{name}/{rung}",
                        fact=f"{traj_id}/{mirror.fact}",
                    )
                )


def pair_moments(
    folder: Path,
    rungs: Sequence[int],
    per_trajectory: int,
    score: ScoreReply,
    trajectories: Path | None = None,
    advance: Callable[[], object] = lambda: None,
) -> MomentPairs:
    """Make pairs of moments on a set.

    Logs of our replays also say what frames show, and the solver confirms each question. Published
    logs name types alone, and what was done comes from the trajectories.

    Args:
        folder: the set, with `metadata/<traj_id>/metadata.json`.
        rungs: numbers of frames since the evidence, ascending.
        per_trajectory: maximum number of pairs on one trajectory; at several rungs, one counts
            once.
        score: the strict score of a reply.
        trajectories: folder of the trajectories, where they are not in the set.
        advance: called after each trajectory.
    """
    result = MomentPairs()
    data = NiehSet(folder, trajectories, needs_questions=False)
    for path in trajectory_folders(folder):
        try:
            with naming_inconsistency(path):
                numbers = data.frame_numbers(path.name)
                found = ladders(_read(data, path.name), rungs)
        except DataError as error:
            result.skipped.append(str(error))
        else:
            result.trajectories += 1
            for mirror in choose(list(mirrors(found, score)), per_trajectory // 2):
                result.add(path.name, mirror, numbers)
        advance()
    return result


@dataclass(frozen=True)
class KnownEvents:
    """What a log says.

    Attributes:
        events: what was put down and opened, in the order of time.
        n_frames: number of frames.
        solver: what confirms questions; None if the log does not say enough for it.
    """

    events: Sequence[Occurrence]
    n_frames: int
    solver: AskedWorld | None = None

    @classmethod
    def of_history(cls, history: TrajectoryHistory) -> "KnownEvents":
        """Return what the log of a replay says."""
        solver = AskedWorld(history, Checker(history.steps, history.share), frozenset(), seed=0)
        return cls(occurrences(history), len(history), solver)

    def asked_at(self, moment: int) -> Iterator[Candidate]:
        """Yield the questions that hold at a frame."""
        known = None if self.solver is None else self.solver.until(moment)
        for candidate in recent(event for event in self.events if event.frame <= moment):
            if known is None or known.gives(candidate, candidate.clues):
                yield candidate


def _read(data: NiehSet, traj_id: str) -> KnownEvents:
    steps = read_steps(data.folder(traj_id))
    if all(step.seen is not None for step in steps):
        return KnownEvents.of_history(TrajectoryHistory(traj_id, steps))
    outline = data.outline(traj_id)
    if outline is None:
        raise DataError(f"{data.folder(traj_id)}: {data.missing_outline}")
    logs = [step.object_log for step in steps]
    if not any(log.visible for log in logs):
        raise DataError(
            f"{data.folder(traj_id)}: the log does not say what the frames show; "
            "replay the trajectory"
        )
    events = logged_occurrences(outline, data.action_frames(traj_id), logs)
    return KnownEvents(list(events), len(logs))


def ladders(known: KnownEvents, rungs: Sequence[int]) -> list[Ladder]:
    """Return the questions on each evidence with the rungs at which they hold."""
    found: dict[Candidate, set[int]] = {}
    shown = sorted({event.frame for event in known.events if event.is_shown})
    for evidence, rung in product(shown, rungs):
        if evidence + rung < known.n_frames:
            for candidate in known.asked_at(evidence + rung):
                if max(candidate.clues) == evidence:
                    found.setdefault(candidate, set()).add(rung)
    return [Ladder(candidate, frozenset(those)) for candidate, those in found.items()]


def mirrors(found: Iterable[Ladder], score: ScoreReply) -> Iterator[Mirror]:
    """Yield all that could be chosen of a trajectory's ladders."""
    in_order = sorted(found, key=lambda ladder: ladder.evidence)
    for group in grouped((ladder.candidate.text, ladder) for ladder in in_order).values():
        couples = grouped(
            (frozenset((one.reply, other.reply)), (one, other))
            for one, other in combinations(group, 2)
            if _differ(one, other, score)
        )
        for those in couples.values():
            # Both in the order of time: the first of each couple is the earlier one.
            for early, late in combinations(those, 2):
                mirror = Mirror(early, late)
                if mirror.is_possible:
                    yield mirror


def choose(found: list[Mirror], most: int) -> list[Mirror]:
    """Choose mirrors of which none tells the answers of another, with forms in balance.

    Those that reach farthest come first; of these, those whose moments are closest to each other.
    """
    counts: Counter[str] = Counter()

    def rank(mirror: Mirror) -> tuple[object, ...]:
        form = mirror.candidate.form
        return -max(mirror.rungs), counts[form], mirror.width, _questions(mirror)

    chosen: list[Mirror] = []
    while found and len(chosen) < most:
        best = min(found, key=rank)
        chosen.append(best)
        counts[best.candidate.form] += 1
        found = list(filter(partial(_are_apart, best), found))
    return chosen


def _distance(couple: Couple) -> int:
    """Return the number of frames from the first evidence to the second; it may be negative."""
    return couple[1].evidence - couple[0].evidence


def _questions(mirror: Mirror) -> list[tuple[str, int]]:
    """Return what tells the four questions, in one trajectory."""
    return [(ladder.candidate.text, ladder.evidence) for ladder in mirror.ladders]


def _are_apart(one: Mirror, other: Mirror) -> bool:
    """Return True if two mirrors share no question, and no event unless the answers are the same.

    If the same thing is the cabinet or the fridge by one and the cabinet or the drawer by the
    other, it is the cabinet.
    """
    if one.fact != other.fact and not _events(one).isdisjoint(_events(other)):
        return False
    return set(_questions(one)).isdisjoint(_questions(other))


def _events(mirror: Mirror) -> set[tuple[str, int]]:
    """Return what tells the events that are asked about: of each, the first clues are."""
    return {(ladder.candidate.form, ladder.candidate.clues[0]) for ladder in mirror.ladders}


def _differ(first: Ladder, second: Ladder, score: ScoreReply) -> bool:
    """Return True if each answer is wrong at the other moment."""
    overlap = (
        score(first.reply, second.candidate.answers),
        score(second.reply, first.candidate.answers),
    )
    return max(overlap) < 1
