"""Models behind a server of the Gemini API, one by one and in batches."""

import base64
import json
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters import check_adapter, load
from model_adapters.served import endpoint
from model_adapters.served.completion import decode_reply
from model_adapters.served.gemini import GeneratedContent

from ...asking import up_to
from ..batches.server import serve_batches
from .server import GeminiServer, content, errored

KEY = "AIza0123456789abcdef0123456789"


def _open(server, **options):
    settings = {"base_url": server.url, "model": "m", "retries": 1, **options}
    return load("gemini", {name: str(value) for name, value in settings.items()}, 0)


def _ask(server, *parts, options=None, **decoding):
    model = _open(server, **(options or {}))
    try:
        talk = model.conversation()
        talk.append(*(parts or ("What is it?",)))
        return talk.reply(up_to(5, **decoding))
    finally:
        model.close()


def _said(body):
    return " ".join(str(abs(hash(repr(body)))))[: body["generationConfig"]["maxOutputTokens"]]


def test_it_keeps_the_contract():
    with serve_batches(GeminiServer(answer=lambda body: content(_said(body)))) as server:
        model = _open(server)
        check_adapter(model)
        model.close()


def test_a_request_is_what_was_said_and_how_it_is_decoded(frames):
    requests = []
    with serve_batches(GeminiServer(answer=lambda body: requests.append(body) or content())) as url:
        model = _open(url, model="models/m")
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], "What is it?")
        talk.append("A mug.", role="assistant")
        talk.append("Where?")
        talk.reply(up_to(7, temperature=0.5, top_p=0.9, seed=2**40 + 5, stop=tuple("abcdef")))
        model.close()
    (request,) = requests
    assert request["systemInstruction"] == {"parts": [{"text": "Be brief."}]}
    assert [turn["role"] for turn in request["contents"]] == ["user", "model", "user"]
    data = request["contents"][0]["parts"][1]["inlineData"]
    assert data["mimeType"] == "image/png"
    seen = np.asarray(Image.open(BytesIO(base64.b64decode(data["data"]))))
    assert (seen == np.asarray(frames[0].load())).all()
    assert request["generationConfig"] == {
        "maxOutputTokens": 7,
        "temperature": 0.5,
        "topP": 0.9,
        "seed": 5,
        "stopSequences": ["a", "b", "c", "d", "e"],
    }


def test_cached_tokens_and_thoughts_are_counted_and_priced():
    prices = {"price_per_m_input": 2, "price_per_m_cached": 0.5, "price_per_m_output": 12}
    with serve_batches(GeminiServer(answer=lambda _: content())) as server:
        reply = _ask(server, options=prices)
    assert (reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens) == (100, 40, 15)
    assert reply.cost == pytest.approx((60 * 2 + 40 * 0.5 + 15 * 12) / 1e6)


@pytest.mark.parametrize(
    ("outcome", "expected"),
    [
        (errored(400, "INVALID_ARGUMENT", "no such field"), "answers 400 Bad Request"),
        (errored(403, "PERMISSION_DENIED"), "a key with access to this model"),
        (content("", "SAFETY"), "the server's content filter blocked it"),
        (content("", "MAX_TOKENS"), "give --max-thinking-tokens N"),
        (
            {"promptFeedback": {"blockReason": "PROHIBITED_CONTENT"}},
            "the server's content filter blocked it",
        ),
        ({}, "gives no text; is it a model that generates text?"),
        ({"candidates": 3}, "does not answer with generated content"),
    ],
)
def test_what_is_no_reply_is_one_line(outcome, expected):
    with (
        serve_batches(GeminiServer(answer=lambda _: outcome)) as server,
        pytest.raises(ModelError) as caught,
    ):
        _ask(server)
    assert expected in str(caught.value)
    assert server.n_asked == 1


def test_a_server_that_is_busy_is_asked_again_when_it_says(monkeypatch):
    waited = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    delay = {"@type": "type.googleapis.com/google.rpc.RetryInfo", "retryDelay": "7.5s"}
    busy = errored(429, "RESOURCE_EXHAUSTED")
    busy[1]["error"]["details"] = [delay]
    outcomes = iter([busy, errored(503, "UNAVAILABLE", "overloaded")])
    with serve_batches(GeminiServer(answer=lambda _: next(outcomes, content()))) as server:
        reply = _ask(server, options={"retries": 2})
    assert len(reply.faults) == 2
    assert 7.5 <= waited[0] < 8.1


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (content("It", "OTHER"), "ended with OTHER"),
        (content("", "MALFORMED_RESPONSE"), "ended with MALFORMED_RESPONSE"),
        (
            errored(503, "UNAVAILABLE", "overloaded")[1],
            "answers 503 Service Unavailable: 'in a 200",
        ),
    ],
)
def test_an_error_in_a_success_is_asked_again(outcome, words):
    outcomes = iter([outcome])
    with serve_batches(GeminiServer(answer=lambda _: next(outcomes, content()))) as server:
        reply = _ask(server)
    assert (reply.text, len(reply.faults)) == ("yes", 1)
    assert words in reply.faults[0]


