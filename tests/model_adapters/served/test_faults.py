"""Servers that fail in every way: each ends in one line, in bounded time and memory, and what
passes is survived."""

import json
import socket
import struct
import threading
import time
from contextlib import suppress
from email.utils import formatdate
from http.server import BaseHTTPRequestHandler
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters import Decoding, Reply
from model_adapters.served import endpoint, wire
from model_adapters.served.openai.completions import read_completion

from ..policies.servers import Answer, send
from .talking import always_say, completion, open_model, talkative

KEY = "sk-0123456789abcdef0123456789"
Handler = BaseHTTPRequestHandler


def _ask(model: Any) -> Reply:
    talk = model.conversation()
    talk.append("What is it?")
    return talk.reply(Decoding(max_new_tokens=5))


def _refused(answer: Answer, **options: object) -> str:
    with open_model(answer, **options) as model, pytest.raises(ModelError) as caught:
        _ask(model)
    message = str(caught.value)
    assert message.startswith("http://127.0.0.1:")
    assert "\n" not in message
    assert "; " in message  # a mend
    assert len(message) < 600
    return message


def _sends(status: int, body: bytes, headers: dict[str, str] | None = None) -> Answer:
    def answer(_request: Any, handler: Handler) -> None:
        handler.send_response(status)
        for name, value in {"Content-Length": str(len(body)), **(headers or {})}.items():
            handler.send_header(name, value)
        handler.end_headers()
        handler.wfile.write(body)

    return answer


def _answers(document: Any) -> Answer:
    return lambda *_: document


def _with_usage(**changes: Any) -> dict[str, Any]:
    document = completion()
    document["usage"] |= changes
    return document


SHAPES: dict[str, tuple[Answer, str]] = {
    "nothing": (
        _sends(200, b""),
        "does not answer with a chat completion (Input data was truncated)",
    ),
    "no content": (_sends(204, b""), "does not answer with a chat completion"),
    "no JSON": (
        _sends(200, b"<html>hello</html>", {"Content-Type": "text/html"}),
        "with a chat completion (JSON is",
    ),
    "no text": (_sends(200, b"\xff\xfe\x00" * 9), "does not answer with a chat completion"),
    "deep": (_sends(200, b"[" * 200_000), "does not answer with a chat completion"),
    "half": (
        _sends(200, json.dumps(completion()).encode()[:-20]),
        "does not answer with a chat completion",
    ),
    "a list": (_answers([completion()]), "(Expected `object`, got `array`)"),
    "a stream": (
        _sends(200, b"data: {}\n\ndata: [DONE]\n\n", {"Content-Type": "text/event-stream"}),
        "does not answer with a chat completion",
    ),
    "another object": (_answers({"detail": "hello"}), "(Object missing required field `choices`)"),
    "choices of another type": (
        _answers(completion() | {"choices": "yes"}),
        "(Expected `array`, got `str` - at",
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
        "(Expected `str | null`, got `int` - at",
    ),
    "half a pair": (
        _sends(200, json.dumps(completion("\ud800")).encode()),
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
    "tokens below 0": (
        _answers(_with_usage(prompt_tokens=-1)),
        "(Expected `int` >= 0 - at `$.usage.prompt_tokens`)",
    ),
    "tokens in words": (
        _answers(_with_usage(completion_tokens="2")),
        "(Expected `int`, got `str` - at",
    ),
    "tokens without end": (
        _answers(_with_usage(prompt_tokens=10**40)),
        "does not answer with a chat completion",
    ),
    "a redirect": (
        _sends(307, b"", {"Location": "http://127.0.0.1:1/v1"}),
        "answers 307 Temporary Redirect: nothing; r",
    ),
    "a redirect for good": (_sends(301, b"", {"Location": "/v1"}), "redirects are not followed"),
    "no such model": (
        _sends(404, b'{"error": {"message": "no m"}}'),
        'answers 404 Not Found: \'{"error": {"message"',
    ),
    "a bad request": (
        _sends(400, b"top_p\nis not taken"),
        "answers 400 Bad Request: 'top_p is not taken'; check",
    ),
    "too many frames for vLLM": (
        _sends(400, b"At most 2 image(s) may be provided in one prompt."),
        "in one prompt.'; start the server with a higher --limit-mm-per-prompt",
    ),
    "a key that is not taken": (
        _sends(401, b"who?"),
        "answers 401 Unauthorized: 'who?'; set the environment variable",
    ),
    "another status": (_sends(499, b""), "answers 499: nothing; check"),
    "no money": (
        _sends(429, b'{"error": {"code": "insufficient_quota"}}'),
        "answers 429 Too Many Requests",
    ),
    "packed": (
        _sends(200, b"\x1f\x8b", {"Content-Encoding": "gzip"}),
        "answers in an encoding that was not requested",
    ),
    "strange letters": (
        _sends(418, b"\xff\xfe", {"Content-Type": "text/plain; charset=none-such"}),
        "answers 418",
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_reply_of_any_shape_is_one_line_and_not_asked_for_again(shape: str) -> None:
    answer, message = SHAPES[shape]
    n_asked = 0

    def counted(request: Any, handler: Handler) -> Any:
        nonlocal n_asked
        n_asked += 1
        return answer(request, handler)

    assert message in _refused(counted, retries=3)
    assert n_asked == 1


@given(st.binary(max_size=200) | st.text(max_size=80).map(str.encode))
def test_no_bytes_are_a_traceback(content: bytes) -> None:
    try:
        read_completion("here", content).text("here")
    except ModelError as error:
        assert "\n" not in str(error)


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner, max_size=2)
    ),
    max_leaves=4,
)


