"""Questions on a whole set: every rule is applied to every trajectory, and a balanced part of it is chosen.

The rules are those of Table 3; our further forms are asked where they are wanted, under question types of their own.
"""

import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, InfthorError, wrap_errors
from infthor_eval.formats.question import ABSENCE, Question, clue_column
from infthor_eval.formats.set_info import simulator_of
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions import (
    contents,
    counting,
    final_state,
    location,
    open_state,
    presence,
    put_action,
)
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.workers import WorkerSettings, shared_out

__all__ = ["GeneratedQuestions", "candidates_of", "further_candidates_of", "generate_questions"]


_ALONE = WorkerSettings()
# What a log that is JSON of the right form can still be wrong in.
_WRONG = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)


@dataclass
class GeneratedQuestions:
    """What came of it.

    Attributes:
        questions: in the order of trajectories, then of their first clue.
        trajectories: how many were read.
        skipped: those that could not be, one line each.
        unconfirmed: questions skipped because the checker did not agree with them.
    """

    questions: list[Question] = field(default_factory=list)
    trajectories: int = 0
    skipped: list[str] = field(default_factory=list)
    unconfirmed: list[Question] = field(default_factory=list)

    def by_type(self) -> dict[str, int]:
        """Number of questions by type."""
        return dict(sorted(Counter(item.question_type or "" for item in self.questions).items()))

    def by_clues(self) -> dict[str, int]:
        """Number of questions by number of clues: 1, 2, >=3, and of absences, which have none."""
        found = Counter(clue_column(item.n_clues) for item in self.questions)
        return {name: found[name] for name in ("1", "2", ">=3", ABSENCE)}

    def summary_text(self) -> str:
        """The counts by type and by number of clues, a line each, for people."""
        types = ", ".join(f"{name} {count}" for name, count in self.by_type().items())
        clues = ", ".join(f"{name}: {count}" for name, count in self.by_clues().items())
        return f"by type: {types}\nby number of clues: {clues}"


def generate_questions(
    folder: Path,
    *,
    seed: int = 0,
    per_trajectory: int = 25,
    share: float = DEFAULT_SHARE,
    further: bool = False,
    worker_settings: WorkerSettings = _ALONE,
    say: Callable[[str], None] = lambda _: None,
) -> GeneratedQuestions:
    """Make questions on a replayed set.

    Args:
        folder: the set, with `metadata/<traj_id>/metadata.json`.
        seed: makes every choice.
        per_trajectory: how many questions at most on one trajectory.
        share: of the frame's pixels that an object must fill to count as shown.
        further: whether to ask our further forms too.
        worker_settings: how many workers, and where; the questions are the same.
        say: is told what becomes of workers.

    Returns:
        The questions; trajectories whose log cannot be read are named in it.

    Raises:
        DataError: the set has no trajectory, or is of another version.
    """
    simulator_of(folder)
    made = GeneratedQuestions()
    types: dict[Path, frozenset[str]] = {}
    for path in _folders(folder):
        try:
            types[path] = _history(path, share).all_object_types
        except DataError as error:
            made.skipped.append(str(error))
    made.trajectories = len(types)
    vocabulary = frozenset[str]().union(*types.values())
    asking = [_Asking(path, vocabulary, seed, share, further) for path in types]
    found = _shared_out(asking, worker_settings, say, made)
    chooser = _Chooser()
    checking = []
    for path in [path for path in types if path in found]:  # one after the other: what was chosen before counts
        candidates, rng = found[path]
        chosen = chooser.choose(candidates, per_trajectory, rng)
        checking.append(_Checking(path, tuple(item.question(path.name) for item in chosen), share))
    sound = _shared_out(checking, worker_settings, say, made)
    for item in checking:
        for question, verdict in zip(item.questions, sound.get(item.path, ()), strict=False):
            (made.questions if verdict else made.unconfirmed).append(question)
    return made


@dataclass(frozen=True)
class _Asking:
    """Find all questions on a trajectory."""

    path: Path
    vocabulary: frozenset[str]
    seed: int
    share: float
    further: bool

    def do(self) -> tuple[list[Candidate], random.Random]:
        """The candidates, and what makes the further choices on this trajectory."""
        history = _history(self.path, self.share)
        rng = random.Random(f"{self.seed}/{history.traj_id}")
        candidates = candidates_of(history, self.vocabulary, rng)
        if self.further:
            candidates += further_candidates_of(history, rng)
        return candidates, rng


@dataclass(frozen=True)
class _Checking:
    """Check the questions that were chosen on a trajectory."""

    path: Path
    questions: tuple[Question, ...]
    share: float

    def do(self) -> list[bool]:
        """Whether the checker agrees with each."""
        checker = Checker(_history(self.path, self.share).steps, self.share)
        return [checker.verdict(question).sound for question in self.questions]


