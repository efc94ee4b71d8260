"""Servers that are down, busy, slow or endless: all ends in bounded time and memory."""

import socket
import struct
import threading
import time
from contextlib import suppress
from email.utils import formatdate

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_eval.errors import ModelError
from model_adapters.served import endpoint, wire

from ..policies.servers import send
from .talking import (
    always_send,
    ask_once,
    completion,
    keep_requests,
    open_model,
    read_refusal,
    talkative,
)


def _resets(_request, handler):
    handler.close_connection = True
    handler.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    handler.connection.close()


def _cut_off(_request, handler):
    handler.close_connection = True
    send(handler, 200, b'{"choices": [', length=100)


def _babbles(_request, handler):
    handler.close_connection = True
    handler.wfile.write(b"SSH-2.0-OpenSSH_9.6\r\n\r\n")


def _in_a_200(choice):
    return lambda *_: completion() | {"choices": [choice]}


PASSING = {
    "500": (
        always_send(500, b"CUDA out\nof memory"),
        "answers 500 Internal Server Error: 'CUDA out of memory'",
    ),
    "503": (
        always_send(503, b"", {"Retry-After": "0"}),
        "answers 503 Service Unavailable: nothing",
    ),
    "429": (
        always_send(429, b"slow down", {"Retry-After": "0"}),
        "answers 429 Too Many Requests: 'slow down'",
    ),
    "429 until": (
        always_send(429, b"", {"Retry-After": formatdate(0, usegmt=True)}),
        "answers 429",
    ),
    "429 in words": (always_send(429, b"", {"Retry-After": "soon"}), "answers 429"),
    "408": (always_send(408, b""), "answers 408 Request Timeout: nothing"),
    "529": (always_send(529, b""), "answers 529: nothing"),
    "an error in a choice": (
        _in_a_200(
            completion("It", finish_reason="error")["choices"][0]
            | {"error": {"code": 502, "message": "upstream died"}}
        ),
        """answers 502 Bad Gateway: 'in a 200: {"code": 502, "message": "upstream died"}'""",
    ),
    "an error without a status": (
        _in_a_200(completion("", finish_reason="error")["choices"][0] | {"error": "gone"}),
        """answers 500 Internal Server Error: 'in a 200: "gone"'""",
    ),
    "an error alone": (
        lambda *_: {"error": {"code": 503, "message": "no provider"}, "choices": None},
        """answers 503 Service Unavailable: 'in a 200: {"code": 503, "message": "no provider"}'""",
    ),
    "an error beside an end that is none": (
        lambda *_: completion("It", finish_reason=None) | {"error": {"code": "server_error"}},
        "answers 500 Internal Server Error: 'in a 200: {",
    ),
    **{
        ending: (
            _in_a_200(completion("It", finish_reason=ending)["choices"][0]),
            f"answers 500 Internal Server Error: 'a 200 that ended with {ending}'",
        )
        for ending in ("error", "abort", "network_error", "insufficient_system_resource")
    },
    "reset": (_resets, "cannot be reached ("),
    "cut off": (_cut_off, "cannot be reached ("),
    "no HTTP": (_babbles, "cannot be reached ("),
}


@pytest.mark.parametrize("fault", PASSING)
def test_what_passes_is_sent_again_and_told(fault):
    fail, message = PASSING[fault]
    asked = []

    def fail_twice(request, handler):
        return (fail if len(asked) < 3 else talkative)(request, handler)

    answer = keep_requests(asked, fail_twice)
    with open_model(answer, retries=2) as model:
        reply = ask_once(model)
    assert len(asked) == 3
    assert len(reply.faults) == 2
    for line in reply.faults:
        assert message in line
        assert line.startswith("http://127.0.0.1:")
        assert "\n" not in line
    asked.clear()
    assert message in (line := read_refusal(answer, retries=1))
    assert ", in 2 attempts; " in line
    assert len(asked) == 2


@pytest.mark.parametrize(
    ("code", "hint"), [(400, "check"), (401, "set the environment variable"), (402, "check your")]
)
def test_what_does_not_pass_is_not_asked_again_inside_a_200_either(code, hint):
    asked, said = [], {"error": {"code": code, "message": "no such fridge"}}
    line = read_refusal(keep_requests(asked, lambda *_: said), retries=3)
    assert f"answers {code} " in line and "no such fridge" in line and hint in line
    assert len(asked) == 1


@pytest.mark.parametrize(
    "document",
    [
        completion() | {"error": None},
        completion() | {"error": {}},
        completion() | {"error": {"message": "a warning"}},
        completion() | {"choices": [completion()["choices"][0] | {"error": {"code": 500}}]},
        completion(finish_reason="strange"),
    ],
)
def test_a_reply_that_ended_well_is_none(document):
    with open_model(lambda *_: document) as model:
        assert ask_once(model).text == "yes"


def test_a_server_that_is_down_is_not_waited_for_by_every_unit():
    down, asked = True, []

    def answer(request, handler):
        return send(handler, 503, b"") if down else talkative(request, handler)

    with open_model(keep_requests(asked, answer), retries=3) as model:
        for n_expected in (4, 5, 6):
            with pytest.raises(ModelError, match="answers 503"):
                ask_once(model)
            assert len(asked) == n_expected
        down = False
        assert ask_once(model).faults == ()
        down = True
        with pytest.raises(ModelError, match="in 4 attempts"):
            ask_once(model)