@settings(max_examples=200)
@given(st.data())
def test_no_document_is_a_traceback(data: st.DataObject) -> None:
    document = completion()
    place = data.draw(
        st.sampled_from([(), ("choices",), ("usage",), ("choices", 0), ("choices", 0, "message")])
    )
    within: Any = document
    for step in place:
        within = within[step]
    key = data.draw(st.sampled_from(sorted(within))) if isinstance(within, dict) else 0
    within[key] = data.draw(_VALUES)
    try:
        text = read_completion("here", json.dumps(document).encode()).text("here")
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
        (completion("yes", usage=None), "yes"),
        (
            completion("yes")
            | {"choices": [*completion("yes")["choices"], *completion("no")["choices"]]},
            "yes",
        ),
        (completion("yes") | {"extra": [1, {"more": None}]}, "yes"),
    ],
)
def test_what_was_said_is_the_reply(document: dict[str, Any], text: str) -> None:
    with open_model(_answers(document)) as model:
        assert _ask(model).text == text


def _resets(_request: Any, handler: Handler) -> None:
    handler.close_connection = True
    handler.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    handler.connection.close()


def _cut_off(_request: Any, handler: Handler) -> None:
    handler.close_connection = True
    send(handler, 200, b'{"choices": [', length=100)


def _babbles(_request: Any, handler: Handler) -> None:
    handler.close_connection = True
    handler.wfile.write(b"SSH-2.0-OpenSSH_9.6\r\n\r\n")


PASSING: dict[str, tuple[Answer, str]] = {
    "500": (
        _sends(500, b"CUDA out\nof memory"),
        "answers 500 Internal Server Error: 'CUDA out of memory'",
    ),
    "503": (_sends(503, b"", {"Retry-After": "0"}), "answers 503 Service Unavailable: nothing"),
    "429": (
        _sends(429, b"slow down", {"Retry-After": "0"}),
        "answers 429 Too Many Requests: 'slow down'",
    ),
    "429 until": (_sends(429, b"", {"Retry-After": formatdate(0, usegmt=True)}), "answers 429"),
    "429 in words": (_sends(429, b"", {"Retry-After": "soon"}), "answers 429"),
    "408": (_sends(408, b""), "answers 408 Request Timeout: nothing"),
    "529": (_sends(529, b""), "answers 529: nothing"),
    "reset": (_resets, "cannot be reached ("),
    "cut off": (_cut_off, "cannot be reached ("),
    "no HTTP": (_babbles, "cannot be reached ("),
}


@pytest.mark.parametrize("fault", PASSING)
def test_what_passes_is_sent_again_and_told(fault: str) -> None:
    fail, message = PASSING[fault]
    n_asked = 0

    def answer(request: Any, handler: Handler) -> Any:
        nonlocal n_asked
        n_asked += 1
        return fail(request, handler) if n_asked < 3 else talkative(request, handler)

    with open_model(answer, retries=2) as model:
        reply = _ask(model)
    assert n_asked == 3
    assert len(reply.faults) == 2
    for line in reply.faults:
        assert message in line
        assert line.startswith("http://127.0.0.1:")
        assert "\n" not in line
    n_asked = 0
    assert f"{message}" in (line := _refused(answer, retries=1))
    assert ", in 2 attempts; " in line
    assert n_asked == 2


def test_a_server_that_is_down_is_not_waited_for_by_every_unit() -> None:
    down, n_asked = True, 0

    def answer(request: Any, handler: Handler) -> Any:
        nonlocal n_asked
        n_asked += 1
        return send(handler, 503, b"") if down else talkative(request, handler)

    with open_model(answer, retries=3) as model:
        for n_expected in (4, 5, 6):
            with pytest.raises(ModelError, match="answers 503"):
                _ask(model)
            assert n_asked == n_expected
        down = False
        assert _ask(model).faults == ()
        down = True
        with pytest.raises(ModelError, match="in 4 attempts"):
            _ask(model)


def test_a_server_that_is_only_busy_is_asked_as_patiently_by_every_unit() -> None:
    n_asked = 0

    def answer(_request: Any, handler: Handler) -> None:
        nonlocal n_asked
        n_asked += 1
        send(handler, 429, b"slow down")

    with open_model(answer, retries=2) as model:
        for n_expected in (3, 6):
            with pytest.raises(
                ModelError, match="answers 429 Too Many Requests: 'slow down', in 3 attempts; lower"
            ):
                _ask(model)
            assert n_asked == n_expected


