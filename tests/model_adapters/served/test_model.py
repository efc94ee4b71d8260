"""A model behind a server that answers, as the harness talks to it."""

import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from infthor_eval.errors import ModelError
from model_adapters import check_adapter, load
from model_adapters.served import model as served

from ..asking import up_to
from .talking import (
    always_say,
    completion,
    images_in,
    keep_requests,
    open_model,
    serve_chat,
    talkative,
)

KEY = "sk-0123456789abcdef0123456789"


def _ask(model, *parts, decoding=None):
    talk = model.conversation()
    talk.append(*parts)
    return talk.reply(decoding or up_to(5))


def test_it_keeps_the_contract():
    with open_model() as model:
        check_adapter(model)


def test_it_keeps_the_contract_of_choices_where_the_server_holds_replies_to_them():
    def answer(request, handler):
        if "structured_outputs" in request:
            return completion(request["structured_outputs"]["choice"][0])
        return talkative(request, handler)

    with open_model(answer, guided="vllm") as model:
        check_adapter(model)


def test_a_request_is_what_was_said_and_how_it_is_decoded(frames):
    requests = []
    with open_model(keep_requests(requests)) as model:
        talk = model.conversation()
        talk.append("Be brief.", role="system")
        talk.append("Look:", frames[0], frames[1], "What is it?")
        talk.reply(up_to(5))
        talk.append("A mug.", role="assistant")
        talk.append("Where?")
        talk.reply(up_to(7, temperature=0.5, top_p=0.9, seed=2**63 + 5, stop=tuple("abcdef")))
    first, second = requests
    assert {name for name in first if name != "headers"} == {
        "model",
        "messages",
        "max_tokens",
        "temperature",
    }
    assert (first["model"], first["max_tokens"], first["temperature"]) == ("m", 5, 0)
    assert [message["role"] for message in first["messages"]] == ["system", "user"]
    assert [part["type"] for part in first["messages"][1]["content"]] == [
        "text",
        "image_url",
        "image_url",
        "text",
    ]
    for image, frame in zip(images_in(first), frames, strict=False):
        assert (np.asarray(image) == np.asarray(frame.load())).all()
    assert second["messages"][:2] == first["messages"]
    assert second["messages"][2:] == [
        {"role": "assistant", "content": "A mug."},
        {"role": "user", "content": "Where?"},
    ]
    assert (second["temperature"], second["top_p"], second["seed"]) == (0.5, 0.9, 5)
    # More are not taken; the reply is cut here in any case.
    assert second["stop"] == ["a", "b", "c", "d"]
    assert "authorization" not in first["headers"]


def test_what_a_server_does_not_take_is_not_sent():
    requests = []
    without = {
        "send_seed": False,
        "send_stop": False,
        "send_temperature": False,
        "send_repetition_penalty": False,
    }
    with open_model(
        keep_requests(requests, always_say("x")),
        max_tokens_field="max_completion_tokens",
        **without,
    ) as model:
        _ask(
            model, "What?", decoding=up_to(5, temperature=0.5, stop=("b",), repetition_penalty=1.0)
        )
    assert {name for name in requests[0] if name != "headers"} == {
        "model",
        "messages",
        "max_completion_tokens",
    }


def test_a_penalty_is_sent_where_one_is_asked_for():
    requests = []
    with open_model(keep_requests(requests, always_say("x"))) as model:
        _ask(model, "What?", decoding=up_to(5, repetition_penalty=1.0))
        _ask(model, "What?", decoding=up_to(5))
    assert [request.get("repetition_penalty") for request in requests] == [1.0, None]


@pytest.mark.parametrize(("sent", "expected"), [(True, [False, None]), (False, [None, None])])
def test_special_tokens_are_asked_for_where_one_may_stop_a_reply(sent, expected):
    requests = []
    with open_model(
        keep_requests(requests, always_say("x")), send_skip_special_tokens=sent
    ) as model:
        for stop in (("<|act|>",), ()):
            _ask(model, "What?", decoding=up_to(5, stop=stop))
        assert model.identity().get("send_skip_special_tokens") == (None if sent else False)
    assert [request.get("skip_special_tokens") for request in requests] == expected


def test_the_key_goes_into_the_head_alone(monkeypatch):
    monkeypatch.setenv("OTHER_KEY", f" {KEY}\n")
    requests = []
    with open_model(keep_requests(requests), api_key_env="OTHER_KEY") as model:
        _ask(model, "What?")
        descriptions = [repr(model), str(vars(model)), str(model.identity()), repr(model._secret)]
    assert requests[0]["headers"].pop("authorization") == f"Bearer {KEY}"
    assert KEY not in repr(requests)
    assert KEY not in "".join(descriptions)


@pytest.mark.parametrize("value", ["", "  ", "two words", "schlüssel-schlüssel"])
def test_a_missing_or_broken_key_is_one_line(value, monkeypatch):
    monkeypatch.setenv("MY_KEY", value)
    with pytest.raises(
        ModelError, match="the environment variable that api_key_env names holds no key"
    ) as caught:
        load("openai", {"model": "m", "api_key_env": "MY_KEY"}, 0)
    assert "MY_KEY" not in str(caught.value)  # it may be the key, put in the wrong place


def test_stop_strings_cut_whatever_the_server_does():
    with open_model(always_say("MoveAhead<|act|>and more\nyes")) as model:
        assert _ask(model, "What?", decoding=up_to(9, stop=("\n", "<|act|>"))).text == "MoveAhead"


