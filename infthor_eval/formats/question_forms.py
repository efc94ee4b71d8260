"""The forms of questions, those of the paper's Table 3 and our further ones, told by their words.

The published question files have no `question_type`. The type and the form of a question follow
from its text, in the published words ("Is Mug on the Table?") and in ours ("Is the mug on the
table?").
"""

import re
from dataclasses import dataclass
from functools import cached_property

_LONGEST = 1000  # characters of a question of a form: to look for one takes up to their square
_ONE_TYPE = r"(?:(?:a|an|the) )?[^?]+"


@dataclass(frozen=True)
class QuestionForm:
    """A form of questions.

    Attributes:
        question_type: its type in the words of the `question_type` column: one of Table 3's, or one
            of ours.
        words: the question with {} for each object, and a/b/c where either word stands: our texts
            and the published ones differ in some.
    """

    question_type: str
    words: str

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        pattern = re.sub(r"(\w+(?:/\w+)+)", _either, re.escape(self.words))
        return re.compile(pattern.replace(r"\{\}", _ONE_TYPE), re.IGNORECASE)

    def matches(self, text: str) -> bool:
        """Return True if a question is of this form."""
        return len(text) <= _LONGEST and self._pattern.fullmatch(text.strip()) is not None


def _either(words: re.Match[str]) -> str:
    return f"(?:{words[1].replace('/', '|')})"


# In this order: the first that matches is taken, so a form comes before one that its words fit,
# too.
FORMS = (
    QuestionForm("object_presence", "Is there any {} in this room?"),
    QuestionForm("object_presence", "Have you seen {}?"),
    QuestionForm("open_state", "Was {} open?"),
    QuestionForm("location_tracing", "Where was {} before you put it in/on/to {}?"),
    QuestionForm("location_tracing", "Where did you move {} from {}?"),
    QuestionForm("location_tracing", "Where is {} now?"),
    QuestionForm("slicing", "What did you slice?"),
    QuestionForm("slicing", "What objects were in/on {} when you slice/sliced {}?"),
    QuestionForm("container_content", "What objects were in/on {}?"),
    QuestionForm("put_action", "What object did you put in/on {}?"),
    QuestionForm("final_state", "What objects are in/on {}?"),
    QuestionForm("final_state", "How many objects were in/on {}?"),
    QuestionForm("final_state", "Is {} in/on {}?"),
    QuestionForm("movement_counting", "How many times did you move {}?"),
)

_CONTENT = "container_content_further"
_OPEN = "open_state_further"
_LOCATION = "location_tracing_further"
_COUNT = "movement_counting_further"
_PUT = "put_action_further"
FURTHER_FORMS = (
    QuestionForm(_OPEN, "Was {} open when you {}?"),
    QuestionForm(_OPEN, "Is {} open now?"),
    QuestionForm(_OPEN, "What did you open?"),
    QuestionForm(_LOCATION, "Where was {} before you picked it up?"),
    QuestionForm(_LOCATION, "Where was {} before you first picked it up?"),
    QuestionForm(_LOCATION, "Where did you move {} to?"),
    QuestionForm(_LOCATION, "In which places was {}, from first to last?"),
    QuestionForm(
        _CONTENT,
        "Which things that can be picked up were directly in/on {} when you first opened it?",
    ),
    QuestionForm(
        _CONTENT,
        "Which other things that can be picked up were directly in/on {} when you picked up {} "
        "from it?",
    ),
    QuestionForm(_PUT, "What did you put in/on {}?"),
    QuestionForm(_PUT, "What did you put down?"),
    QuestionForm(_PUT, "Where did you put things?"),
    QuestionForm(_COUNT, "How many times did you open {}?"),
    QuestionForm(_COUNT, "How many times did you put something in/on {}?"),
    QuestionForm(_COUNT, "How many different objects did you pick up?"),
    QuestionForm("order_further", "Did you pick up {} before {}?"),
)


def find_form(text: str) -> QuestionForm | None:
    """Return the form of a question, or None if it has none of these."""
    return next((form for form in (*FORMS, *FURTHER_FORMS) if form.matches(text)), None)


def type_of(text: str) -> str:
    """Return the type of a question, or an empty text if it has none of these forms."""
    form = find_form(text)
    return form.question_type if form else ""