def test_a_server_that_is_not_there_is_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        where = f"http://127.0.0.1:{taken.getsockname()[1]}/v1"
        with (
            open_model(talkative, base_url=where, retries=1) as model,
            pytest.raises(ModelError) as caught,
        ):
            _ask(model)
    assert str(caught.value).startswith(f"{where} cannot be reached (")
    assert str(caught.value).endswith("in 2 attempts; is the server up?")


def test_a_wait_that_the_server_asks_for_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    answers: list[Answer] = [
        _sends(429, b"", {"Retry-After": "7"}),
        _sends(429, b"", {"retry-after-ms": "1500"}),
        _sends(503, b"", {"Retry-After": formatdate(time.time() + 30, usegmt=True)}),
        talkative,
    ]

    def answer(request: Any, handler: Handler) -> Any:
        return answers.pop(0)(request, handler)

    with open_model(answer, retries=4) as model:
        _ask(model)
    assert waited[:2] == pytest.approx([7, 1.5], abs=0.1)
    assert 15 < waited[2] <= 30  # until a time of day, which comes nearer while the machine is busy


def test_without_one_each_wait_is_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    monkeypatch.setattr(endpoint, "_FIRST_WAIT_S", 0.5)
    _refused(_sends(500, b""), retries=10)
    assert len(waited) == 10
    assert waited[:4] == pytest.approx([0.5, 1, 2, 4], rel=0.25)
    assert max(waited) <= 75


@pytest.mark.parametrize("retry_after", ["100000", "9" * 400])
def test_a_wait_without_end_is_not_kept(retry_after: str) -> None:
    message = _refused(_sends(429, b"come back later", {"Retry-After": retry_after}), retries=3)
    assert "answers 429 Too Many Requests: 'come back later', and asks to wait " in message
    assert "run the same command again then" in message


@settings(max_examples=200)
@given(st.sampled_from(["retry-after", "retry-after-ms"]), st.text(max_size=20))
def test_no_head_is_a_traceback(name: str, value: str) -> None:
    waited = endpoint._retry_after_s({name: value})
    assert waited is None or waited >= 0


@pytest.mark.parametrize(
    "slow", ["before it answers", "in the head", "in the body", "in the body of an error"]
)
def test_a_server_that_takes_too_long_is_given_up_in_the_end(slow: str) -> None:
    done = threading.Event()

    def drip(_request: Any, handler: Handler) -> None:
        handler.close_connection = True
        if slow == "in the head":
            handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
        elif slow != "before it answers":
            send(handler, 400 if "error" in slow else 200, b'{"choices": [', length=10**6)
        while not done.wait(0.02):
            if slow != "before it answers":
                handler.wfile.write(b"X-More: 1\r\n" if slow == "in the head" else b" ")

    def answer(request: Any, handler: Handler) -> None:
        with suppress(OSError):  # it was given up
            drip(request, handler)

    try:
        message = _refused(answer, timeout_s=0.3, retries=1)
    finally:
        done.set()
    assert "does not answer within 0.3 s, in 2 attempts; raise timeout_s if it is slow" in message


@pytest.mark.parametrize("status", [200, 400, 500])
def test_a_reply_without_end_is_not_read(status: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire, "_LARGEST", 1000)
    n_sent = 0

    def answer(_request: Any, handler: Handler) -> None:
        nonlocal n_sent
        handler.close_connection = True
        handler.send_response(status)
        handler.end_headers()
        with suppress(OSError):  # nobody reads on
            for _ in range(10_000):
                n_sent += handler.wfile.write(b" " * 10_000)

    assert "answers more than 1000 bytes" in _refused(answer, retries=3)
    assert n_sent < 50_000_000


def test_a_head_without_end_is_not_read() -> None:
    def answer(_request: Any, handler: Handler) -> None:
        handler.close_connection = True
        with suppress(OSError):
            handler.wfile.write(b"HTTP/1.1 200 OK\r\n" + b"X-More: 1\r\n" * 10**6)

    assert "cannot be reached (" in _refused(answer)


@pytest.mark.parametrize("status", [200, 400, 401, 429, 500])
def test_a_server_that_says_the_key_again_does_not_have_it_told(
    status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    heard = []

    def answer(_request: Any, handler: Handler) -> Any:
        heard.append(handler.headers["Authorization"])
        if status == 200:
            return completion(f"The key is {heard[0]}.")
        return send(handler, status, f"wrong key: {'x' * 170} {heard[0]}".encode())

    if status == 200:
        with open_model(answer) as model:
            message = _ask(model).text
        assert message == "The key is Bearer [key]."
    else:
        message = _refused(answer)
    assert set(heard) == {f"Bearer {KEY}"}
    assert KEY[:8] not in message


def test_a_short_key_keeps_no_secret(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "mug")
    with open_model(always_say("a mug")) as model:
        assert _ask(model).text == "a mug"
