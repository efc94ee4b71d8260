"""Generating questions on a set: all rules on all trajectories, then a balanced choice.

The rules are those of the paper's Table 3; our further forms are optional and have question types
of their own.
"""

import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from infthor_eval.errors import DataError, InfthorError, UsageError, wrap_errors
from infthor_eval.formats.packed.paths import SetPath, metadata_folder
from infthor_eval.formats.question import ABSENCE, Question
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
from infthor_eval.generation.questions.published_words import in_published_words
from infthor_eval.generation.questions.rooms import rooms_of
from infthor_eval.workers import WorkerSettings, run_jobs

_ONE_PROCESS = WorkerSettings()
_INCONSISTENT = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
_YES_NO = ("yes", "no")
_NEXT_NUMBERS = 6
_NEXT_ANSWERS = 10


@dataclass
class GeneratedQuestions:
    """The questions on a set.

    Attributes:
        questions: questions in the order of trajectories, then of their first clue.
        trajectories: number of trajectories that could be read.
        skipped: trajectories that could not be read, one line each.
        unconfirmed: questions that were left out because the checker does not confirm them.
    """

    questions: list[Question] = field(default_factory=list)
    trajectories: int = 0
    skipped: list[str] = field(default_factory=list)
    unconfirmed: list[Question] = field(default_factory=list)

    def by_type(self) -> dict[str, int]:
        """Return the number of questions by type."""
        counts = Counter(question.question_type or "" for question in self.questions)
        return dict(sorted(counts.items()))

    def by_clues(self) -> dict[str, int]:
        """Return the number of questions by number of clues (1, 2, >=3), and of absences."""
        counts = Counter(question.clue_column for question in self.questions)
        return {name: counts[name] for name in ("1", "2", ">=3", ABSENCE)}

    def summary_text(self) -> str:
        """Return the counts by type and by number of clues for people, one line each."""
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
    published_words: bool = False,
    by_subject: bool = True,
    moments: int = 0,
    worker_settings: WorkerSettings = _ONE_PROCESS,
    notify: Callable[[str], None] = lambda _: None,
    begin: Callable[[str, int], Callable[[], object]] = lambda *_: lambda: None,
) -> GeneratedQuestions:
    """Generate questions on a replayed set.

    Args:
        folder: the set, with `metadata/<traj_id>/metadata.json`.
        seed: seed of all random choices.
        per_trajectory: maximum number of questions on one trajectory, at each of its moments.
        share: share of the frame's pixels that an object must fill to count as shown.
        further: True to add our further forms, which have no published words.
        published_words: True for the same questions in the words of the published files.
        by_subject: True to balance the answers on each object in each kind of room, too; False
            leaves more questions, for training.
        moments: number of moments of each trajectory, evenly spaced up to its last frame, after
            which questions are asked; 0 to ask at the end alone.
        worker_settings: number and place of the workers; they do not change the questions.
        notify: called with messages about the workers.
        begin: called with the name of a part of the work and its number of trajectories; returns
            what is called after each.

    Returns:
        The questions, and the trajectories whose log cannot be read.
    """
    if further and published_words:
        raise UsageError(
            "--further adds forms that have no published words; leave it out, or --words published"
        )
    simulator_of(folder)  # raises for another format version
    result = GeneratedQuestions()
    types = _object_types(folder, share, result, begin)
    rooms = {path: rooms_of(names) for path, names in types.items()}
    vocabularies: dict[str, frozenset[str]] = {}
    for path, kind in rooms.items():
        vocabularies[kind] = vocabularies.get(kind, frozenset()) | types[path]
    rule_jobs = [
        _RuleJob(Asked(path, moment), vocabularies[rooms[path]], seed, share, further)
        for path in types
        for moment in (_moments(path, share, moments) if moments else (None,))
    ]
    advance = begin("questions found", len(rule_jobs))
    found = _share_out(rule_jobs, worker_settings, notify, advance, result)
    chooser = Chooser(by_subject=by_subject)
    check_jobs = []
    chosen: dict[Asked, list[Candidate]] = {}
    # Not shared out: the balance depends on what was chosen on all trajectories before.
    for asked, (candidates, rng) in found.items():
        chosen[asked] = chooser.choose(candidates, per_trajectory, rng, rooms[asked.path])
        questions = tuple(candidate.question(asked.path.name) for candidate in chosen[asked])
        check_jobs.append(_CheckJob(asked, questions, share))
    advance = begin("questions checked", len(check_jobs))
    soundness = _share_out(check_jobs, worker_settings, notify, advance, result)
    for job in check_jobs:
        # Checked in our words, which the checker reads.
        checked = zip(chosen[job.asked], soundness.get(job.asked, ()), strict=False)
        _sort_out(result, job.asked, checked, published_words=published_words)
    return result