def test_a_server_that_is_only_busy_is_asked_as_patiently_by_every_unit():
    asked = []
    with open_model(keep_requests(asked, always_send(429, b"slow down")), retries=2) as model:
        for n_expected in (3, 6):
            with pytest.raises(
                ModelError, match="answers 429 Too Many Requests: 'slow down', in 3 attempts; lower"
            ):
                ask_once(model)
            assert len(asked) == n_expected


def test_a_server_that_is_not_there_is_one_line():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        where = f"http://127.0.0.1:{taken.getsockname()[1]}/v1"
        with (
            open_model(talkative, base_url=where, retries=1) as model,
            pytest.raises(ModelError) as caught,
        ):
            ask_once(model)
    assert str(caught.value).startswith(f"{where} cannot be reached (")
    assert str(caught.value).endswith("in 2 attempts; is the server up?")


@pytest.mark.parametrize("proxy", ["http://127.0.0.1:999999", "http://a..b", "garbage"])
def test_a_proxy_that_is_not_there_is_one_line(proxy, monkeypatch):
    monkeypatch.setenv("ALL_PROXY", proxy)
    with (
        open_model(base_url="https://none.example/v1", retries=0) as model,
        pytest.raises(
            ModelError, match=r"^https://none.example/v1 cannot be reached \(.*is the server up"
        ),
    ):
        ask_once(model)


def test_a_wait_that_the_server_asks_for_is_kept(monkeypatch):
    waited = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    answers = [
        always_send(429, b"", {"Retry-After": "7"}),
        always_send(429, b"", {"retry-after-ms": "1500"}),
        always_send(503, b"", {"Retry-After": formatdate(time.time() + 30, usegmt=True)}),
        talkative,
    ]

    def answer(request, handler):
        return answers.pop(0)(request, handler)

    with open_model(answer, retries=4) as model:
        ask_once(model)
    assert waited[:2] == pytest.approx([7, 1.5], abs=0.1)
    assert 15 < waited[2] <= 30  # until a time of day, which comes nearer while the machine is busy


def test_without_one_each_wait_is_longer(monkeypatch):
    waited = []
    monkeypatch.setattr(endpoint.time, "sleep", waited.append)
    monkeypatch.setattr(endpoint, "_FIRST_WAIT_S", 0.5)
    read_refusal(always_send(500, b""), retries=10)
    assert len(waited) == 10
    assert waited[:4] == pytest.approx([0.5, 1, 2, 4], rel=0.25)
    assert max(waited) <= 75


@pytest.mark.parametrize("retry_after", ["100000", "9" * 400])
def test_a_wait_without_end_is_not_kept(retry_after):
    message = read_refusal(
        always_send(429, b"come back later", {"Retry-After": retry_after}), retries=3
    )
    assert "answers 429 Too Many Requests: 'come back later', and asks to wait " in message
    assert "run the same command again then" in message


@settings(max_examples=200)
@given(st.sampled_from(["retry-after", "retry-after-ms"]), st.text(max_size=20))
def test_no_head_is_a_traceback(name, value):
    waited = endpoint._retry_after_s({name: value})
    assert waited is None or waited >= 0


@pytest.mark.parametrize(
    "slow", ["before it answers", "in the head", "in the body", "in the body of an error"]
)
def test_a_server_that_takes_too_long_is_given_up_in_the_end(slow):
    done = threading.Event()

    def drip(_request, handler):
        handler.close_connection = True
        if slow == "in the head":
            handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
        elif slow != "before it answers":
            send(handler, 400 if "error" in slow else 200, b'{"choices": [', length=10**6)
        while not done.wait(0.02):
            if slow != "before it answers":
                handler.wfile.write(b"X-More: 1\r\n" if slow == "in the head" else b" ")

    def answer(request, handler):
        with suppress(OSError):  # it was given up
            drip(request, handler)

    try:
        message = read_refusal(answer, timeout_s=0.3, retries=1)
    finally:
        done.set()
    assert "does not answer within 0.3 s, in 2 attempts; raise timeout_s if it is slow" in message


@pytest.mark.parametrize("status", [200, 400, 500])
def test_a_reply_without_end_is_not_read(status, monkeypatch):
    monkeypatch.setattr(wire, "_LARGEST", 1000)
    n_sent = 0

    def answer(_request, handler):
        nonlocal n_sent
        handler.close_connection = True
        handler.send_response(status)
        handler.end_headers()
        with suppress(OSError):  # nobody reads on
            for _ in range(10_000):
                n_sent += handler.wfile.write(b" " * 10_000)

    assert "answers more than 1000 bytes" in read_refusal(answer, retries=3)
    assert n_sent < 50_000_000


def test_a_head_without_end_is_not_read():
    def answer(_request, handler):
        handler.close_connection = True
        with suppress(OSError):
            handler.wfile.write(b"HTTP/1.1 200 OK\r\n" + b"X-More: 1\r\n" * 10**6)

    assert "cannot be reached (" in read_refusal(answer)
