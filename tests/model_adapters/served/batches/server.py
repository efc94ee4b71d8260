"""A server of OpenAI's batches for tests: files, batches, and what can go wrong with them.

It runs in this process, and outlives the runs that are killed. Batches are worked off when they
are looked at, so that tests need no clock.
"""

import email.parser
import email.policy
import itertools
import json
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar
from urllib.parse import parse_qs, urlsplit

from ....helpers.http_servers import SilentHandler, run_server
from ..talking import completion

__all__ = ["BatchServer", "failed", "serve_batches"]

# What becomes of a line: the body of a reply, or a status and a body, or a code of an error.
Outcome = dict[str, Any] | tuple[int, dict[str, Any]] | str


def failed(status: int, message: str) -> tuple[int, dict[str, Any]]:
    """A line that ended with an error."""
    return status, {"error": {"message": message, "type": "x", "code": None}}


@dataclass
class BatchServer:
    """What the server holds.

    Attributes:
        answer: becomes of a line, by its body.
        looks: looks at a batch before it ends.
        before: called before each request, with method and path; may answer it itself, by a
            status and a body.
        last_status: the status of batches in the end.
        asked: number of times that each question was processed, by its text.
    """

    answer: Callable[[dict[str, Any]], Outcome] = lambda _: completion("yes", (100, 10, 40))
    looks: int = 2
    before: Callable[[str, str], tuple[int, bytes] | None] = lambda *_: None
    last_status: str = "completed"
    errors: list[dict[str, Any]] = field(default_factory=list)
    url: str = ""
    root: ClassVar[str] = "/v1"
    files: dict[str, bytes] = field(default_factory=dict)
    batches: dict[str, dict[str, Any]] = field(default_factory=dict)
    asked: Counter[str] = field(default_factory=Counter)
    sizes: list[tuple[int, int]] = field(default_factory=list)
    numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1))
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def n_asked(self) -> int:
        return sum(self.asked.values())

    def add_file(self, content: bytes, kind: str = "in") -> str:
        name = f"file-{kind}-{next(self.numbers)}"
        self.files[name] = content
        return name

    def add_batch(self, request: dict[str, Any]) -> dict[str, Any]:
        content = self.files[request["input_file_id"]]
        lines = [json.loads(line) for line in content.splitlines()]
        self.sizes.append((len(lines), len(content)))
        assert len({line["custom_id"] for line in lines}) == len(lines)
        assert {line["url"] for line in lines} == {request["endpoint"]} == {"/v1/chat/completions"}
        assert request["completion_window"] == "24h"
        number = next(self.numbers)
        batch = {
            "id": f"batch_{number}",
            "object": "batch",
            "status": "validating",
            "created_at": 2_000_000_000 + number,
            "metadata": request["metadata"],
            "lines": lines,
            "looks": self.looks,
        }
        self.batches[batch["id"]] = batch
        return batch

    def look_at(self, batch: dict[str, Any]) -> None:
        if batch["looks"] > 0:
            batch["looks"] -= 1
            batch["status"] = "in_progress"
        elif batch["status"] in ("validating", "in_progress"):
            self.finish(batch)

    def process(self, body: dict[str, Any]) -> Any:
        outcome = self.answer(body)
        if isinstance(outcome, str):
            return outcome
        self.asked[body["messages"][-1]["content"][-1]["text"]] += 1
        return outcome if isinstance(outcome, tuple) else (200, outcome)

    def finish(self, batch: dict[str, Any]) -> None:
        batch["status"] = self.last_status
        if self.last_status == "failed":
            batch["errors"] = {"object": "list", "data": self.errors}
            return
        good, bad = [], []
        for line in batch["lines"]:
            outcome = self.process(line["body"])
            entry: dict[str, Any] = {"id": "x", "custom_id": line["custom_id"]}
            if isinstance(outcome, str):
                bad.append(entry | {"response": None, "error": {"code": outcome, "message": "m"}})
                continue
            status, body = outcome
            response = {"status_code": status, "request_id": "r", "body": body}
            (good if status == 200 else bad).append(entry | {"response": response, "error": None})
        for name, lines in (("output_file_id", good), ("error_file_id", bad)):
            if lines:
                content = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
                batch[name] = self.add_file(content, "out")

    def answer_to(  # noqa: PLR0911
        self, method: str, path: str, headers: Any, body: bytes
    ) -> tuple[int, Any]:
        parts = urlsplit(path)
        match (method, parts.path.removeprefix("/v1/").split("/")):
            case "POST", ["files"]:
                return 200, {"id": self.add_file(_uploaded(headers, body))}
            case "POST", ["chat", "completions"]:
                return self.process(json.loads(body))
            case "POST", ["batches"]:
                return 200, _shown(self.add_batch(json.loads(body)))
            case "GET", ["batches"]:
                return 200, self.page(parse_qs(parts.query))
            case "GET", ["batches", name] if name in self.batches:
                self.look_at(self.batches[name])
                return 200, _shown(self.batches[name])
            case "GET", ["files", name, "content"] if name in self.files:
                return 200, self.files[name]
        return 404, {"error": {"message": "no such thing"}}

    def page(self, query: dict[str, list[str]]) -> dict[str, Any]:
        names = list(reversed(self.batches))
        after = query.get("after", [""])[0]
        names = names[names.index(after) + 1 :] if after else names
        most = min(2, int(query["limit"][0]))  # so that there are pages
        data = [_shown(self.batches[name]) for name in names[:most]]
        return {"object": "list", "data": data, "has_more": len(names) > most}


def _shown(batch: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in batch.items() if name not in ("lines", "looks")}


def _uploaded(headers: Any, body: bytes) -> bytes:
    head = f"Content-Type: {headers['Content-Type']}\r\n\r\n".encode()
    form = email.parser.BytesParser(policy=email.policy.HTTP).parsebytes(head + body)
    parts = {
        part.get_param("name", header="content-disposition"): part for part in form.iter_parts()
    }
    assert parts["purpose"].get_payload(decode=True) == b"batch"
    assert parts["file"].get_filename().endswith(".jsonl")
    return parts["file"].get_payload(decode=True)


@contextmanager
def serve_batches(server: BatchServer) -> Iterator[BatchServer]:
    """Serve, for as long as it is needed."""

    class Handler(SilentHandler):
        def do(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            with server.lock:
                answer = server.before(self.command, self.path) or server.answer_to(
                    self.command, self.path, self.headers, body
                )
            status, content, *more = answer
            if status == 0:  # the work is done, and its answer is lost
                self.close_connection = True
                self.connection.close()
                return
            if not isinstance(content, bytes):
                content = json.dumps(content).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(content)))
            for name, value in (more[0] if more else {}).items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content)

        do_GET = do_POST = do

    with run_server(Handler) as address:
        server.url = address + server.root
        yield server
