"""What chat templates make of turns, and which of them are refused."""

import pytest

from infthor_eval.errors import ModelError
from model_adapters import Turn
from model_adapters.hf.prompting.rendering import Marks, render
from model_adapters.tiny.tokenizer import train_tokenizer

from ...asking import user

BODY = (
    "{%- for part in message.content -%}"
    "{{- '<image>' if part.type == 'image' else part.text -}}{%- endfor -%}"
)
EACH = "{%- for message in messages -%}<{{ message.role }}>HERE{%- endfor -%}"
PLAIN = EACH.replace("HERE", BODY)
IMAGES_FIRST = EACH.replace(
    "HERE",
    "{%- for part in message.content if part.type == 'image' -%}<image>{%- endfor -%}"
    "{%- for part in message.content if part.type == 'text' -%}{{- part.text -}}{%- endfor -%}",
)
NO_SYSTEM = (
    "{%- if messages[0].role == 'system' -%}{{- raise_exception('no system turns') -}}{%- endif -%}"
    + PLAIN
)
ONLY_USERS = PLAIN.replace("messages -%}", "messages if message.role == 'user' -%}")
# As Pixtral's: the system's words are joined to a string.
JOINED = (
    "{%- set rules = messages[0].content if messages[0].role == 'system' else '' -%}[{{- rules + "
    "'\\n' -}}]" + ONLY_USERS.replace("message.role == 'user'", "message.role != 'system'")
)
PRINTED = EACH.replace("HERE", "{{- message.content -}}")

SYSTEM, ANSWER, MORE = (
    Turn("system", ("Be brief.",)),
    Turn("assistant", ("A mug.",)),
    Turn("user", ("Sure?",)),
)
SAID = (*user("What?"), ANSWER, MORE)


@pytest.fixture(scope="module")
def tokenizer():
    return train_tokenizer(
        ("</s>", "<image>"), end="</s>", pad="</s>", named={"image_token": "<image>"}
    )


def _render(tokenizer, template, turns):
    return render(tokenizer, template, turns, Marks("<image>"))


def test_all_turns_are_rendered(tokenizer, frames):
    turns = (SYSTEM, Turn("user", ("See ", frames[0], "?")), ANSWER, Turn("user", (frames[1],)))
    assert (
        _render(tokenizer, PLAIN, turns)
        == "<system>Be brief.<user>See <image>?<assistant>A mug.<user><image>"
    )


def test_frames_stay_in_their_places_in_every_turn(tokenizer, frames):
    turns = (
        Turn("user", ("See ", frames[0], "?")),
        ANSWER,
        Turn("user", (frames[1], "or ", frames[2])),
    )
    text = "<user>See <image>?<assistant>A mug.<user><image>or <image>"
    assert _render(tokenizer, IMAGES_FIRST, turns) == text


def test_a_turn_is_written_the_same_whatever_comes_after_it(tokenizer, frames):
    turns = (
        *user("x", frames[0]),
        ANSWER,
        *user(frames[1], "x", frames[2]),
        ANSWER,
        *user("x", frames[0], "y"),
    )
    whole = _render(tokenizer, IMAGES_FIRST, turns)
    for n in (1, 3):
        assert whole.startswith(_render(tokenizer, IMAGES_FIRST, turns[:n]))


@pytest.mark.parametrize(
    ("template", "turns", "complaint"),
    [
        (
            NO_SYSTEM,
            (SYSTEM, *SAID),
            r"refuses the turns system, user, assistant, user \(no system turns\)",
        ),
        (ONLY_USERS, SAID, r"drops the text 'A mug.' of a turn \(assistant\)"),
        (ONLY_USERS, (*SAID, Turn("assistant", ("Sure?",)), MORE), r"drops"),
        (
            "{{ messages[0].content[0].text.nothing.at_all }}",
            SAID,
            "refuses the turns user, assistant, user",
        ),
        ("{{ 'a' + messages[0].content }}", SAID, "refuses the turns user, assistant, user"),
        ("{%- if -%}", SAID, "refuses the turns"),
        (PRINTED, SAID, "writes lists instead of texts"),
    ],
)
def test_turns_that_a_template_does_not_take_are_one_line(tokenizer, template, turns, complaint):
    with pytest.raises(ModelError, match=complaint) as caught:
        _render(tokenizer, template, turns)
    assert "\n" not in str(caught.value)


def test_a_text_that_is_said_twice_and_written_once_is_left_out(tokenizer):
    turns = (*user("Sure?"), Turn("assistant", ("Sure?",)), *user("Why?"))
    with pytest.raises(ModelError, match=r"drops the text 'Sure\?'"):
        _render(tokenizer, ONLY_USERS, turns)


def test_the_systems_words_are_a_string_where_the_template_joins_them(tokenizer):
    text = "[Be brief.\n]<user>What?<assistant>A mug.<user>Sure?"
    assert _render(tokenizer, JOINED, SAID) == text.replace("Be brief.", "")
    # A string is no list of texts for the assistant's turn.
    with pytest.raises(ModelError, match="drops"):
        _render(tokenizer, JOINED, (SYSTEM, *SAID))
    strings = BODY.replace(
        "{%- for", "{%- if message.content is string -%}{{- message.content -}}{%- else -%}{%- for"
    )
    template = JOINED.replace(BODY, strings + "{%- endif -%}")
    assert _render(tokenizer, template, (SYSTEM, *SAID)) == text


def test_a_template_that_writes_the_date_writes_the_same_every_day(tokenizer):
    dated = "{{- strftime_now('%Y-%m-%d') }}: " + PLAIN
    assert _render(tokenizer, dated, user("What?")).startswith("2025-01-01:")
