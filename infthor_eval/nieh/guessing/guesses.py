"""The best guess at each question of a set, by which runs are measured above guessing."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from types import MappingProxyType

import msgspec

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import NOT_JSON
from infthor_eval.nieh import numbers, scoring
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.guessing.chains import form_of, held_out
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge, NamedGuesser
from infthor_eval.nieh.records import Guess
from infthor_eval.nieh.scoring import SCORERS, score, scores
from infthor_eval.storage.digests import digest_of_files, fingerprint
from infthor_eval.storage.files import write_atomically
from infthor_eval.storage.folders import user_cache

__all__ = [
    "find_guesses",
    "questions_by_file",
    "sample_on_clues",
    "score_guesses",
    "visible_knowledge",
]

_Scores = Sequence[Mapping[str, float]]  # by scorer, of each question


def visible_knowledge(context: str) -> Knowledge:
    """Return what a model is told in a context of that name without looking at a frame.

    On the clue frames alone their number is in the request; elsewhere it says nothing of the
    question.
    """
    return Knowledge.WORDS | Knowledge.NUMBER if context == "clues" else Knowledge.WORDS


# Questions that are asked at once need the same guesses: one learns them, the others wait.
_LEARNING = Lock()


def find_guesses(data: NiehSet, knowledge: Knowledge) -> Mapping[str, Guess]:
    """Return by id of a question what can be guessed of it by guessers that know no more than that.

    Of each file and form the guesser with the highest mean counts, for each scorer of its own; so
    the guess is rather too good than too bad. They are kept in the user's cache, as learning takes
    seconds.
    """
    with _LEARNING:
        return _find_guesses(data, knowledge)


@lru_cache(maxsize=8)
def _find_guesses(data: NiehSet, knowledge: Knowledge) -> Mapping[str, Guess]:
    path = user_cache("guesses") / f"{_key(data, knowledge)}.json"
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Guess])
    except (OSError, *NOT_JSON):  # not there yet, or damaged
        guesses = _learn_guesses(data, knowledge)
    with suppress(OSError):  # a cache that cannot be written costs only time
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_atomically(path) as temporary:
            temporary.write_bytes(msgspec.json.encode(guesses))
    return guesses


def _key(data: NiehSet, knowledge: Knowledge) -> str:
    """Return a hash of all that guesses depend on: the questions, guessers, scorers and library."""
    guessers = sorted(Path(__file__).parent.glob("*.py"))
    code = digest_of_files([*guessers, Path(scoring.__file__), Path(numbers.__file__)])
    learner = {"knowledge": knowledge.value, "code": code, "library": version("scikit-learn")}
    return fingerprint(learner | {"questions": list(map(repr, data.questions))})


def _learn_guesses(data: NiehSet, knowledge: Knowledge) -> dict[str, Guess]:
    guesses: dict[str, Guess] = {}
    for questions in questions_by_file(data).values():
        samples = [sample_on_clues(question) for question in questions]
        by_guesser = []
        for guesser in GUESSERS:
            if guesser.knows in knowledge:
                replies = zip(guesser.guess(samples), questions, strict=True)
                by_guesser.append([scores(reply, question.answers) for reply, question in replies])
        guesses |= _best_by_form(questions, by_guesser)
    return guesses


def questions_by_file(data: NiehSet) -> dict[str, list[Question]]:
    """Return the questions that can be asked by file name (empty if the set has one file alone)."""
    by_file: dict[str, list[Question]] = {}
    for question in data.questions:
        by_file.setdefault(question.file, []).append(question)
    return by_file


def score_guesses(
    questions: Sequence[Question],
    guessers: Sequence[NamedGuesser] = GUESSERS,
    scenes: Mapping[str, str] = MappingProxyType({}),
) -> list[tuple[float, ...]]:
    """Return for each question of a file the guessers' strict scores, in their order.

    Args:
        questions: the questions.
        guessers: who guesses.
        scenes: scene by id of the trajectory, to guess without the question's whole scene.
    """
    samples = [sample_on_clues(question) for question in questions]
    hold_out = held_out(samples, scenes)
    by_guesser = [guesser.guess(samples, hold_out) for guesser in guessers]
    by_question = zip(*by_guesser, strict=True)
    rows = []
    for question, guesses in zip(questions, by_question, strict=True):
        rows.append(tuple(score(guess, question.answers, "strict") for guess in guesses))
    return rows


def sample_on_clues(question: Question) -> Sample:
    """Return the question on its clue frames, by their numbers in the file."""
    return Sample(question, tuple(sorted(question.clues)))


def _best_by_form(questions: Sequence[Question], by_guesser: Sequence[_Scores]) -> dict[str, Guess]:
    positions: dict[str, list[int]] = {}
    for position, question in enumerate(questions):
        positions.setdefault(form_of(question), []).append(position)
    guesses = {}
    for form, of_form in positions.items():
        best: dict[str, _Scores] = {
            scorer: _best(by_guesser, of_form, scorer) for scorer in SCORERS
        }
        means = {scorer: _mean(scored, of_form, scorer) for scorer, scored in best.items()}
        for position in of_form:
            own = {scorer: scored[position][scorer] for scorer, scored in best.items()}
            guesses[questions[position].id] = Guess(form=form, scores=own, form_scores=means)
    return guesses


def _best(by_guesser: Sequence[_Scores], positions: Sequence[int], scorer: str) -> _Scores:
    return max(by_guesser, key=lambda scored: _mean(scored, positions, scorer))


def _mean(scored: _Scores, positions: Sequence[int], scorer: str) -> float:
    return sum(scored[position][scorer] for position in positions) / len(positions)
