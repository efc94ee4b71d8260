"""The two scorers of NIEH answers.

`reference` equals the published scorer on every pair, faults included: its numbers are what the
paper reports. `strict` keeps its idea (normalise, compare, allow near misses and synonyms) and
fixes the faults:

* of several answers the score is F1, so that naming everything does not score: each gold answer and
  each answer of the response is matched at most once, and seven answers of which two are the two
  gold ones score 0.44, not 1. "mug, mug, mug" against [mug, plate] scores 0.4, not 1.5;
* "and" separates answers only as a whole word, so "hand towel" stays one answer, and other marks
  than a comma do, line ends too;
* yes and no must be the first word said ("not sure", "none", "notebook" are not "no"; "yesterday"
  is not "yes"), and an answer that says both counts as neither;
* numbers are read by `infthor_eval.nieh.numbers`, and must be equal: "100" is not nearly "10";
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
from itertools import takewhile
from typing import Literal

import yaml
from word2number import w2n

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Answer
from infthor_eval.nieh.numbers import number_in, number_of
from infthor_eval.nieh.prompts import last_line

# Part of a run's identity: scores of other rules are another run's. 2: F1 of several answers;
# slices. 3: numbers with marks and words around them; separators and lines of lists.
STRICT_RULES = "3"
Scorer = Literal["reference", "strict"]
SCORERS: tuple[Scorer, ...] = ("reference", "strict")
_KEPT = 2**13  # comparisons that are remembered: answers are few, and replies repeat them

NEAR = 80  # similarity in percent from which two normalised strings count as equal
_YES_NO = ("yes", "no")
_IS = re.compile(r"^\s*\w+\s+is\s+")
_BULLET = re.compile(r"^\s*(?:[-*+•·–—]|\(?\d{1,3}[.)])\s+")
# "Side table." is an answer, "It is there." a sentence.
_SENTENCE = re.compile(rf"(?:{_BULLET.pattern})?+(?:.*[:!?：！？。]|\S+\s+\S+\s.*\.)[*_\s]*")
_SEPARATOR = re.compile(r",(?!\d{3}(?!\d))|(?<!\d),|[;；，、/&\n]|\band\b", re.IGNORECASE)
_SLICE = re.compile(r"\b(?:slices?|sliced)\b(?: of\b)?|(?<=\w)sliced\b")


def score(response: str, answers: Sequence[Answer], scorer: Scorer = "reference") -> float:
    """Return how many gold answers a response gives, as a share or F1; 1.0 or 0.0 for a single one.

    The strict scorer takes whole replies, too, and rates what counts of them (`response_of`). Only
    the reference scorer can exceed 1.0, when one gold answer is repeated.

    Raises:
        UsageError: there is no such scorer, or no gold answer.
    """
    if scorer not in SCORERS:
        raise UsageError(f"unknown scorer {scorer!r}; use one of {', '.join(SCORERS)}")
    if not answers:
        raise UsageError("cannot score against an empty list of gold answers; give at least one")
    return (_reference if scorer == "reference" else _strict)(response, answers)


def scores(reply: str, answers: Sequence[Answer]) -> dict[str, float]:
    """Return the scores of a whole reply under each scorer; the last line counts to `reference`."""
    return {
        "reference": score(last_line(reply), answers, "reference"),
        "strict": score(reply, answers, "strict"),
    }


def response_of(reply: str, answers: Sequence[Answer]) -> str:
    """Return what of a reply counts to the strict scorer: the last line; where several answers are
    wanted, the lines before it too, up to one that is a sentence."""
    if len(answers) == 1:
        return last_line(reply)
    *before, last = [line for line in reply.splitlines() if line.strip()] or [""]
    listed = list(takewhile(lambda line: not _SENTENCE.fullmatch(line), reversed(before)))
    return "\n".join([*reversed(listed), last]).strip()


def says_yes_or_no(response: str) -> str | None:
    """Return "yes" or "no" as the strict scorer takes a response; None for neither or both."""
    return next((answer for answer in _YES_NO if matches_strict(response, answer)), None)


def pieces_of(response: str, answers: Sequence[Answer]) -> list[str]:
    """Return the answers that a response enumerates, as the strict scorer separates them: not
    within a gold answer, such as "salt and pepper"."""
    whole = "|".join(re.escape(text) for text in map(str, answers) if _SEPARATOR.search(text))
    apart = re.compile(rf"({whole or '(?!)'})|{_SEPARATOR.pattern}", re.IGNORECASE)
    pieces = apart.sub(lambda found: found[1] or "\n", response).split("\n")
    return [bare for piece in pieces if (bare := _BULLET.sub("", piece, 1)).strip()]


def split_published(response: str) -> list[str]:
    """Return the answers that a response enumerates, as the published scorer separates them."""
    return [piece.replace("and", "").strip() for piece in response.split(",")]


def plain_form(text: str) -> str:
    """Return a text as the strict scorer compares it: without a leading "X is" and marks but those
    between figures."""
    return _IS.sub("", re.sub(r"(?<!\d)[^\w\s]|[^\w\s](?!\d)", "", text)).strip()


def compared_form(reply: str, answers: Sequence[Answer]) -> str:
    """Return what a reply answers in a form in which equal answers are equal."""
    return plain_form(response_of(reply, answers)).casefold()


def _reference(response: str, answers: Sequence[Answer]) -> float:
    if len(answers) == 1:
        return float(matches_reference(response, answers[0]))
    pieces = split_published(response)
    return sum(matches_reference(piece, gold) for gold in answers for piece in pieces) / len(
        answers
    )


def _strict(reply: str, answers: Sequence[Answer]) -> float:
    response = response_of(reply, answers)
    if len(answers) == 1:
        return float(matches_strict(response, answers[0]))
    pieces = pieces_of(response, answers)
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
    wanted = strict_form(gold)
    if wanted in _YES_NO:
        words = re.findall(r"\w+", response.lower())
        other = _YES_NO[wanted == "yes"]
        return words[:1] == [wanted] and other not in words
    number = number_of(gold)
    if number is not None:
        return number_in(response) == number
    answer = strict_form(response)
    # As numbers, figures in a text are never nearly equal: "shelf 1" is not "shelf 2".
    figures = re.findall(r"\d+", wanted)
    if figures and figures != re.findall(r"\d+", answer):
        return False
    return _near(answer, wanted) or are_synonyms(answer, wanted)


@lru_cache(_KEPT, typed=True)
def strict_form(text: Answer) -> str:
    """Return a text as the strict scorer compares it where it is no number: a slice as its food,
    and one that is nothing but "slice" as it is."""
    plain = plain_form(str(text).lower().strip())
    return " ".join(_SLICE.sub(" ", plain).split()) or plain if _SLICE.search(plain) else plain


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
        return _IS.sub("", re.sub(r"[^\w\s]", "", text)).strip()


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
