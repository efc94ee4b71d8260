"""The numbers that answers say, as the strict scorer reads them: in figures or English words.

To add or change a spelling of a number: here, and the table in `tests/nieh/test_numbers.py`.
"""

import re
from decimal import Decimal
from functools import lru_cache

from word2number import w2n

from infthor_eval.formats.question import Answer

_START, _END = r"(?<![^\W_])", r"(?![^\W_])"  # of a word: an underscore is a mark
_VALUES = {"none": 0, "nothing": 0, "never": 0, "nil": 0, "once": 1, "twice": 2, "dozen": 12}
_VALUES |= {"half one dozen": 6, "one dozen": 12, "two dozen": 24, "hundred": 100, "thousand": 1000}
_NAMES = list(w2n.american_number_system)  # zero to nineteen, twenty to ninety, hundred, ...
_UNDER_20 = rf"(?:{'|'.join(_NAMES[1:20])}){_END}"
_TENS = rf"(?:{'|'.join(_NAMES[20:28])})"
_UNDER_100 = rf"(?:{_TENS}(?:[-\s]+(?:{'|'.join(_NAMES[1:10])}))?{_END}|{_UNDER_20})"
_GROUP = rf"(?:{_UNDER_20}\s+hundred{_END}(?:\s+(?:and\s+)?{_UNDER_100})?|{_UNDER_100})"
_WORDS = rf"(?:{'|'.join(_VALUES)}|zero){_END}"
_WORDS += rf"|{_GROUP}(?:\s+(?:thousand|million){_END}(?:,?\s+(?:and\s+)?{_GROUP})?)?"
_FIGURES = r"(?:\d{1,3}(?!\d)(?:[,' \xa0\u202f]\d{3}(?!\d))*|\d+)(?:\.\d+)?"
_FIGURES += r"(?:e[-+]?\d{1,3}(?!\d))?|\.\d+"
# "no mugs" is 0, "no idea" is not; "one" in the place of a noun ("the red one") is no number.
_NONE = r"not\s+(?:any|one|once|an?\s+single(?:\s+one)?)|no\s+(?!(?:idea|clue|doubt|answer|way"
_NONE += rf"|information|more|less|fewer|i|it|there|the|an?){_END})[^\W\d_]+"
_NOUN = r"(?:(?:this|that|which|every|each|any|some|no|the|an?|another)[-\s]+|(?:the|an?|another)"
_NOUN += rf"\s+(?!{_TENS}|hundred)[^\W\d_]+\s+)one"
# What makes another thing of a number: a bound or a "not" before it; an order, a share behind it.
_BEFORE = r"(?:not|at\s+(?:least|most)|(?:more|less|fewer|other|rather)\s+than|over|under|up\s+to)"
_BEHIND = rf"(?:st|nd|rd|th|k){_END}|[^\W\d_]+\d\w*|\s*%|(?:\.\d+)+|-[^\W\d_]\w*|\+|\s+or\s+(?:more"
_BEHIND += r"|less|fewer)|(?:\s+and\s+an?)?[-\s]+(?:hal(?:f|ves)|quarters?|first|second|(?:third|"
_BEHIND += rf"fourth|fifth|sixth|seventh|eighth|ninth|tenth)s?|dozen|hundred|million){_END}"
_NUMBER = re.compile(
    rf"{_START}(?:{_NOUN}{_END}|(?P<before>(?!{_NONE}){_BEFORE}\s+)?"
    rf"(?P<minus>(?<!\w)-|(?:minus|negative)\s+)?(?<![^\W\d_]-)(?P<number>(?:{_NONE}){_END}"
    rf"|(?P<figures>{_FIGURES})|(?P<words>{_WORDS}))(?P<behind>{_BEHIND})?)"
)
_ALIKE = str.maketrans("’\u2010\u2011\u2212", "'---")


@lru_cache(2**13)
def number_in(text: str) -> Decimal | None:
    """Return the number that a reply says; None if it says none, or several that differ."""
    if any(letter.isnumeric() and not letter.isdecimal() for letter in text):
        return None  # "2½", "三": numerals that are not read
    found = [said for said in _NUMBER.finditer(_plain(text)) if said["number"]]
    values = {_value(said) for said in found if not any(said.group("before", "behind"))}
    return values.pop() if len(values) == 1 else None


@lru_cache(2**13, typed=True)
def number_of(answer: Answer) -> Decimal | None:
    """Return the number that a gold answer is, with a noun at most ("3 mugs"); else None."""
    alone = re.fullmatch(rf"\W*{_NUMBER.pattern}(?:\s+[^\W\d_]+)?\W*", _plain(str(answer)))
    return number_in(str(answer)) if alone else None


def _plain(text: str) -> str:
    plain = text.casefold().translate(_ALIKE).replace("n't", " not")
    return re.sub(rf"{_START}an?(?=\s+(?:dozen|hundred|thousand|million){_END})", "one", plain)


def _value(said: re.Match[str]) -> Decimal:
    words = " ".join((said["words"] or "").replace(",", "").split())
    if words:
        number = Decimal(_VALUES[words] if words in _VALUES else w2n.word_to_num(words))
    else:
        number = Decimal(re.sub(r"[,'\s]", "", said["figures"] or "0"))  # "no mugs": 0
    return -number if said["minus"] else number
