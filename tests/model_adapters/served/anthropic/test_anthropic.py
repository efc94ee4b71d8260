"""Models behind a server of Anthropic's messages, one by one and in batches."""

import base64
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from infthor_eval.errors import ModelError

from ...asking import ask, up_to
from ..batches.server import serve_batches
from ..talking import ask_once, open_behind
from .server import AnthropicServer, message


@pytest.fixture
def sent():
    return []


@pytest.fixture
def server(sent):
    with serve_batches(
        AnthropicServer(answer=lambda body: sent.append(body) or message())
    ) as server:
        yield server


def test_a_request_is_what_was_said_and_how_it_is_decoded(frames, server, sent):
    with open_behind(server.url, "anthropic") as model:
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], frames[1], "What is it?")
        talk.append("A mug.", role="assistant")
        talk.append("Where?")
        talk.reply(up_to(7, temperature=0.5, top_p=0.9, stop=("\n", "<|act|>")))
    (request,) = sent
    assert request["system"] == [{"type": "text", "text": "Be brief."}]
    assert [turn["role"] for turn in request["messages"]] == ["user", "assistant", "user"]
    blocks = request["messages"][0]["content"]
    assert [block["type"] for block in blocks] == ["text", "image", "image", "text"]
    source = blocks[1]["source"]
    assert (source["type"], source["media_type"]) == ("base64", "image/png")
    seen = np.asarray(Image.open(BytesIO(base64.b64decode(source["data"]))))
    assert (seen == np.asarray(frames[0].load())).all()
    # What is before the question is cached, up to the last frame.
    assert [block.get("cache_control") for block in blocks] == [
        None,
        None,
        {"type": "ephemeral"},
        None,
    ]
    assert (request["temperature"], request["top_p"]) == (0.5, 0.9)
    assert request["stop_sequences"] == ["<|act|>"]  # one of white space alone is refused
    assert "seed" not in request


@pytest.mark.parametrize(
    ("prompt_cache", "expected"), [("1h", {"type": "ephemeral", "ttl": "1h"}), ("off", None)]
)
def test_the_cache_may_last_longer_or_be_left_alone(prompt_cache, expected, frames, server, sent):
    with open_behind(server.url, "anthropic", prompt_cache=prompt_cache) as model:
        ask(model, frames[0], "What?")
    assert sent[0]["messages"][0]["content"][0].get("cache_control") == expected


def test_a_temperature_that_is_not_taken_is_refused(server):
    refused = pytest.raises(ModelError, match="anthropic takes temperatures up to 1; lower it")
    with open_behind(server.url, "anthropic") as model, refused:
        ask_once(model, temperature=1.5)
