"""The forms of questions of the paper's Table 3, told by their words.

The published question files have no `question_type`. The type and the form of a question follow from its text, in the
published words ("Is Mug on the Table?") and in ours ("Is the mug on the table?").
"""

import re
from dataclasses import dataclass

__all__ = ["FORMS", "QuestionForm", "find_form", "type_of"]

_ONE_TYPE = r"(?:(?:a|an|the) )?[^?]+"


@dataclass(frozen=True)
class QuestionForm:
    """A form of questions.

    Attributes:
        question_type: its type in Table 3, in the words of the `question_type` column.
        words: the question with {} for each object.
    """

    question_type: str
    words: str

    def matches(self, text: str) -> bool:
        """Return True if a question is of this form."""
        pattern = re.escape(self.words).replace(r"\{\}", _ONE_TYPE).replace("in/on", "(?:in|on)")
        return re.fullmatch(pattern, text.strip(), flags=re.IGNORECASE) is not None


# In this order: the first that matches is taken, so a form comes before one that its words fit, too.
FORMS = (
    QuestionForm("object_presence", "Is there any {} in this room?"),
    QuestionForm("object_presence", "Have you seen {}?"),
    QuestionForm("open_state", "Was {} open?"),
    QuestionForm("location_tracing", "Where was {} before you put it to {}?"),
    QuestionForm("location_tracing", "Where did you move {} from {}?"),
    QuestionForm("location_tracing", "Where is {} now?"),
    QuestionForm("slicing", "What did you slice?"),
    QuestionForm("slicing", "What objects were in/on {} when you slice {}?"),
    QuestionForm("container_content", "What objects were in/on {}?"),
    QuestionForm("put_action", "What object did you put in/on {}?"),
    QuestionForm("final_state", "What objects are in/on {}?"),
    QuestionForm("final_state", "How many objects were in/on {}?"),
    QuestionForm("final_state", "Is {} in/on {}?"),
    QuestionForm("movement_counting", "How many times did you move {}?"),
)


def find_form(text: str) -> QuestionForm | None:
    """Return the form of a question, or None if it has none of Table 3's."""
    return next((form for form in FORMS if form.matches(text)), None)


def type_of(text: str) -> str:
    """Return the type in Table 3 of a question, or an empty text."""
    form = find_form(text)
    return form.question_type if form else ""