@pytest.mark.parametrize(
    ("usage", "counts"),
    [
        ({"promptTokenCount": 9, "thoughtsTokenCount": 4.0}, (9, 4, 0)),
        ({"promptTokenCount": 9, "candidatesTokenCount": None}, (None, None, None)),
        ({}, (None, None, None)),
        ([], (None, None, None)),
    ],
)
def test_no_usage_takes_the_reply_with_it(usage, counts):
    said = content(usageMetadata=usage)
    with serve_batches(GeminiServer(answer=lambda _: said)) as server:
        reply = _ask(server)
    assert (reply.n_context_tokens, reply.n_reply_tokens, reply.n_cached_tokens) == counts


def test_thoughts_are_told_apart():
    parts = [{"text": "A mug?", "thought": True}, {"text": "a cup"}]
    said = {"candidates": [{"content": {"parts": parts}, "finishReason": "STOP"}]}
    with serve_batches(GeminiServer(answer=lambda _: said)) as server:
        reply = _ask(server)
    assert (reply.text, reply.thinking, reply.n_reply_tokens) == ("a cup", "A mug?", None)


def test_the_key_goes_into_the_head_alone(monkeypatch):
    monkeypatch.setenv("GEMINI_API_KEY", KEY)
    heard = []

    class Listening(GeminiServer):
        def answer_to(self, method, path, headers, body):
            heard.append((headers["x-goog-api-key"], KEY in path, KEY in str(body)))
            return super().answer_to(method, path, headers, body)

    with serve_batches(Listening(answer=lambda _: content(f"{KEY}!"))) as server:
        assert _ask(server).text == "[key]!"
    assert heard == [(KEY, False, False)]


@given(st.binary(max_size=200) | st.text(max_size=80).map(str.encode))
def test_no_bytes_are_a_traceback(given_bytes):
    try:
        decode_reply("here", given_bytes, GeneratedContent, "content").text("here")
    except ModelError as error:
        assert "\n" not in str(error)


def test_questions_are_asked_in_a_batch(ask, tmp_path):
    server = GeminiServer(answer=lambda _: content(), last_status="succeeded")
    with serve_batches(server):
        code, out, err = ask(server, model="gemini", batch_requests=3)
        assert code == 0, err
        assert [n for n, _ in server.sizes] == [3, 2]
        assert server.n_asked == 5
    results = json.loads(next((tmp_path / "out").rglob("results.json")).read_text())
    assert results["usage"]["context"] == 500
    assert "(200 of them cached, 40.0 %)" in out


@pytest.mark.parametrize(
    ("outcome", "code"),
    [
        (errored(429, "RESOURCE_EXHAUSTED"), 0),
        (errored(503, "UNAVAILABLE"), 0),
        (errored(400, "INVALID_ARGUMENT"), 1),
    ],
)
def test_lines_without_a_reply_are_asked_again_if_that_may_help(ask, outcome, code):
    outcomes = iter([outcome, outcome])
    server = GeminiServer(answer=lambda _: next(outcomes, content()), last_status="succeeded")
    with serve_batches(server):
        assert ask(server, model="gemini")[0] == code
        assert [n for n, _ in server.sizes] == ([5, 2] if code == 0 else [5])


def test_a_batch_that_expires_is_asked_again_and_one_that_fails_ends_the_run(ask):
    server = GeminiServer(answer=lambda _: content(), last_status="expired")
    statuses = iter(["expired", "succeeded"])
    finish = server.finish

    def finish_as_told(batch):
        server.last_status = next(statuses, server.last_status)
        finish(batch)

    server.finish = finish_as_told
    with serve_batches(server):
        code, _, err = ask(server, model="gemini")
        assert code == 0, err
        assert "0 answered, 5 not (the batch is expired)" in err
        assert server.n_asked == 5
        server.last_status, server.errors = "failed", [{"code": 3, "message": "bad file"}]
        code, _, err = ask(server, "--fresh", model="gemini")
    assert code == 2
    assert "refuses batch batches/" in err and "bad file; fix it" in err


def test_a_batch_whose_name_was_lost_is_found_again(ask):
    server = GeminiServer(answer=lambda _: content(), last_status="succeeded")
    with serve_batches(server):
        answer_to = server.answer_to
        lost = iter([True])

        def answer_and_lose(method, path, headers, body):
            answer = answer_to(method, path, headers, body)
            is_lost = path.endswith(":batchGenerateContent") and next(lost, False)
            return (0, b"") if is_lost else answer

        server.answer_to = answer_and_lose
        code, _, err = ask(server, model="gemini")
    assert code == 0, err
    assert len(server.sizes) == 1