def _moments(path: SetPath, share: float, n: int) -> list[int]:
    """Return the last frames of so many equal parts of a trajectory."""
    n_frames = len(_read_history(path, share))
    return sorted({max(0, n_frames * part // n - 1) for part in range(1, n + 1)})


def _sort_out(
    result: GeneratedQuestions,
    asked: "Asked",
    checked: Iterable[tuple[Candidate, bool]],
    *,
    published_words: bool,
) -> None:
    """Add candidates on a trajectory to a result, by whether their answers were confirmed."""
    traj_id = asked.path.name
    for candidate, is_sound in checked:
        question = candidate.question(traj_id)
        if published_words:
            question = in_published_words(candidate, traj_id)
        question = replace(question, moment=asked.moment)
        (result.questions if is_sound else result.unconfirmed).append(question)


def _object_types(
    folder: Path,
    share: float,
    result: GeneratedQuestions,
    begin: Callable[[str, int], Callable[[], object]],
) -> dict[SetPath, frozenset[str]]:
    """Return the object types of each trajectory; those that cannot be read are skipped."""
    types: dict[SetPath, frozenset[str]] = {}
    folders = trajectory_folders(folder)
    advance = begin("trajectories read", len(folders))
    for path in folders:
        advance()
        try:
            types[path] = _read_history(path, share).all_object_types
        except DataError as error:
            result.skipped.append(str(error))
    result.trajectories = len(types)
    return types


class Asked(NamedTuple):
    """A trajectory's folder, and the frame after which it is asked about; None for the end."""

    path: SetPath
    moment: int | None = None

    def history(self, share: float) -> TrajectoryHistory:
        """Return what has happened by then."""
        return _read_history(self.path, share, self.moment)


@dataclass(frozen=True)
class _RuleJob:
    """Applies all rules to a trajectory."""

    asked: Asked
    vocabulary: frozenset[str]
    seed: int
    share: float
    further: bool

    def run(self) -> tuple[list[Candidate], random.Random]:
        """Return the candidates, and the random stream for the later choices on this trajectory."""
        history = self.asked.history(self.share)
        # A stream per trajectory, so that its questions do not depend on the order of the jobs.
        moment = "" if self.asked.moment is None else f"/{self.asked.moment}"
        rng = random.Random(f"{self.seed}/{history.traj_id}{moment}")
        candidates = candidates_of(history, self.vocabulary, rng)
        if self.further:
            candidates += further_candidates_of(history, rng)
        return candidates, rng


@dataclass(frozen=True)
class _CheckJob:
    """Checks the chosen questions on a trajectory."""

    asked: Asked
    questions: tuple[Question, ...]
    share: float

    def run(self) -> list[bool]:
        """Return True for each sound question."""
        checker = Checker(self.asked.history(self.share).steps, self.share)
        return [checker.verdict(question).sound for question in self.questions]


class _QuestionWorker:
    """A worker for both kinds of jobs; see `infthor_eval.workers.Worker`."""

    greeting = None

    def __init__(self, number: int) -> None:
        pass

    def do(self, job: _RuleJob | _CheckJob) -> Iterator[Any]:
        try:
            with naming_inconsistency(job.asked.path):
                result: Any = job.run()
        except DataError as error:  # of this trajectory alone
            yield error
        else:
            yield result

    def close(self) -> None:
        pass


def _share_out(
    jobs: Sequence[_RuleJob] | Sequence[_CheckJob],
    worker_settings: WorkerSettings,
    notify: Callable[[str], None],
    advance: Callable[[], object],
    result: GeneratedQuestions,
) -> dict[Asked, Any]:
    """Return the results by what they are of; one at which several workers were lost is skipped."""
    results: dict[int, Any] = {}
    for number, outcome in run_jobs(_QuestionWorker, jobs, worker_settings, notify):
        advance()
        if isinstance(outcome, InfthorError):
            place = "" if isinstance(outcome, DataError) else f"{jobs[number].asked.path}: "
            result.skipped.append(f"{place}{outcome}")
        else:
            results[number] = outcome
    return {jobs[number].asked: results[number] for number in sorted(results)}


def _read_history(path: SetPath, share: float, moment: int | None = None) -> TrajectoryHistory:
    with naming_inconsistency(path):
        steps = read_steps(path)
        return TrajectoryHistory(path.name, steps if moment is None else steps[: moment + 1], share)


def naming_inconsistency(path: SetPath) -> AbstractContextManager[None]:
    """Turn errors of a log that has the documented form but inconsistent content into ours."""
    return wrap_errors(
        f"{path}: its log is inconsistent", "replay the trajectory again", catch=_INCONSISTENT
    )


def trajectory_folders(folder: Path) -> list[SetPath]:
    """Return the folders of a set's trajectories, sorted; none is an error."""
    metadata = metadata_folder(folder)
    paths: list[SetPath] = [*metadata.iterdir()] if metadata.is_dir() else []
    folders = [path for path in paths if path.is_dir() and not path.name.startswith(".")]
    folders.sort(key=lambda path: path.name)
    if not folders:
        raise DataError(f"{metadata}: has no trajectory; replay some into this set first")
    return folders


def candidates_of(
    history: TrajectoryHistory, vocabulary: frozenset[str], rng: random.Random
) -> list[Candidate]:
    """Return all questions of Table 3's forms on one trajectory.

    Absence questions use the object types of the set's rooms of the same kind, `vocabulary`, and
    random frames.
    """
    return [
        *presence.yes_questions(history),
        *presence.no_questions(history, vocabulary, rng),
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
    """Return all questions of our further forms on one trajectory; counts get random frames."""
    return [
        *open_state.further_open_states(history),
        *location.further_locations(history),
        *contents.at_opening(history),
        *contents.at_pickup(history),
        *put_action.further_puts(history),
        *counting.further_counts(history, rng),
    ]


class Chooser:
    """Chooses questions with balanced types, forms, answers, numbers of clues and subjects.

    So their words do not give the answers away. No answer to a form is more frequent than the next
    ones: than the next for yes and no, than the mean of the next six for numbers, of the next ten
    for other answers. Answers of a list count one by one. The same holds for the answers on each
    object in each kind of room, as "the fridge was open" or "there is a sofa" would hold in most
    kitchens and living rooms, whatever the form.
    """

    def __init__(self, *, by_subject: bool = True) -> None:
        """Start a set.

        Args:
            by_subject: False for more questions: no answer yes, no or number is more frequent than
                all others to its form together, and that is all.
        """
        self._by_subject = by_subject
        self._types: Counter[str] = Counter()
        self._groups: Counter[str] = Counter()
        self._clues: Counter[int] = Counter()
        self._answers: dict[tuple[str, ...], Counter[str]] = {}
        self._subjects: Counter[tuple[str, str]] = Counter()

    def choose(
        self, candidates: Iterable[Candidate], number: int, rng: random.Random, rooms: str
    ) -> list[Candidate]:
        """Choose up to a number of questions on one trajectory in rooms of some kinds."""
        remaining = list(candidates)
        rng.shuffle(remaining)  # ties are broken by this order
        chosen: list[Candidate] = []
        # A limit per group: presence questions, which are always possible, must not fill up quiet
        # trajectories.
        limits = Counter({_group(candidate): max(2, number // 5) for candidate in remaining})
        while len(chosen) < number:
            eligible = [
                candidate
                for candidate in remaining
                if limits[_group(candidate)] and not self._is_unbalanced(candidate, rooms)
            ]
            if not eligible:
                break
            best = min(eligible, key=self._use)
            remaining.remove(best)
            limits[_group(best)] -= 1
            chosen.append(best)
            self._count(best, rooms)
        return sorted(chosen, key=lambda candidate: (candidate.clues, candidate.text))

    def _is_unbalanced(self, candidate: Candidate, rooms: str) -> bool:
        """Return True if the answer already leads the next ones, to the form or on a subject."""
        if not self._by_subject and not candidate.is_closed:
            return False
        return any(
            self._leads(self._answers.get(key, Counter()), candidate, answer)
            for key in self._keys(candidate, rooms)
            for answer in _answers(candidate)
        )

    def _leads(self, answers: Counter[str], candidate: Candidate, answer: str) -> bool:
        """Return True if an answer is more frequent than the mean of the next ones."""
        counts = (count for other, count in answers.items() if other != answer)
        others = sorted(counts, reverse=True)
        if not self._by_subject:
            return answers[answer] > sum(others)
        n_next = 1 if answer in _YES_NO else _NEXT_NUMBERS if candidate.is_closed else _NEXT_ANSWERS
        return n_next * answers[answer] > sum(others[:n_next])

    def _keys(self, candidate: Candidate, rooms: str) -> list[tuple[str, ...]]:
        """Return what the answer is counted by."""
        if not self._by_subject:
            return [(candidate.form,)]
        answers = {str(answer).replace(" ", "").lower() for answer in candidate.answers}
        subjects = [subject for subject in candidate.subjects if subject.lower() not in answers]
        return [
            (candidate.form,),
            *((candidate.question_type, rooms, subject) for subject in subjects),
        ]

    def _count(self, candidate: Candidate, rooms: str) -> None:
        group = _group(candidate)
        self._types[candidate.question_type] += 1
        self._groups[group] += 1
        self._clues[_clue_class(candidate)] += 1
        self._subjects.update((group, subject) for subject in candidate.subjects)
        for key in self._keys(candidate, rooms):
            self._answers.setdefault(key, Counter()).update(_answers(candidate))

    def _use(self, candidate: Candidate) -> tuple[int, int, int, int]:
        group = _group(candidate)
        subjects = sum(self._subjects[group, subject] for subject in candidate.subjects)
        return (
            self._types[candidate.question_type],
            self._groups[group],
            self._clues[_clue_class(candidate)],
            subjects,
        )


def _answers(candidate: Candidate) -> set[str]:
    """Return the answers of a list one by one: each that is guessed has its share of the score."""
    return set(map(str, candidate.answers))


def _group(candidate: Candidate) -> str:
    """Return the group that is balanced within a question type: yes, no, or other answers."""
    answer = candidate.answers[0]
    kind = candidate.question_type
    return f"{kind} {answer}" if answer in _YES_NO else kind


def _clue_class(candidate: Candidate) -> int:
    return min(len(candidate.clues), 3)