def test_tokens_and_cost_are_told_with_the_reply():
    prices = {"price_per_m_input": 2, "price_per_m_cached": 0.5, "price_per_m_output": 8}
    with open_model(lambda *_: completion("yes", (1000, 10, 400)), **prices) as model:
        reply = _ask(model, "What?")
    assert (reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens) == (1000, 400, 10)
    assert reply.cost == pytest.approx((600 * 2 + 400 * 0.5 + 10 * 8) / 1e6)
    with open_model(lambda *_: completion("yes", (1000, 10))) as model:
        reply = _ask(model, "What?")
    assert (reply.n_context_tokens, reply.n_cached_tokens, reply.cost) == (1000, None, None)
    with open_model(
        lambda *_: completion("yes", None), price_per_m_input=1, price_per_m_output=1
    ) as model:
        reply = _ask(model, "What?")
    assert (reply.n_context_tokens, reply.n_reply_tokens, reply.cost) == (None, None, None)


def test_a_reply_that_cannot_be_used_is_paid_for_all_the_same():
    with open_model(lambda *_: completion(None, (100, 10)), max_tokens_total=200) as model:
        for _ in range(2):
            with pytest.raises(ModelError, match="gives no text"):
                _ask(model, "What?")
        with pytest.raises(ModelError, match="not asked: 220 tokens reach max_tokens_total=200"):
            _ask(model, "What?")


def test_a_server_that_does_not_hold_to_choices_is_found_out():
    with (
        open_model(always_say("perhaps"), guided="vllm") as model,
        pytest.raises(ModelError, match="leave out guided"),
    ):
        _ask(model, "What?", decoding=up_to(5, choices=("yes", "no")))


def test_there_is_a_request_in_flight_per_thread_and_conversations_are_independent():
    together, most, lock = 0, 0, threading.Lock()
    all_there = threading.Barrier(4, timeout=600)

    def answer(request, handler):
        nonlocal together, most
        with lock:
            together += 1
            most = max(most, together)
        all_there.wait()
        with lock:
            together -= 1
        return completion(request["messages"][0]["content"])

    with open_model(answer, max_in_flight=4) as model, ThreadPoolExecutor(4) as pool:
        replies = list(pool.map(lambda number: _ask(model, f"say {number}").text, range(8)))
    assert replies == [f"say {number}" for number in range(8)]
    assert most == 4


@pytest.fixture
def waits(monkeypatch):
    amounts = []
    monkeypatch.setattr(served.RateLimiter, "wait", lambda pace, amount=1.0: amounts.append(amount))
    return amounts


def test_what_is_in_flight_ends_when_the_model_is_closed():
    request_came, done = threading.Event(), threading.Event()

    def answer(_request, _handler):
        request_came.set()
        done.wait(20)

    try:
        with ThreadPoolExecutor(1) as pool:
            with open_model(answer) as model:
                waiting = pool.submit(_ask, model, "What?")
                assert request_came.wait(10)
            with pytest.raises(ModelError, match="is no longer waited for: the model is closed"):
                waiting.result(10)
            with pytest.raises(ModelError, match="gets no more requests: the model is closed"):
                _ask(model, "What?")
            done.set()
    finally:
        done.set()


def test_a_server_on_this_machine_is_asked_without_the_environments_proxy(monkeypatch):
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:1")
    for name in ("NO_PROXY", "no_proxy"):
        monkeypatch.delenv(name, raising=False)
    with open_model(always_say("a mug")) as model:
        assert _ask(model, "What?").text == "a mug"


def test_what_is_no_encryption_is_found_out():
    refused = pytest.raises(
        ModelError, match=r"^https://127.0.0.1:\d+/v1 cannot be reached \(.*SSL"
    )
    with serve_chat() as url, open_model(base_url=url.replace("http:", "https:")) as model, refused:
        _ask(model, "What?")


def test_tokens_a_minute_are_kept_by_the_size_of_the_last_request(waits):
    with open_model(
        lambda *_: completion("yes", (90, 10)), tokens_per_minute=1000, requests_per_minute=10
    ) as model:
        for _ in range(2):
            _ask(model, "What?")
    assert waits == [0, 1.0, 100, 1.0]  # tokens, then the request itself


def test_the_identity_is_whom_is_asked_and_how():
    with open_model(
        always_say("x"),
        base_url="https://host:1/v1/",
        max_cost=1,
        price_per_m_input=1,
        price_per_m_output=1,
    ) as model:
        assert model.identity() == {
            "adapter": "openai",
            "base_url": "https://host:1/v1",
            "model": "m",
            "image_format": "png",
            "detail": None,
            "max_tokens_field": "max_tokens",
            "send_seed": True,
            "send_temperature": True,
            "send_stop": True,
            "guided": None,
        }
        assert not model.capabilities.deterministic


def test_listing_and_checking_options_does_not_import_the_client():
    code = (
        "import sys, model_adapters as m; m.options_of('openai'); "
        "m.check_options('openai', {'model': 'm'}); sys.exit(bool({'httpx2'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("field", ["reasoning_content", "reasoning"])
def test_thoughts_that_the_server_tells_apart_are_kept_apart(field, monkeypatch):
    monkeypatch.setenv("MY_KEY", KEY)
    answer = completion("a cup", message={field: f"A mug? {KEY}"})
    with open_model(lambda *_: answer, api_key_env="MY_KEY") as model:
        reply = _ask(model, "What?")
    assert (
        reply.text == "a cup" and reply.thinking.startswith("A mug?") and KEY not in reply.thinking
    )
    with open_model(
        lambda *_: completion(None, message={field: "A mug?"}, finish_reason="length")
    ) as model:
        assert _ask(model, "What?").text == ""
    with (
        open_model(
            lambda *_: completion(None, message={field: "A mug?"}, finish_reason="stop")
        ) as model,
        pytest.raises(ModelError, match="gives no text"),
    ):
        _ask(model, "What?")
