"""The replies of which the rules are unsure: neither right nor plainly wrong.

The rules read words: they can tell that "Sofa" is not the SideTable, but not whether "the small
table" is. A reply is unsure if

* its question is open-ended: the first gold answer is a text other than yes and no,
* it is not empty, and has less than full marks under `strict`, and
* a piece of it is not accounted for: of what the strict scorer separates in a list.

A piece is accounted for if it is

* another known answer, word for word: a gold answer of other open-ended questions of this type in
  the run, but not of this question. Case, blanks, marks and a beginning such as "on the" do not
  matter. Yes, no and a number in digits are known too: they are never the answer to an open-ended
  question;
* or, where several answers are wanted, one of them under `strict`, which has counted it.

Synonyms and near misses of other answers account for nothing: "on table" is a synonym of several of
them.
"""

import re
from collections import defaultdict
from collections.abc import Sequence

from infthor_eval.formats.question import Answer
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.summary import is_open_ended
from infthor_eval.nieh.scoring import pieces_of, plain_form, response_of, score
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]

_BEGINNING = re.compile(r"^(?:(?:on|in|to|into|onto|at) )?(?:(?:the|a|an) )?")
_NEVER_OPEN_ENDED = re.compile(r"yes|no|\d[\d\W]*")


class KnownAnswers:
    """Gold answers of a run's open-ended questions by type, and the replies they leave open."""

    def __init__(self, records: Sequence[Record]) -> None:
        """Take all records of a run, failed ones too: their questions have answers all the same."""
        self._names: dict[str, set[str]] = defaultdict(set)
        for record in filter(is_open_ended, records):
            self._names[record.payload.question_type].update(map(_name, record.payload.answers))

    def is_unsure(self, record: Record) -> bool:
        """Return True if the rules are unsure of a reply that `strict` has scored; see the module
        for the rule."""
        payload = record.payload
        response = response_of(payload.reply or "", payload.answers)
        if not response or not is_open_ended(record) or payload.scores["strict"] >= 1.0:
            return False
        others = self._names[payload.question_type] - set(map(_name, payload.answers))
        return not all(
            _is_accounted_for(piece, payload.answers, others)
            for piece in pieces_of(response, payload.answers)
        )


def _is_accounted_for(piece: str, answers: Sequence[Answer], others: set[str]) -> bool:
    name = _name(piece)
    if name in others or _NEVER_OPEN_ENDED.fullmatch(name):
        return True
    return len(answers) > 1 and any(score(piece, [answer], "strict") for answer in answers)


def _name(text: Answer) -> str:
    """Return what an answer is known by: its letters, without a beginning such as "on the"."""
    words = " ".join(plain_form(str(text).lower()).split())
    return _BEGINNING.sub("", words).replace(" ", "")
