"""Models behind a server of Anthropic's messages, one by one and in batches."""

import base64
import itertools
import json
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters import check_adapter, load
from model_adapters.served.anthropic import Message
from model_adapters.served.completion import decode_reply

from ...asking import up_to
from ..batches.server import serve_batches
from .server import AnthropicServer, errored, message

KEY = "sk-ant-0123456789abcdef0123456789"


def _open(server, **options):
    settings = {"base_url": server.url, "model": "m", "retries": 1, **options}
    return load("anthropic", {name: str(value) for name, value in settings.items()}, 0)


def _ask(server, *parts, options=None, **decoding):
    model = _open(server, **(options or {}))
    try:
        talk = model.conversation()
        talk.append(*(parts or ("What is it?",)))
        return talk.reply(up_to(5, **decoding))
    finally:
        model.close()


def _kept(requests, outcome=None):
    def answer(body):
        requests.append(body)
        return outcome or message()

    return answer


def test_it_keeps_the_contract():
    numbers = itertools.count()  # there is no seed: the same request may get another reply

    def answer(body):
        return message(" ".join(f"{next(numbers):064b}"[-body["max_tokens"] :]))

    with serve_batches(AnthropicServer(answer=answer)) as server:
        model = _open(server, send_temperature=False)  # the contract asks above 1, too
        check_adapter(model)
        model.close()


def test_a_request_is_what_was_said_and_how_it_is_decoded(frames):
    requests = []
    with serve_batches(AnthropicServer(answer=_kept(requests))) as server:
        model = _open(server)
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], frames[1], "What is it?")
        talk.append("A mug.", role="assistant")
        talk.append("Where?")
        talk.reply(up_to(7, temperature=0.5, top_p=0.9, stop=("\n", "<|act|>")))
        model.close()
    (request,) = requests
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
def test_the_cache_may_last_longer_or_be_left_alone(prompt_cache, expected, frames):
    requests = []
    with serve_batches(AnthropicServer(answer=_kept(requests))) as server:
        _ask(server, frames[0], "What?", options={"prompt_cache": prompt_cache})
    assert requests[0]["messages"][0]["content"][0].get("cache_control") == expected


def test_cached_tokens_are_counted_and_priced():
    prices = {
        "price_per_m_input": 4,
        "price_per_m_cached": 0.4,
        "price_per_m_cache_write": 5,
        "price_per_m_output": 20,
    }
    with serve_batches(AnthropicServer(answer=lambda _: message())) as server:
        reply = _ask(server, options=prices)
    assert (reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens) == (100, 20, 10)
    assert reply.cost == pytest.approx((30 * 4 + 20 * 0.4 + 50 * 5 + 10 * 20) / 1e6)


@pytest.mark.parametrize(
    ("outcome", "expected"),
    [
        (errored(400, "invalid_request_error", "image exceeds 5 MB"), "answers 400 Bad Request"),
        (errored(401, "authentication_error"), "a valid key"),
        (errored(413, "request_too_large"), "use fewer frames, or set image_format=jpeg"),
        (message("", content=[], stop_reason="refusal"), "the server's classifiers stopped it"),
        (message("", content=[], stop_reason="max_tokens"), "give --max-thinking-tokens N"),
        ({"content": []}, "does not answer with a message"),
    ],
)
def test_what_is_no_reply_is_one_line(outcome, expected):
    with (
        serve_batches(AnthropicServer(answer=lambda _: outcome)) as server,
        pytest.raises(ModelError) as caught,
    ):
        _ask(server)
    assert expected in str(caught.value)
    assert server.n_asked == 1


@pytest.mark.parametrize(
    "outcome",
    [
        errored(429, "rate_limit_error"),
        errored(500, "api_error"),
        errored(529, "overloaded_error"),
        (500, message("It", stop_reason="error")),
        (500, errored(200, "overloaded_error", "Overloaded")[1]),
    ],
)
def test_what_passes_is_sent_again_and_told(outcome):
    is_inside = "stop_reason" in outcome[1] or outcome[1]["error"]["message"] == "Overloaded"
    outcomes = iter([outcome[1] if is_inside else outcome])
    with serve_batches(AnthropicServer(answer=lambda _: next(outcomes, message()))) as server:
        reply = _ask(server)
    assert reply.text == "yes"
    assert ("a 200" in reply.faults[0]) == is_inside
    assert len(reply.faults) == 1
    assert f"answers {outcome[0]}" in reply.faults[0]


