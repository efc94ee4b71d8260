"""What a server replies, of whatever shape, is the reply or one line, and tells no key."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters.served.completion import decode_reply
from model_adapters.served.openai import ChatCompletion

from ..policies.servers import send
from .talking import (
    always_say,
    always_send,
    ask_once,
    completion,
    keep_requests,
    open_model,
    read_refusal,
)

KEY = "sk-0123456789abcdef0123456789"


def _read(content):
    return decode_reply("here", content, ChatCompletion, "a chat completion").text("here")


def _answers(document):
    return lambda *_: document


SHAPES = {
    "nothing": (
        always_send(200, b""),
        "does not answer with a chat completion (Input data was truncated)",
    ),
    "no content": (always_send(204, b""), "does not answer with a chat completion"),
    "no JSON": (
        always_send(200, b"<html>hello</html>", {"Content-Type": "text/html"}),
        "with a chat completion (JSON is",
    ),
    "no text": (always_send(200, b"\xff\xfe\x00" * 9), "does not answer with a chat completion"),
    "deep": (always_send(200, b"[" * 200_000), "does not answer with a chat completion"),
    "half": (
        always_send(200, json.dumps(completion()).encode()[:-20]),
        "does not answer with a chat completion",
    ),
    "a list": (_answers([completion()]), "(Expected `object`, got `array`)"),
    "a stream": (
        always_send(200, b"data: {}\n\ndata: [DONE]\n\n", {"Content-Type": "text/event-stream"}),
        "does not answer with a chat completion",
    ),
    "another object": (_answers({"detail": "hello"}), "answers without choices"),
    "choices of another type": (
        _answers(completion() | {"choices": "yes"}),
        "(Expected `array | null`, got `str` - at",
    ),
    "no choices": (_answers(completion() | {"choices": []}), "answers without choices"),
    "choices that are none": (
        _answers(completion() | {"choices": [None]}),
        "(Expected `object`, got `null` - at",
    ),
    "a choice without a message": (
        _answers(completion() | {"choices": [{"text": "yes"}]}),
        "field `message` - at",
    ),
    "content of another type": (
        _answers(completion(message={"content": 7})),
        "(Expected `str | array | null`, got `int` - at",
    ),
    "half a pair": (
        always_send(200, json.dumps(completion("\ud800")).encode()),
        "does not answer with a chat completion",
    ),
    "no words": (_answers(completion(None)), "gives no text; see its log"),
    "no words, strange reason": (
        _answers(completion(None, finish_reason="x\ny")),
        "gives no text; see its log",
    ),
    "no words, too long": (
        _answers(completion(None, finish_reason="length")),
        "the token limit was reached before any text",
    ),
    "filtered": (
        _answers(completion("", finish_reason="content_filter")),
        "the server's content filter blocked it",
    ),
    "tools": (
        _answers(completion(None, finish_reason="tool_calls")),
        "it calls a tool, though none was offered",
    ),
    "a redirect": (
        always_send(307, b"", {"Location": "http://127.0.0.1:1/v1"}),
        "answers 307 Temporary Redirect: nothing; r",
    ),
    "a redirect for good": (
        always_send(301, b"", {"Location": "/v1"}),
        "redirects are not followed",
    ),
    "no such model": (
        always_send(404, b'{"error": {"message": "no m"}}'),
        'answers 404 Not Found: \'{"error": {"message"',
    ),
    "a bad request": (
        always_send(400, b"top_p\nis not taken"),
        "answers 400 Bad Request: 'top_p is not taken'; check",
    ),
    "too many frames for vLLM": (
        always_send(400, b"At most 2 image(s) may be provided in one prompt."),
        "in one prompt.'; start the server with a higher --limit-mm-per-prompt",
    ),
    "a key that is not taken": (
        always_send(401, b"who?"),
        "answers 401 Unauthorized: 'who?'; set the environment variable",
    ),
    "another status": (always_send(499, b""), "answers 499: nothing; check"),
    "no money": (
        always_send(429, b'{"error": {"code": "insufficient_quota"}}'),
        "answers 429 Too Many Requests",
    ),
    "packed": (
        always_send(200, b"\x1f\x8b", {"Content-Encoding": "gzip"}),
        "answers in an encoding that was not requested",
    ),
    "strange letters": (
        always_send(418, b"\xff\xfe", {"Content-Type": "text/plain; charset=none-such"}),
        "answers 418",
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_reply_of_any_shape_is_one_line_and_not_asked_for_again(shape):
    answer, message = SHAPES[shape]
    asked = []
    assert message in read_refusal(keep_requests(asked, answer), retries=3)
    assert len(asked) == 1


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner, max_size=2)
    ),
    max_leaves=4,
)


@settings(max_examples=200)
@given(st.data())
def test_no_document_is_a_traceback(data):
    document = completion()
    place = data.draw(
        st.sampled_from([(), ("choices",), ("usage",), ("choices", 0), ("choices", 0, "message")])
    )
    within = document
    for step in place:
        within = within[step]
    key = data.draw(st.sampled_from(sorted(within))) if isinstance(within, dict) else 0
    within[key] = data.draw(_VALUES)
    try:
        text = _read(json.dumps(document).encode())
    except ModelError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(text, str)


@pytest.mark.parametrize(
    ("document", "text"),
    [
        (completion("a mug", finish_reason="length"), "a mug"),
        (completion("I will not", finish_reason="content_filter"), "I will not"),
        (completion(None, message={"refusal": "I will not"}), "I will not"),
        (completion("", finish_reason="stop"), ""),
        (completion("", finish_reason="length"), ""),
        (completion("", message={"refusal": "I will not"}), "I will not"),
        (completion("yes", usage=None), "yes"),
        (
            completion("yes")
            | {"choices": [*completion("yes")["choices"], *completion("no")["choices"]]},
            "yes",
        ),
        (completion("yes") | {"extra": [1, {"more": None}]}, "yes"),
    ],
)
def test_what_was_said_is_the_reply(document, text):
    with open_model(_answers(document)) as model:
        assert ask_once(model).text == text


USAGES = [
    ('{"prompt_tokens": 10, "completion_tokens": 2}', (10, 2, None)),
    ('{"prompt_tokens": 10.0, "completion_tokens": 2.0}', (10, 2, None)),
    ('{"prompt_tokens": 10, "completion_tokens": 2, "prompt_tokens_details": null}', (10, 2, None)),
    (
        '{"prompt_tokens": 10, "completion_tokens": 2, "prompt_tokens_details": '
        '{"cached_tokens": 7, "audio_tokens": null}, "cost": 1e999}',
        (None, None, None),  # a number that no computer has: nothing of it is read
    ),
    (
        '{"prompt_tokens": 10, "completion_tokens": 2, "prompt_tokens_details": '
        '{"cached_tokens": 12}, "x": [1]}',
        (10, 2, 10),
    ),
    (
        '{"prompt_tokens": 10, "completion_tokens": 2, "prompt_tokens_details": '
        '{"cached_tokens": -1}}',
        (10, 2, None),
    ),
    *(
        (usage, (None, None, None))
        for usage in (
            "null",
            "{}",
            "[]",
            "[[1, 2]]",
            "7",
            '"many"',
            "true",
            '{"prompt_tokens": null, "completion_tokens": null}',
            '{"prompt_tokens": 10}',
            '{"prompt_tokens": 10, "completion_tokens": null}',
            '{"prompt_tokens": -1, "completion_tokens": 2}',
            '{"prompt_tokens": 10, "completion_tokens": 2.5}',
            '{"prompt_tokens": 10, "completion_tokens": "2"}',
            '{"prompt_tokens": true, "completion_tokens": 2}',
            '{"prompt_tokens": 1' + "0" * 40 + ', "completion_tokens": 2}',
            '{"prompt_tokens": 1e300, "completion_tokens": 2}',
        )
    ),
]


@pytest.mark.parametrize(("usage", "counts"), USAGES)
def test_no_usage_takes_the_reply_with_it(usage, counts):
    body = json.dumps(completion() | {"usage": "@"}).replace('"@"', usage).encode()
    with open_model(always_send(200, body)) as model:
        reply = ask_once(model)
    assert reply.text == "yes"
    assert (reply.n_context_tokens, reply.n_reply_tokens, reply.n_cached_tokens) == counts


@pytest.mark.parametrize(
    ("content", "text", "thinking"),
    [
        (
            [
                {"type": "thinking", "thinking": [{"type": "text", "text": "A mug?"}]},
                {"type": "text", "text": "a cup"},
            ],
            "a cup",
            "A mug?",
        ),
        ([{"type": "thinking", "thinking": "A mug?"}], "", "A mug?"),
        ([{"type": "text", "text": "a "}, {"type": "text", "text": "cup"}], "a cup", None),
        ([{"type": "reference", "reference_ids": [1]}, {"type": "text", "text": "x"}], "x", None),
        ([{"type": "text", "text": None}], "", None),
        ([], "", None),
    ],
)
def test_content_may_be_chunks(content, text, thinking):
    with open_model(_answers(completion(message={"content": content}))) as model:
        reply = ask_once(model)
    assert (reply.text, reply.thinking) == (text, thinking)


def test_nothing_before_the_token_limit_is_a_thought_that_was_cut_off():
    for content, reason, thinking in (("", "length", ""), ([], "length", ""), ("", "stop", None)):
        with open_model(_answers(completion(content, finish_reason=reason))) as model:
            reply = ask_once(model)
        assert (reply.text, reply.thinking) == ("", thinking)


@pytest.mark.parametrize("status", [200, 400, 401, 429, 500])
def test_a_server_that_says_the_key_again_does_not_have_it_told(status, monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    heard = []

    def answer(_request, handler):
        heard.append(handler.headers["Authorization"])
        if status == 200:
            return completion(f"The key is {heard[0]}.")
        return send(handler, status, f"wrong key: {'x' * 170} {heard[0]}".encode())

    if status == 200:
        with open_model(answer) as model:
            message = ask_once(model).text
        assert message == "The key is Bearer [key]."
    else:
        message = read_refusal(answer)
    assert set(heard) == {f"Bearer {KEY}"}
    assert KEY[:8] not in message


def test_a_short_key_keeps_no_secret(monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", "mug")
    with open_model(always_say("a mug")) as model:
        assert ask_once(model).text == "a mug"
