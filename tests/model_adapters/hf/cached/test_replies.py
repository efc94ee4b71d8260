"""What ends a reply, and what of it is text."""

import pytest
import torch

from model_adapters.hf.cached.decoding import Generation, extend_replies
from model_adapters.hf.cached.replies import begin_reply, end_reply
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.thinking import MARKERS, answer_of
from model_adapters.tiny.tokenizer import train_tokenizer

from ...asking import up_to

SPECIAL = ("</s>", "<image>", "<|act|>", "<|plan|>")


def _loaded(special, template=""):
    tokenizer = train_tokenizer(special, end="</s>", pad="</s>", named={})
    generation = Generation(frozenset([tokenizer.eos_token_id]))
    nothing = None
    return LoadedCheckpoint(nothing, tokenizer, None, template, nothing, generation, None, {})


def _written(loaded, text, decoding):
    """The reply of a model that would say this text and then other things."""
    tokenizer = loaded.tokenizer
    reply = begin_reply(loaded, decoding, ())
    for token in tokenizer(text, add_special_tokens=False)["input_ids"]:
        if not reply.done:
            extend_replies(
                [(reply, torch.nn.functional.one_hot(torch.tensor(token), len(tokenizer)))]
            )
    return end_reply(loaded, reply, (), None, 0)


@pytest.mark.parametrize("special", [SPECIAL, SPECIAL[:2]])
@pytest.mark.parametrize(
    ("stop", "text"),
    [
        (("<|act|>",), "MoveAhead on"),
        (("on", "<|act|>"), "MoveAhead "),
        (("never", "Rotate", "<|act|>"), "MoveAhead on"),
    ],
)
def test_a_stop_string_ends_the_reply_whether_or_not_it_is_a_special_token(special, stop, text):
    loaded = _loaded(special)
    reply = _written(loaded, "MoveAhead on<|act|>RotateLeft", up_to(50, stop=stop))
    assert reply.text == text
    spelled = loaded.tokenizer(f"MoveAhead on{'' if text.endswith(' ') else stop[-1]}")["input_ids"]
    assert reply.token_ids == tuple(spelled)


def test_a_special_token_that_is_no_stop_string_stays_out_of_the_text():
    loaded = _loaded(SPECIAL)
    reply = _written(loaded, "<|plan|>mug<|plan|> on<|act|>x", up_to(50, stop=("<|act|>",)))
    assert reply.text == "mug on"
    assert _written(loaded, "mug<|act|> on</s>x", up_to(50)).text == "mug on"


def test_a_reply_may_be_a_stop_string_only():
    reply = _written(_loaded(SPECIAL), "<|act|>mug", up_to(50, stop=("<|act|>",)))
    assert (reply.text, reply.n_reply_tokens) == ("", 1)


def test_a_special_token_cuts_no_choice():
    decoding = up_to(50, choices=("mug<|act|>on",), stop=("<|act|>",))
    assert _written(_loaded(SPECIAL), "mug<|act|>on</s>", decoding).text == "mug<|act|>on"


@pytest.mark.parametrize(("before", "behind"), MARKERS.values())
def test_markers_of_thoughts_are_in_the_text_even_where_they_are_special_tokens(before, behind):
    for special in (SPECIAL, (*SPECIAL, before, behind)):
        reply = _written(_loaded(special), f"{before}a mug?{behind}yes</s>", up_to(300))
        assert answer_of(reply) == ("a mug?", "yes")


@pytest.mark.parametrize(
    ("end", "opening"),
    [
        ("<think>", "<think>"),
        ("[THINK] ", "[THINK]"),
        ("", ""),
        ("<think></think>", ""),
        ("{{ fail() }}<think>", ""),
    ],
)
def test_a_marker_that_the_template_writes_belongs_to_the_reply(end, opening):
    template = (
        "{% for m in messages %}{{ m.role }}: {{ m.content[0].text }}\n{% endfor %}assistant: "
        + end
    )
    loaded = _loaded(SPECIAL, template)
    assert loaded.opening == opening
    reply = _written(loaded, "a mug?</s>", up_to(300))
    assert answer_of(reply) == (("a mug?", "") if opening else (None, "a mug?"))