@pytest.mark.parametrize(
    ("usage", "counts"),
    [
        ({"input_tokens": 30, "output_tokens": 10}, (30, 10, None)),
        (
            {"input_tokens": 30, "output_tokens": 10, "cache_read_input_tokens": None},
            (30, 10, None),
        ),
        ({"input_tokens": 30.0, "output_tokens": 10, "cache_read_input_tokens": 0}, (30, 10, 0)),
        ({}, (None, None, None)),
        ({"input_tokens": -1, "output_tokens": 10}, (None, None, None)),
        ({"cache_read_input_tokens": 5, "output_tokens": 10}, (5, 10, 5)),
        ("many", (None, None, None)),
    ],
)
def test_no_usage_takes_the_reply_with_it(usage, counts):
    with serve_batches(AnthropicServer(answer=lambda _: message(usage=usage))) as server:
        reply = _ask(server)
    assert (reply.n_context_tokens, reply.n_reply_tokens, reply.n_cached_tokens) == counts


def test_thoughts_are_told_apart_and_refusals_in_words_are_replies():
    blocks = [
        {"type": "thinking", "thinking": "A mug?", "signature": "x"},
        {"type": "text", "text": "a cup"},
    ]
    with serve_batches(AnthropicServer(answer=lambda _: message(content=blocks))) as server:
        reply = _ask(server)
    assert (reply.text, reply.thinking) == ("a cup", "A mug?")
    refused = message("I will not", stop_reason="refusal")
    with serve_batches(AnthropicServer(answer=lambda _: refused)) as server:
        assert _ask(server).text == "I will not"


def test_the_key_goes_into_the_head_alone(monkeypatch):
    monkeypatch.setenv("ANTHROPIC_API_KEY", KEY)
    heard = []

    class Listening(AnthropicServer):
        def answer_to(self, method, path, headers, body):
            heard.append((headers["x-api-key"], headers["Authorization"], KEY in str(body)))
            return super().answer_to(method, path, headers, body)

    with serve_batches(Listening(answer=lambda _: message(f"{KEY}!"))) as server:
        assert _ask(server).text == "[key]!"
    assert heard == [(KEY, None, False)]


def test_a_temperature_that_is_not_taken_is_refused():
    with (
        serve_batches(AnthropicServer()) as server,
        pytest.raises(ModelError, match="anthropic takes temperatures up to 1; lower it"),
    ):
        _ask(server, temperature=1.5)


@given(st.binary(max_size=200) | st.text(max_size=80).map(str.encode))
def test_no_bytes_are_a_traceback(content):
    try:
        decode_reply("here", content, Message, "a message").text("here")
    except ModelError as error:
        assert "\n" not in str(error)


def test_questions_are_asked_in_a_batch(ask, tmp_path):
    prices = {"price_per_m_input": 2, "price_per_m_cached": 0.2, "price_per_m_output": 10}
    with serve_batches(AnthropicServer(answer=lambda _: message())) as server:
        code, out, err = ask(server, model="anthropic", batch_requests=2, **prices)
        assert code == 0, err
        assert [n for n, _ in server.sizes] == [2, 2, 1]
        assert server.n_asked == 5
    results = json.loads(next((tmp_path / "out").rglob("results.json")).read_text())
    assert results["usage"]["context"] == 500
    assert "(100 of them cached, 20.0 %)" in out


@pytest.mark.parametrize(
    ("outcome", "code"),
    [
        ("expired", 0),
        ("canceled", 1),
        (errored(429, "rate_limit_error"), 0),
        (errored(529, "overloaded_error"), 0),
        (errored(400, "invalid_request_error"), 1),
    ],
)
def test_lines_without_a_reply_are_asked_again_if_that_may_help(ask, outcome, code):
    outcomes = iter([outcome, outcome])
    with serve_batches(AnthropicServer(answer=lambda _: next(outcomes, message()))) as server:
        assert ask(server, model="anthropic")[0] == code
        assert [n for n, _ in server.sizes] == ([5, 2] if code == 0 else [5])


@pytest.mark.parametrize("looks", [0, 3])
def test_a_batch_whose_name_was_lost_is_found_again(ask, looks):
    with serve_batches(AnthropicServer(answer=lambda _: message(), looks=looks)) as server:
        n_posts = 0

        def lose(method, path):
            nonlocal n_posts
            n_posts += method == "POST"

        answer_to = server.answer_to

        def answer_and_lose(method, path, headers, body):
            answer = answer_to(method, path, headers, body)
            return (0, b"") if method == "POST" and n_posts == 1 else answer

        server.before = lose
        server.answer_to = answer_and_lose
        code, _, err = ask(server, model="anthropic")
    assert code == 0, err
    assert len(server.sizes) == 1
    assert server.n_asked == 5
