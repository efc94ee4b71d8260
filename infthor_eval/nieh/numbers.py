"""The numbers that answers say, as the strict scorer reads them: in figures or English words.

To add or change a spelling of a number: here, and the table in `tests/nieh/test_numbers.py`.
"""

import re
from decimal import Decimal
from functools import lru_cache

from infthor_eval.formats.question import Answer

__all__ = ["number_in", "number_of"]

_ONES = "one|two|three|four|five|six|seven|eight|nine"
_TEENS = "ten|eleven|twelve|thirteen|fourteen|fifteen|sixteen|seventeen|eighteen|nineteen"
_TENS = "twenty|thirty|forty|fifty|sixty|seventy|eighty|ninety"
_SCALES = {"dozen": 12, "thousand": 1_000, "million": 1_000_000}
_VALUES: dict[str, float] = {"once": 1, "twice": 2, "thrice": 3, "half": 0.5}
_VALUES |= {word: value for value, word in enumerate(f"zero|{_ONES}|{_TEENS}".split("|"))}
_VALUES |= {word: 10 * value for value, word in enumerate(_TENS.split("|"), 2)}

_START, _END = r"(?<![^\W_])", r"(?![^\W_])"  # of a word: an underscore is a mark
_SCALE = rf"(?:{'|'.join(_SCALES)}){_END}"
_UNDER_100 = rf"(?:(?:{_TENS})(?:[-\s]+(?:{_ONES}))?|{_TEENS}|{_ONES}){_END}"
_UNDER_1000 = rf"(?:(?:(?:an?|{_UNDER_100})\s+)?hundred{_END}(?:\s+(?:and\s+)?{_UNDER_100})?"
_UNDER_1000 += rf"|{_UNDER_100})"
_WORDS = rf"(?:(?:(?:half\s+)?an?|{_UNDER_1000})\s+)?{_SCALE}(?:,?\s+(?:and\s+)?{_UNDER_1000})?"
_WORDS += rf"|{_UNDER_1000}|(?:zero|none|nothing|never|nil|once|twice|thrice){_END}"
_FIGURES = r"(?:\d{1,3}(?!\d)(?:[,' \xa0\u202f]\d{3}(?!\d))*|\d+)(?:\.\d+)?(?:e[-+]?\d{1,3}(?!\d))?"
_FIGURES = rf"(?:{_FIGURES}|\.\d+)"
_NONE = (  # "no mugs" is 0; but what "no" and these say is no number
    r"not\s+(?:any|one|once|an?\s+single(?:\s+one)?)|no\s+(?!(?:idea|clue|doubt|answer|information"
    r"|evidence|number|problem|need|way|more|less|fewer|longer|i|it|they|there|we|you|this|that"
    rf"|the|an?){_END})[^\W\d_]+"
)
_PRONOUN = (  # "one" in the place of a noun
    rf"(?:(?:the|an?|another)\s+(?:(?!{_TENS}|hundred|and{_END})[^\W\d_]+\s+)?"
    r"|(?:this|that|which|every|each|any|some|no)[-\s]+)one"
)
# What makes something else of a number, before it and behind: a bound, an order, a share, a name.
_BEFORE = r"(?:not|at\s+(?:least|most)|(?:more|less|fewer|other|rather)\s+than|over|under|up\s+to)"
_BEHIND = (
    rf"(?:st|nd|rd|th|k){_END}|[^\W\d_]+\d\w*|\s*%|(?:\.\d+)+|-[^\W\d_]\w*|\+"
    rf"|\s+or\s+(?:more|less|fewer){_END}|(?:\s+and\s+an?)?[-\s]+(?:half|halves|quarters?|first"
    rf"|second|(?:third|fourth|fifth|sixth|seventh|eighth|ninth|tenth)s?){_END}"
)
_NUMBER = re.compile(
    rf"{_START}(?:{_PRONOUN}{_END}|(?P<none>{_NONE}){_END}|(?P<before>{_BEFORE}\s+)?"
    rf"(?P<minus>(?<!\w)-|(?:minus|negative)\s+)?(?<![^\W\d_]-)(?:(?P<figures>{_FIGURES})"
    rf"(?P<scale>\s+{_SCALE})?|(?P<words>{_WORDS}))(?P<behind>{_BEHIND})?)"
)
_ALONE = re.compile(rf"\W*{_NUMBER.pattern}(?:\s+[^\W\d_]+)?\W*")
_ALIKE = str.maketrans({"’": "'", "\u2010": "-", "\u2011": "-", "\u2212": "-"})


@lru_cache(2**13)
def number_in(text: str) -> Decimal | None:
    """Return the number that a reply says; None if it says none, or several that differ."""
    if any(letter.isnumeric() and not letter.isdecimal() for letter in text):
        return None  # "2½", "三": numerals that are not read
    values = {
        _value(said)
        for said in _NUMBER.finditer(_plain(text))
        if said["none"] or said["figures"] or said["words"]
        if not (said["before"] or said["behind"])
    }
    return values.pop() if len(values) == 1 else None


@lru_cache(2**13, typed=True)
def number_of(answer: Answer) -> Decimal | None:
    """Return the number that a gold answer is, with a noun at most ("3 mugs"); else None."""
    text = str(answer)
    return number_in(text) if _ALONE.fullmatch(_plain(text)) else None


def _plain(text: str) -> str:
    return text.casefold().translate(_ALIKE).replace("n't", " not")


def _value(said: re.Match[str]) -> Decimal:
    total, part = Decimal(0), Decimal(re.sub(r"[,'\s]", "", said["figures"] or "0"))
    for word in re.findall(r"[a-z]+", said["scale"] or said["words"] or ""):
        if word == "hundred":
            part = (part or Decimal(1)) * 100
        elif word in _SCALES:
            total += (part or 1) * _SCALES[word]
            part = Decimal(0)
        else:  # "a" and "and" are nothing
            part += Decimal(_VALUES.get(word, 0))
    return -(total + part) if said["minus"] else total + part
