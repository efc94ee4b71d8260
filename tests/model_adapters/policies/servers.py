"""Servers for tests: scripted ones, and one that a policy of ours answers for."""

import base64
import json
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters import Policy

from ...helpers.http_servers import SilentHandler, run_server

__all__ = ["Answer", "no_proxy", "policy_answers", "read_image", "send", "serve"]

# Gets the request and its handler; gives what is sent as JSON, or None where it has answered by
# itself.
Answer = Callable[[dict[str, Any], BaseHTTPRequestHandler], Any]


@pytest.fixture(autouse=True)
def no_proxy(monkeypatch: pytest.MonkeyPatch) -> None:
    """No proxy on the way to the servers that tests start."""
    monkeypatch.setenv("no_proxy", "127.0.0.1")


@contextmanager
def serve(answer: Answer, path: str | None = "/act", port: int = 0) -> Iterator[str]:
    """The address of a server that answers POSTs to a path (None: to any), for as long as it is
    needed; at a port that is free if none is given."""

    class Handler(SilentHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            if path not in (self.path, None):
                self.send_error(404)
                return
            content = answer(json.loads(body), self)
            if content is not None:
                send(self, 200, json.dumps(content).encode())

    with run_server(Handler, port) as address:
        yield address


def send(
    handler: BaseHTTPRequestHandler, status: int, body: bytes, length: int | None = None
) -> None:
    """Answer a request; `length` is what is announced instead of the body's."""
    handler.send_response(status)
    handler.send_header("Content-Length", str(len(body) if length is None else length))
    handler.end_headers()
    handler.wfile.write(body)


def read_image(request: dict[str, Any]) -> np.ndarray:
    """The frame in a request, as the package json_numpy or a plain list has it."""
    image = request["image"]
    if isinstance(image, list):
        return np.array(image, dtype=np.uint8)
    return np.frombuffer(base64.b64decode(image["__numpy__"]), np.dtype(image["dtype"])).reshape(
        image["shape"]
    )


def policy_answers(policy: Policy, change: float = 0.0) -> Answer:
    """Answers for a policy of ours, its first number changed by so much."""

    def answer(request: dict[str, Any], _handler: BaseHTTPRequestHandler) -> Any:
        policy.reset()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "frame.png"
            Image.fromarray(read_image(request)).save(path)
            steps = policy.act(FrameRef(path), request["instruction"])
        actions = [
            [step.translation[0] + change, *step.translation[1:], *step.rotation, step.gripper]
            for step in steps
        ]
        return actions[0] if len(actions) == 1 else actions

    return answer