class _Asker:
    """Does either; see `infthor_eval.workers.Worker`."""

    greeting = None

    def __init__(self, number: int) -> None:
        """Nothing is needed."""

    def do(self, job: _Asking | _Checking) -> Iterator[Any]:
        yield job.do()

    def close(self) -> None:
        """Nothing is held."""


def _shared_out(
    jobs: Sequence[_Asking] | Sequence[_Checking],
    worker_settings: WorkerSettings,
    say: Callable[[str], None],
    made: GeneratedQuestions,
) -> dict[Path, Any]:
    """What came of the jobs, by trajectory; where worker after worker was lost at one, it is skipped."""
    found: dict[Path, Any] = {}
    for number, result in shared_out(_Asker, jobs, worker_settings, say):
        if isinstance(result, InfthorError):
            made.skipped.append(f"{jobs[number].path}: {result}")
        else:
            found[jobs[number].path] = result
    return found


def _history(path: Path, share: float) -> TrajectoryHistory:
    with wrap_errors(f"{path}: its log does not hang together", "replay the trajectory again", catch=_WRONG):
        return TrajectoryHistory(path.name, read_steps(path), share)


def _folders(folder: Path) -> list[Path]:
    metadata = folder / "metadata"
    found = sorted(path for path in metadata.glob("*/") if not path.name.startswith(".")) if metadata.is_dir() else []
    if not found:
        raise DataError(f"{metadata}: no trajectory there; replay some into this set first")
    return found


def candidates_of(history: TrajectoryHistory, vocabulary: frozenset[str], rng: random.Random) -> list[Candidate]:
    """All questions of Table 3's forms on one trajectory.

    Args:
        history: the trajectory.
        vocabulary: object types of the whole set, for what is asked about in vain.
        rng: samples the frames of absences.
    """
    return [
        *presence.present_types(history),
        *presence.absent_types(history, vocabulary, rng),
        *open_state.open_states(history),
        *location.locations(history),
        *contents.slicings(history),
        *contents.at_slicing(history),
        *contents.contents(history),
        *put_action.puts(history),
        *final_state.final_states(history),
        *counting.counts(history),
    ]


def further_candidates_of(history: TrajectoryHistory, rng: random.Random) -> list[Candidate]:
    """All questions of our further forms on one trajectory.

    Args:
        history: the trajectory.
        rng: samples the frames that counts are mixed with.
    """
    return [
        *open_state.further_open_states(history),
        *location.further_locations(history),
        *contents.at_opening(history),
        *contents.at_pickup(history),
        *put_action.further_puts(history),
        *counting.further_counts(history, rng),
    ]


class _Chooser:
    """Chooses so that types, forms, answers, numbers of clues and what is asked about are even over the whole set."""

    def __init__(self) -> None:
        self._types: Counter[str] = Counter()
        self._groups: Counter[str] = Counter()
        self._clues: Counter[int] = Counter()
        self._answers: Counter[tuple[str, str]] = Counter()
        self._subjects: Counter[tuple[str, str]] = Counter()

    def choose(self, candidates: Iterable[Candidate], number: int, rng: random.Random) -> list[Candidate]:
        left = list(candidates)
        rng.shuffle(left)
        chosen: list[Candidate] = []
        # Where little happened, presence questions must not fill the place of all others.
        room = Counter({_group(item): max(2, number // 5) for item in left})
        while len(chosen) < number:
            open_to = [item for item in left if room[_group(item)] and not self._gives_away(item)]
            if not open_to:
                break
            best = min(open_to, key=self._use)
            left.remove(best)
            room[_group(best)] -= 1
            chosen.append(best)
            self._note(best)
        return sorted(chosen, key=lambda item: (item.clues, item.text))

    def _gives_away(self, item: Candidate) -> bool:
        """Whether an answer would become the one to guess from the question's form alone."""
        if not item.is_closed:
            return False
        same = self._answers[item.form, str(item.answers[0])]
        others = sum(count for (form, _), count in self._answers.items() if form == item.form) - same
        return same > others

    def _note(self, item: Candidate) -> None:
        group = _group(item)
        self._types[item.question_type] += 1
        self._groups[group] += 1
        self._clues[_clue_class(item)] += 1
        self._subjects.update((group, subject) for subject in item.subjects)
        if item.is_closed:
            self._answers[item.form, str(item.answers[0])] += 1

    def _use(self, item: Candidate) -> tuple[int, int, int, int]:
        group = _group(item)
        subjects = sum(self._subjects[group, subject] for subject in item.subjects)
        return self._types[item.question_type], self._groups[group], self._clues[_clue_class(item)], subjects


def _group(item: Candidate) -> str:
    """What is to be even within a question type: yes, no, and the rest."""
    return f"{item.question_type} {item.answers[0]}" if item.answers[0] in {"yes", "no"} else item.question_type


def _clue_class(item: Candidate) -> int:
    """1, 2, or 3 for more."""
    return min(len(item.clues), 3)
