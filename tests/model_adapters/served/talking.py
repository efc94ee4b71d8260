"""A server of chat completions for tests: it says what follows from what it was shown, or what it
is told to."""

import base64
import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from io import BytesIO
from typing import Any

import pytest
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters import Reply

from ...helpers.refusals import read_one_line
from ..asking import ask, load_with
from ..policies.servers import Answer, serve

__all__ = [
    "always_say",
    "always_send",
    "ask_once",
    "completion",
    "images_in",
    "keep_requests",
    "open_behind",
    "open_model",
    "read_refusal",
    "serve_chat",
    "talkative",
]

PATH = "/v1/chat/completions"


def completion(text: str | None = "yes", usage: Any = (10, 2), **choice: Any) -> dict[str, Any]:
    """What a server answers: the text, and tokens read, written and (third, if there) cached."""
    counts = None
    if usage is not None:
        counts = {
            "prompt_tokens": usage[0],
            "completion_tokens": usage[1],
            "total_tokens": usage[0] + usage[1],
        }
        counts |= {"prompt_tokens_details": {"cached_tokens": usage[2]}} if len(usage) > 2 else {}
    message = {"role": "assistant", "content": text} | choice.pop("message", {})
    return {
        "id": "c",
        "object": "chat.completion",
        "created": 0,
        "model": "m",
        "choices": [{"index": 0, "message": message, "finish_reason": "stop"} | choice],
        "usage": counts,
    }


def talkative(request: dict[str, Any], _handler: BaseHTTPRequestHandler) -> dict[str, Any]:
    """Words that follow from everything that a reply may depend on, as many as it may have."""
    depends = {name: request.get(name) for name in ("messages", "temperature", "seed")}
    drawn = hashlib.sha256(repr(depends).encode()).digest()
    words = [("mug", "fridge", "table", "sink")[byte % 4] for byte in drawn][
        : request["max_tokens"]
    ]
    n_read = len(repr(request["messages"])) // 1000 + 1
    return completion(" ".join(words), (n_read, len(words), n_read // 2))


def always_say(text: str) -> Answer:
    """Says the same whatever it is asked."""
    return lambda *_: completion(text)


def always_send(status: int, body: bytes, headers: dict[str, str] | None = None) -> Answer:
    """Sends the same bytes whatever it is asked."""

    def answer(_request: Any, handler: BaseHTTPRequestHandler) -> None:
        handler.send_response(status)
        for name, value in {"Content-Length": str(len(body)), **(headers or {})}.items():
            handler.send_header(name, value)
        handler.end_headers()
        handler.wfile.write(body)

    return answer


@contextmanager
def serve_chat(answer: Answer = talkative, port: int = 0) -> Iterator[str]:
    """The base_url of a server, for as long as it is needed."""
    with serve(answer, PATH, port) as url:
        yield f"{url}/v1"


@contextmanager
def open_behind(url: str, name: str = "openai", **options: object) -> Iterator[Any]:
    """A model behind a server; nothing is left open."""
    model = load_with(name, **{"base_url": url, "model": "m", **options})
    try:
        yield model
    finally:
        model.close()


@contextmanager
def open_model(answer: Answer = talkative, **options: object) -> Iterator[Any]:
    """A model behind a server that answers so."""
    with serve_chat(answer) as url, open_behind(url, **{"retries": 0, **options}) as model:
        yield model


def ask_once(model: Any, **decoding: Any) -> Reply:
    """The model's reply to one question."""
    return ask(model, "What is it?", new=5, **decoding)


def read_refusal(answer: Answer, **options: object) -> str:
    """The one line that a model behind such a server ends in."""
    with open_model(answer, **options) as model, pytest.raises(ModelError) as caught:
        ask_once(model)
    message = read_one_line(caught)
    assert message.startswith("http://127.0.0.1:")
    assert "; " in message  # a mend
    assert len(message) < 600
    return message


def images_in(request: dict[str, Any]) -> list[Image.Image]:
    """The frames in a request, decoded."""
    parts = [
        part
        for message in request["messages"]
        if isinstance(message["content"], list)
        for part in message["content"]
    ]
    urls = [part["image_url"]["url"] for part in parts if part["type"] == "image_url"]
    return [Image.open(BytesIO(base64.b64decode(url.partition(",")[2]))) for url in urls]


def keep_requests(requests: list[dict[str, Any]], answer: Callable[..., Any] = talkative) -> Answer:
    """Answers likewise, and keeps what was asked, with its head under "headers" (names in lower
    case)."""

    def keep(request: dict[str, Any], handler: BaseHTTPRequestHandler) -> Any:
        requests.append(
            request | {"headers": {name.lower(): value for name, value in handler.headers.items()}}
        )
        return answer(request, handler)

    return keep
