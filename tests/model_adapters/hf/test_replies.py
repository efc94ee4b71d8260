"""What ends a reply, and what of it is text."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from model_adapters import Decoding, Reply
from model_adapters.hf.decoding import Generation, extend_replies
from model_adapters.hf.replies import begin_reply, end_reply
from model_adapters.tiny.tokenizer import train_tokenizer

from ..asking import up_to

SPECIAL = ("</s>", "<image>", "<|act|>", "<|plan|>")


def _loaded(special: Sequence[str]) -> Any:
    tokenizer = train_tokenizer(special, end="</s>", pad="</s>", named={})
    return SimpleNamespace(tokenizer=tokenizer, generation=Generation(frozenset([tokenizer.eos_token_id])))


def _written(loaded: Any, text: str, decoding: Decoding) -> Reply:
    """The reply of a model that would say this text and then other things."""
    tokenizer = loaded.tokenizer
    reply = begin_reply(loaded, decoding, ())
    for token in tokenizer(text, add_special_tokens=False)["input_ids"]:
        if not reply.done:
            extend_replies([(reply, torch.nn.functional.one_hot(torch.tensor(token), len(tokenizer)))])
    return end_reply(loaded, reply, 0, 0)


@pytest.mark.parametrize("special", [SPECIAL, SPECIAL[:2]])
@pytest.mark.parametrize(
    ("stop", "text"),
    [
        (("<|act|>",), "MoveAhead on"),
        (("on", "<|act|>"), "MoveAhead "),
        (("never", "Rotate", "<|act|>"), "MoveAhead on"),
    ],
)
def test_a_stop_string_ends_the_reply_whether_or_not_it_is_a_special_token(
    special: Sequence[str], stop: tuple[str, ...], text: str
) -> None:
    loaded = _loaded(special)
    reply = _written(loaded, "MoveAhead on<|act|>RotateLeft", up_to(50, stop=stop))
    assert reply.text == text
    spelled = loaded.tokenizer(f"MoveAhead on{'' if text.endswith(' ') else stop[-1]}")["input_ids"]
    assert reply.token_ids == tuple(spelled)


def test_a_special_token_that_is_no_stop_string_stays_out_of_the_text() -> None:
    loaded = _loaded(SPECIAL)
    reply = _written(loaded, "<|plan|>mug<|plan|> on<|act|>x", up_to(50, stop=("<|act|>",)))
    assert reply.text == "mug on"
    assert _written(loaded, "mug<|act|> on</s>x", up_to(50)).text == "mug on"


def test_a_reply_may_be_a_stop_string_only() -> None:
    reply = _written(_loaded(SPECIAL), "<|act|>mug", up_to(50, stop=("<|act|>",)))
    assert (reply.text, reply.n_reply_tokens) == ("", 1)


def test_a_special_token_cuts_no_choice() -> None:
    decoding = up_to(50, choices=("mug<|act|>on",), stop=("<|act|>",))
    assert _written(_loaded(SPECIAL), "mug<|act|>on</s>", decoding).text == "mug<|act|>on"
