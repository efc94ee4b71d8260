"""What holds of models behind Anthropic's and Gemini's servers alike, one by one and in batches."""

import itertools
import json
from contextlib import contextmanager
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters import check_adapter
from model_adapters.served.anthropic import Message
from model_adapters.served.completion import decode_reply
from model_adapters.served.gemini import GeneratedContent
from model_adapters.served.openai import ChatCompletion

from ...helpers.refusals import read_one_line
from .anthropic.server import AnthropicServer, errored, message
from .batches.server import serve_batches
from .gemini import server as gemini
from .gemini.server import GeminiServer, content
from .talking import ask_once, open_behind

SERVERS = {
    "anthropic": AnthropicServer,
    "gemini": partial(GeminiServer, last_status="succeeded"),
}
SAYS = {"anthropic": message, "gemini": content}
failed = gemini.errored


def _answering(name, outcomes):
    """Outcomes in their order, then what is usual."""
    following = iter(outcomes)
    return SERVERS[name](answer=lambda _: next(following, SAYS[name]()))


@contextmanager
def _open(name, *outcomes, **options):
    """A server, and a model behind it."""
    with (
        serve_batches(_answering(name, outcomes)) as server,
        open_behind(server.url, name, **{"retries": 1, **options}) as model,
    ):
        yield server, model


def _reply(name, *outcomes, **options):
    with _open(name, *outcomes, **options) as (_, model):
        return ask_once(model)


def _counts(reply):
    return reply.n_context_tokens, reply.n_reply_tokens, reply.n_cached_tokens


numbers = itertools.count()


def _words(body):
    """Anthropic has no seed: the same request may get another reply."""
    return message(" ".join(f"{next(numbers):064b}"[-body["max_tokens"] :]))


def _digits(body):
    n_most = body["generationConfig"]["maxOutputTokens"]
    return content(" ".join(str(abs(hash(repr(body)))))[:n_most])


@pytest.mark.parametrize(
    ("name", "answer", "options"),
    [
        # The contract asks at temperatures above 1, too.
        ("anthropic", _words, {"send_temperature": False}),
        ("gemini", _digits, {}),
    ],
)
def test_it_keeps_the_contract(name, answer, options):
    server = SERVERS[name](answer=answer)
    with serve_batches(server), open_behind(server.url, name, **options) as model:
        check_adapter(model)


@pytest.mark.parametrize(
    ("name", "prices", "counts", "dollars"),
    [
        (
            "anthropic",
            {"input": 4, "cached": 0.4, "cache_write": 5, "output": 20},
            (100, 10, 20),
            30 * 4 + 20 * 0.4 + 50 * 5 + 10 * 20,
        ),
        (
            "gemini",
            {"input": 2, "cached": 0.5, "output": 12},
            (100, 15, 40),
            60 * 2 + 40 * 0.5 + 15 * 12,
        ),
    ],
)
def test_cached_tokens_and_thoughts_are_counted_and_priced(name, prices, counts, dollars):
    reply = _reply(name, **{f"price_per_m_{of}": price for of, price in prices.items()})
    assert _counts(reply) == counts
    assert reply.cost == pytest.approx(dollars / 1e6)


@pytest.mark.parametrize(
    ("name", "outcome", "expected"),
    [
        (
            "anthropic",
            errored(400, "invalid_request_error", "image exceeds 5 MB"),
            "answers 400 Bad Request",
        ),
        ("anthropic", errored(401, "authentication_error"), "a valid key"),
        (
            "anthropic",
            errored(413, "request_too_large"),
            "use fewer frames, or set image_format=jpeg",
        ),
        (
            "anthropic",
            message("", content=[], stop_reason="refusal"),
            "the server's classifiers stopped it",
        ),
        (
            "anthropic",
            message("", content=[], stop_reason="max_tokens"),
            "give --max-thinking-tokens N",
        ),
        ("anthropic", {"content": []}, "does not answer with a message"),
        ("gemini", failed(400, "INVALID_ARGUMENT", "no such field"), "answers 400 Bad Request"),
        ("gemini", failed(403, "PERMISSION_DENIED"), "a key with access to this model"),
        ("gemini", content("", "SAFETY"), "the server's content filter blocked it"),
        ("gemini", content("", "MAX_TOKENS"), "give --max-thinking-tokens N"),
        (
            "gemini",
            {"promptFeedback": {"blockReason": "PROHIBITED_CONTENT"}},
            "the server's content filter blocked it",
        ),
        ("gemini", {}, "gives no text; is it a model that generates text?"),
        ("gemini", {"candidates": 3}, "does not answer with generated content"),
    ],
)
def test_what_is_no_reply_is_one_line(name, outcome, expected):
    with _open(name, outcome) as (server, model), pytest.raises(ModelError) as caught:
        ask_once(model)
    assert expected in read_one_line(caught)
    assert server.n_asked == 1


