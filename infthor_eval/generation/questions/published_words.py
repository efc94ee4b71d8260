"""Questions in the published files' words: type names, mostly bare ("Where is Statue now?").

The words are those of the two published question files, counted there: containers of contents, puts
and counts have one preposition each, whatever the container; "Is X in the Y?" has that of the
container, as ours. Yes and no are written with a capital, numbers as numbers, objects as type
names.
"""

import re

from infthor_eval.formats.question import Answer, Question
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.household.affordances import preposition
from infthor_eval.household.wording import answer_of, canonical_type, object_type

# By our form. The names of the candidate become type names; "a" and "preposition" are those of the
# last one.
_FORMS = {
    "Is there any {} in this room?": "Is there any {} in this room?",
    "Have you seen {}?": "Have you seen {a} {}?",
    "Was {} open?": "Was {} open?",
    "Where was {} before you put it {}?": "Where was {} before you put it to {}?",
    "Where did you move {} from {}?": "Where did you move the {} from the {}?",
    "Where is {} now?": "Where is {} now?",
    "What did you slice?": "What did you slice?",
    "What objects were {} when you sliced {}?": "What objects were in {} when you slice {}?",
    "What objects were {}?": "What objects were in {}?",
    "What object did you put {}?": "What object did you put on the {}?",
    "What objects are {}?": "What objects are on the {}?",
    "How many objects were {}?": "How many objects were on the {}?",
    "Is {} {}?": "Is {} {preposition} the {}?",
    "How many times did you move {}?": "How many times did you move {}?",
}
_BEFORE_NOUN = re.compile(r"^(?:(?:in|on) )?(?:(?:the|an|a) )?")


def in_published_words(candidate: Candidate, traj_id: str) -> Question:
    """Return a candidate of Table 3's forms as a question in the published words.

    Raises:
        ValueError: the form is one of ours, which has no published words.
    """
    form = _FORMS.get(candidate.form)
    if form is None:
        raise ValueError(f"{candidate.form!r} has no published words")
    types = [object_type(_BEFORE_NOUN.sub("", name)) for name in candidate.names]
    last = types[-1] if types else ""
    text = form.format(
        *types, a="an" if last.startswith(tuple("AEIOU")) else "a", preposition=preposition(last)
    )
    by_answer = {answer_of(subject): canonical_type(subject) for subject in candidate.subjects}
    return Question(
        traj_id,
        text,
        candidate.clues,
        tuple(_answer(answer, by_answer) for answer in candidate.answers),
        candidate.question_type,
        candidate.absence,
    )


def _answer(answer: Answer, types: dict[str, str]) -> Answer:
    if answer in {"yes", "no"}:
        return str(answer).capitalize()
    return int(answer) if str(answer).isdecimal() else types[str(answer)]
