"""What `blind` says to each question of a set: what can be had without a frame."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from statistics import fmean
from threading import Lock
from types import MappingProxyType

import msgspec

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import NOT_JSON
from infthor_eval.grouping import grouped
from infthor_eval.nieh import numbers, scoring
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.guessing.chains import form_of
from infthor_eval.nieh.guessing.guessers import GUESSERS, Knowledge, NamedGuesser, blind_guesser
from infthor_eval.nieh.records import BlindGuess
from infthor_eval.nieh.scoring import score, scores
from infthor_eval.storage.digests import digest_of_files, fingerprint
from infthor_eval.storage.files import write_atomically
from infthor_eval.storage.folders import user_cache


def visible_knowledge(context: str) -> Knowledge:
    """Return what a model can know in a context of that name without looking at a frame.

    On the clue frames alone their number is in the request; elsewhere it says nothing of the
    question.
    """
    return Knowledge.WORDS | Knowledge.NUMBER if context == "clues" else Knowledge.WORDS


# Questions that are asked at once need the same guesses: one learns them, the others wait.
_LEARNING = Lock()


@lru_cache(maxsize=8)
def find_floor(data: NiehSet, knowledge: Knowledge) -> Mapping[str, BlindGuess]:
    """Return `find_blind`, by which runs are measured; nothing of a set of one trajectory, whose
    other questions alone say too little."""
    is_alone = len({question.cluster for question in data.questions}) < 2
    return {} if is_alone else find_blind(data, knowledge)


def find_blind(data: NiehSet, knowledge: Knowledge) -> Mapping[str, BlindGuess]:
    """Return by id of a question what `blind` says to it that knows no more than that.

    It is kept in the user's cache, as learning takes seconds.
    """
    with _LEARNING:
        return _find_blind(data, knowledge)


@lru_cache(maxsize=8)
def _find_blind(data: NiehSet, knowledge: Knowledge) -> Mapping[str, BlindGuess]:
    path = user_cache("blind") / f"{_key(data, knowledge)}.json"
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, BlindGuess])
    except (OSError, *NOT_JSON):  # not there yet, or damaged
        guesses = _learn(data, knowledge)
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


def _learn(data: NiehSet, knowledge: Knowledge) -> dict[str, BlindGuess]:
    guesses: dict[str, BlindGuess] = {}
    for questions in questions_by_file(data).values():
        replies = blind_guesser(knowledge).guess(list(map(sample_on_clues, questions)))
        scored = [scores(*it) for it in zip(replies, (it.answers for it in questions), strict=True)]
        by_form = grouped(zip(map(form_of, questions), scored, strict=True))
        means = {
            form: {name: fmean(it[name] for it in of_form) for name in of_form[0]}
            for form, of_form in by_form.items()
        }
        for question, reply, of_question in zip(questions, replies, scored, strict=True):
            form = form_of(question)
            guesses[question.id] = BlindGuess(
                form=form, reply=reply, scores=of_question, form_scores=means[form]
            )
    return guesses


def questions_by_file(data: NiehSet) -> dict[str, list[Question]]:
    """Return the questions that can be asked by file name (empty if the set has one file alone)."""
    return grouped((question.file, question) for question in data.questions)


def score_guesses(
    questions: Sequence[Question],
    guessers: Sequence[NamedGuesser] = GUESSERS,
    scenes: Mapping[str, str] = MappingProxyType({}),
) -> list[tuple[float, ...]]:
    """Return for each question of a file the guessers' strict scores, in their order; without its
    whole scene where scenes are given by trajectory."""
    samples = list(map(sample_on_clues, questions))
    by_question = zip(*(guesser.guess(samples, scenes) for guesser in guessers), strict=True)
    return [
        tuple(score(guess, question.answers, "strict") for guess in guesses)
        for question, guesses in zip(questions, by_question, strict=True)
    ]


def sample_on_clues(question: Question) -> QuestionVariant:
    """Return the question on its clue frames, by their numbers in the file."""
    return QuestionVariant(question, tuple(sorted(question.clues)))