@pytest.mark.parametrize(
    ("name", "outcome", "words"),
    [
        ("anthropic", errored(429, "rate_limit_error"), "answers 429"),
        ("anthropic", errored(500, "api_error"), "answers 500 Internal Server Error: '{"),
        ("anthropic", errored(529, "overloaded_error"), "answers 529"),
        (
            "anthropic",
            message("It", stop_reason="error"),
            "answers 500 Internal Server Error: 'a 200",
        ),
        ("anthropic", errored(500, "overloaded_error", "Overloaded")[1], "Server Error: 'in a 200"),
        ("gemini", content("It", "OTHER"), "ended with OTHER"),
        ("gemini", content("", "MALFORMED_RESPONSE"), "ended with MALFORMED_RESPONSE"),
        (
            "gemini",
            failed(503, "UNAVAILABLE", "overloaded")[1],
            "answers 503 Service Unavailable: 'in a 200",
        ),
    ],
)
def test_what_passes_is_sent_again_and_told(name, outcome, words):
    reply = _reply(name, outcome)
    assert (reply.text, len(reply.faults)) == ("yes", 1)
    assert words in reply.faults[0]


NONE = (None, None, None)


@pytest.mark.parametrize(
    ("name", "usage", "counts"),
    [
        ("anthropic", {"input_tokens": 30, "output_tokens": 10}, (30, 10, None)),
        (
            "anthropic",
            {"input_tokens": 30, "output_tokens": 10, "cache_read_input_tokens": None},
            (30, 10, None),
        ),
        (
            "anthropic",
            {"input_tokens": 30.0, "output_tokens": 10, "cache_read_input_tokens": 0},
            (30, 10, 0),
        ),
        ("anthropic", {}, NONE),
        ("anthropic", {"input_tokens": -1, "output_tokens": 10}, NONE),
        ("anthropic", {"cache_read_input_tokens": 5, "output_tokens": 10}, (5, 10, 5)),
        ("anthropic", "many", NONE),
        ("gemini", {"promptTokenCount": 9, "thoughtsTokenCount": 4.0}, (9, 4, 0)),
        ("gemini", {"promptTokenCount": 9, "candidatesTokenCount": None}, NONE),
        ("gemini", {}, NONE),
        ("gemini", [], NONE),
    ],
)
def test_no_usage_takes_the_reply_with_it(name, usage, counts):
    field = {"anthropic": "usage", "gemini": "usageMetadata"}[name]
    assert _counts(_reply(name, SAYS[name](**{field: usage}))) == counts


def test_thoughts_are_told_apart_and_refusals_in_words_are_replies():
    blocks = [
        {"type": "thinking", "thinking": "A mug?", "signature": "x"},
        {"type": "text", "text": "a cup"},
    ]
    reply = _reply("anthropic", message(content=blocks))
    assert (reply.text, reply.thinking) == ("a cup", "A mug?")
    assert _reply("anthropic", message("I will not", stop_reason="refusal")).text == "I will not"
    parts = [{"text": "A mug?", "thought": True}, {"text": "a cup"}]
    said = {"candidates": [{"content": {"parts": parts}, "finishReason": "STOP"}]}
    reply = _reply("gemini", said)
    assert (reply.text, reply.thinking, reply.n_reply_tokens) == ("a cup", "A mug?", None)


