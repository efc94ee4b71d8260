"""The two scorers of NIEH answers.

`reference` equals the published scorer on every pair, faults included: its numbers are what the
paper reports. `strict` keeps its idea (normalise, compare, allow near misses and synonyms) and
fixes the faults:

* of several answers the score is F1, so that naming everything does not score: each gold answer and
  each answer of the response is matched at most once, and seven answers of which two are the two
  gold ones score 0.44, not 1. "mug, mug, mug" against [mug, plate] scores 0.4, not 1.5;
* "and" separates answers only as a whole word, so "hand towel" stays one answer;
* yes and no must be the first word said ("not sure", "none", "notebook" are not "no"; "yesterday"
  is not "yes"), and an answer that says both counts as neither;
* numbers must be equal: "100" is not nearly "10";
* a slice is its food: "lettuce slice", "sliced lettuce", "lettucesliced" and "lettuce" are one
  thing, in keys too.

To add or change a metric of NIEH: here and in `metric_list` of `tasks/nieh/_nieh.yaml` for all
tasks; for one alone, `process_results` and `metric_list` in its task file.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from difflib import SequenceMatcher
from functools import cache, lru_cache
from importlib import resources
from typing import Literal

import yaml
from word2number import w2n

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Answer
from infthor_eval.nieh.prompts import last_line

__all__ = [
    "NEAR",
    "SCORERS",
    "STRICT_RULES",
    "Scorer",
    "are_synonyms",
    "is_number",
    "matches_reference",
    "matches_strict",
    "normal_form",
    "pieces_of",
    "plain_form",
    "says_number",
    "says_yes_or_no",
    "score",
    "scores",
    "similarity",
    "split_published",
    "without_slice",
]

# Part of a run's identity: scores of other rules are another run's. 2: F1 of several answers;
# slices.
STRICT_RULES = "2"
Scorer = Literal["reference", "strict"]
SCORERS: tuple[Scorer, ...] = ("reference", "strict")
_KEPT = 2**13  # comparisons that are remembered: answers are few, and replies repeat them

NEAR = 80  # similarity in percent from which two normalised strings count as equal
_YES_NO = ("yes", "no")
_SLICE = re.compile(r"\b(?:slices?|sliced)\b(?: of\b)?|(?<=\w)sliced\b")


def score(response: str, answers: Sequence[Answer], scorer: Scorer = "reference") -> float:
    """Return how many gold answers a response gives, as a share or F1; 1.0 or 0.0 for a single one.

    Only the reference scorer can exceed 1.0, when one gold answer is repeated.

    Raises:
        UsageError: there is no such scorer, or no gold answer.
    """
    if scorer not in SCORERS:
        raise UsageError(f"unknown scorer {scorer!r}; use one of {', '.join(SCORERS)}")
    if not answers:
        raise UsageError("cannot score against an empty list of gold answers; give at least one")
    return (_reference if scorer == "reference" else _strict)(response, answers)


def scores(reply: str, answers: Sequence[Answer]) -> dict[str, float]:
    """Return the scores of a whole reply, of which the last line counts, under each scorer."""
    response = last_line(reply)
    return {scorer: score(response, answers, scorer) for scorer in SCORERS}


def says_yes_or_no(response: str) -> str | None:
    """Return "yes" or "no" as the strict scorer takes a response; None for neither or both."""
    return next((answer for answer in _YES_NO if matches_strict(response, answer)), None)


def says_number(response: str) -> bool:
    """Return True if both scorers read a response as a number."""
    return is_number(normal_form(response))


def pieces_of(response: str) -> list[str]:
    """Return the answers that a response enumerates, as the strict scorer separates them."""
    return [
        piece
        for piece in re.split(r"[,;\n]|\band\b", response, flags=re.IGNORECASE)
        if piece.strip()
    ]


def split_published(response: str) -> list[str]:
    """Return the answers that a response enumerates, as the published scorer separates them."""
    return [piece.replace("and", "").strip() for piece in response.split(",")]


def plain_form(text: str) -> str:
    """Return a text without marks and a leading "X is", as both scorers compare it."""
    bare = re.sub(r"[^\w\s]", "", text)
    return re.sub(r"^\s*\w+\s+is\s+", "", bare).strip()


def _reference(response: str, answers: Sequence[Answer]) -> float:
    if len(answers) == 1:
        return float(matches_reference(response, answers[0]))
    pieces = split_published(response)
    return sum(matches_reference(piece, gold) for gold in answers for piece in pieces) / len(
        answers
    )


def _strict(response: str, answers: Sequence[Answer]) -> float:
    if len(answers) == 1:
        return float(matches_strict(response, answers[0]))
    pieces = pieces_of(response)
    return 2 * _largest_matching(answers, pieces, matches_strict) / (len(answers) + len(pieces))


def _largest_matching(
    answers: Sequence[Answer], pieces: Sequence[str], match: Callable[[str, Answer], bool]
) -> int:
    """Return how many gold answers can have a piece each (augmenting paths; lists are short)."""
    fits = [[index for index, piece in enumerate(pieces) if match(piece, gold)] for gold in answers]
    owner: dict[int, int] = {}

    def assign(gold: int, tried: set[int]) -> bool:
        for piece in fits[gold]:
            if piece in tried:
                continue
            tried.add(piece)
            if piece not in owner or assign(owner[piece], tried):
                owner[piece] = gold
                return True
        return False

    return sum(assign(gold, set()) for gold in range(len(answers)))


def matches_reference(response: str, gold: Answer) -> bool:
    """Return whether a response, or a piece of it, is a gold answer to the published scorer."""
    answer = normal_form(response)
    wanted = normal_form(gold)
    if _near(answer, wanted) or are_synonyms(answer, wanted):
        return True
    if wanted == "yes" and "yes" in answer[:4]:
        return True
    return wanted == "no" and "no" in answer[:3]


def matches_strict(response: str, gold: Answer) -> bool:
    """Return whether a response, or a piece of it, is a gold answer to the strict scorer."""
    wanted = normal_form(gold)
    if wanted in _YES_NO:
        words = re.findall(r"\w+", response.lower())
        other = _YES_NO[wanted == "yes"]
        return words[:1] == [wanted] and other not in words
    if is_number(wanted):
        answer = normal_form(response)
        return is_number(answer) and float(answer) == float(wanted)
    answer = without_slice(plain_form(response.lower().strip()))
    wanted = without_slice(wanted)
    return _near(answer, wanted) or are_synonyms(answer, wanted)


def without_slice(text: str) -> str:
    """Return the food of a slice; another text, and one that is nothing but "slice", as it is."""
    return " ".join(_SLICE.sub(" ", text).split()) or text if _SLICE.search(text) else text


def is_number(text: str) -> bool:
    """Return whether a text in normal form is a number."""
    return re.fullmatch(r"-?\d+(\.\d+)?", text) is not None


@lru_cache(_KEPT, typed=True)
def normal_form(text: Answer) -> str:
    """Return the published normal form: a number in digits if there is one, else plain words."""
    if not isinstance(text, str):
        return str(text)
    text = text.lower().strip()
    try:
        return str(w2n.word_to_num(text))
    # The library's own ways to say "not a number" ("thousand one": IndexError).
    except (ValueError, IndexError):
        return plain_form(text)


def _near(answer: str, wanted: str) -> bool:
    if answer == wanted:
        return True
    if not answer or not wanted:
        return False
    return similarity(answer, wanted) >= NEAR


@lru_cache(_KEPT)
def similarity(one: str, other: str) -> int:
    """Return how alike two texts are, in percent."""
    return round(100 * SequenceMatcher(None, one, other).ratio())


def are_synonyms(answer: str, wanted: str) -> bool:
    """Return whether two texts in normal form are of one row of the published synonyms."""
    return any(
        (answer == word and wanted in phrases)
        or (wanted == word and answer in phrases)
        or (answer in phrases and wanted in phrases)
        for word, phrases in _rows_with().get(answer, ())
    )


@cache
def _rows_with() -> Mapping[str, Sequence[tuple[str, list[str]]]]:
    """Return the published rows, a word and its synonyms each, by every text in them."""
    table = resources.files(__package__).joinpath("synonyms.yaml").read_text(encoding="utf-8")
    rows: dict[str, list[tuple[str, list[str]]]] = {}
    for word, phrases in yaml.safe_load(table).items():
        for text in {word, *phrases}:
            rows.setdefault(text, []).append((word, phrases))
    return rows
