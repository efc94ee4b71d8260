import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.guessing.chains import form_of, question_type


@pytest.mark.parametrize(
    ("text", "type_in_file", "form", "kind"),
    [
        ("Is Mug on the Table?", None, "Is {} in/on {}?", "is mug"),
        ("is the mug in the sink?", "final_state", "Is {} in/on {}?", "final_state"),
        ("Was the fridge open?", None, "Was {} open?", "was the"),
        ("Did you see a mug?", None, "did you", "did you"),
        ("DID  you wash it?", None, "did you", "did you"),
        ("Did you see a mug?", "presence", "presence", "presence"),
        ("Why?", None, "why?", "why?"),
    ],
)
def test_a_question_has_the_form_of_its_words_else_its_type_else_its_first_words(
    text, type_in_file, form, kind
):
    question = Question("t", text, (0,), ("yes",), type_in_file)
    assert (form_of(question), question_type(question)) == (form, kind)