@pytest.mark.parametrize(
    ("name", "variable", "head"),
    [
        ("anthropic", "ANTHROPIC_API_KEY", "x-api-key"),
        ("gemini", "GEMINI_API_KEY", "x-goog-api-key"),
    ],
)
def test_the_key_goes_into_the_head_alone(name, variable, head, monkeypatch):
    key = "sk-0123456789abcdef0123456789"
    monkeypatch.setenv(variable, key)
    heard = []
    server = _answering(name, [SAYS[name](f"{key}!")])
    answer_to = server.answer_to

    def listen(method, path, headers, body):
        heard.append((headers[head], headers["Authorization"], key in path + str(body)))
        return answer_to(method, path, headers, body)

    server.answer_to = listen
    with serve_batches(server), open_behind(server.url, name) as model:
        assert ask_once(model).text == "[key]!"
    assert heard == [(key, None, False)]


@pytest.mark.parametrize(
    ("form", "called"),
    [
        (Message, "a message"),
        (GeneratedContent, "content"),
        (ChatCompletion, "a chat completion"),
    ],
)
@given(given_bytes=st.binary(max_size=200) | st.text(max_size=80).map(str.encode))
def test_no_bytes_are_a_traceback(form, called, given_bytes):
    try:
        decode_reply("here", given_bytes, form, called).text("here")
    except ModelError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("name", "size", "sizes", "cached"),
    [
        ("anthropic", 2, [2, 2, 1], "(100 of them cached, 20.0 %)"),
        ("gemini", 3, [3, 2], "(200 of them cached, 40.0 %)"),
    ],
)
def test_questions_are_asked_in_a_batch(name, size, sizes, cached, ask, tmp_path):
    prices = {"price_per_m_input": 2, "price_per_m_cached": 0.2, "price_per_m_output": 10}
    with serve_batches(_answering(name, [])) as server:
        code, out, err = ask(server, model=name, batch_requests=size, **prices)
    assert code == 0, err
    assert [n for n, _ in server.sizes] == sizes
    assert server.n_asked == 5
    results = json.loads(next((tmp_path / "out").rglob("results.json")).read_text())
    assert results["usage"]["context"] == 500
    assert cached in out


@pytest.mark.parametrize(
    ("name", "outcome", "code"),
    [
        ("anthropic", "expired", 0),
        ("anthropic", "canceled", 1),
        ("anthropic", errored(429, "rate_limit_error"), 0),
        ("anthropic", errored(529, "overloaded_error"), 0),
        ("anthropic", errored(400, "invalid_request_error"), 1),
        ("gemini", failed(429, "RESOURCE_EXHAUSTED"), 0),
        ("gemini", failed(503, "UNAVAILABLE"), 0),
        ("gemini", failed(400, "INVALID_ARGUMENT"), 1),
    ],
)
def test_lines_without_a_reply_are_asked_again_if_that_may_help(name, outcome, code, ask):
    with serve_batches(_answering(name, [outcome, outcome])) as server:
        assert ask(server, model=name)[0] == code
    assert [n for n, _ in server.sizes] == ([5, 2] if code == 0 else [5])


@pytest.mark.parametrize("looks", [0, 3])
@pytest.mark.parametrize(
    ("name", "at"), [("anthropic", "/batches"), ("gemini", ":batchGenerateContent")]
)
def test_a_batch_whose_name_was_lost_is_found_again(name, at, looks, ask):
    server = _answering(name, [])
    server.looks = looks
    answer_to, lost = server.answer_to, iter([True])

    def answer_and_lose(method, path, headers, body):
        answer = answer_to(method, path, headers, body)
        is_lost = method == "POST" and path.endswith(at) and next(lost, False)
        return (0, b"") if is_lost else answer

    server.answer_to = answer_and_lose
    with serve_batches(server):
        code, _, err = ask(server, model=name)
    assert code == 0, err
    assert (len(server.sizes), server.n_asked) == (1, 5)
