"""A local server that speaks the hub's protocol for one repository."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from urllib.parse import parse_qs

import pytest

from .http_servers import SilentHandler, run_server

__all__ = ["COMMIT", "Hub", "serve_hub", "use_hub"]

COMMIT = "0" * 40


class Hub(SilentHandler):
    """The server's answers.

    `repository` is "datasets/owner/name" or "models/owner/name", `files` are its files by path, and
    `fetched` are those that were fetched, and `n_bytes` what was sent of them; a `status` other
    than 200 is every answer's.
    """

    repository: str
    files: dict[str, bytes]
    fetched: list[str]
    n_bytes: Counter[str]
    status = 200

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_POST(self) -> None:
        """Answer what files are at paths."""
        sent = parse_qs(self.rfile.read(int(self.headers["Content-Length"])).decode())
        entries = [_entry(file, self.files[file]) for file in sent["paths"] if file in self.files]
        status = self.status
        content = json.dumps(entries).encode()
        self._answer(status, content, {"Content-Type": "application/json"})

    def do_GET(self) -> None:
        name = self.path.partition("/resolve/")[2].partition("/")[2]
        if self.status != 200:
            self._answer(self.status, b"{}", {"X-Error-Code": "GatedRepo"})
        elif "/tree/" in self.path:
            entries = [_entry(file, content) for file, content in self.files.items()]
            self._answer(200, json.dumps(entries).encode(), {"Content-Type": "application/json"})
        elif self.path.startswith(f"/api/{self.repository}"):
            siblings = [
                {"rfilename": file, "size": len(content)} for file, content in self.files.items()
            ]
            name = self.repository.partition("/")[2]
            answer = {"id": name, "sha": COMMIT, "siblings": siblings}
            self._answer(200, json.dumps(answer).encode())
        elif name in self.files:
            content = self.files[name]
            if self.command == "GET":
                self.fetched.append(name)
            headers = {"ETag": f'"{hashlib.sha256(content).hexdigest()}"', "X-Repo-Commit": COMMIT}
            wanted = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range") or "")
            if wanted and self.command == "GET":
                content = content[int(wanted[1]) : int(wanted[2]) + 1]
            if self.command == "GET":
                self.n_bytes[name] += len(content)
            self._answer(206 if wanted else 200, content, headers)
        else:
            self._answer(404, b"{}", {"X-Error-Code": "EntryNotFound"})

    def _answer(self, status: int, content: bytes, headers: Mapping[str, str] = {}) -> None:
        self.send_response(status)
        for key, value in headers.items():
            self.send_header(key, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)


def _entry(file: str, content: bytes) -> dict[str, object]:
    oid = hashlib.sha1(content).hexdigest()
    return {"type": "file", "path": file, "size": len(content), "oid": oid}


@contextmanager
def serve_hub(repository: str, files: dict[str, bytes]) -> Iterator[tuple[str, type[Hub]]]:
    """Serve a repository; yields the address, and the answers, whose files may be changed."""
    answers = type(
        "ThisHub",
        (Hub,),
        {"repository": repository, "files": files, "fetched": [], "n_bytes": Counter()},
    )
    with run_server(answers) as address:
        yield address, answers


def use_hub(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    """Let the hub's library ask the server at an address."""
    monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", address)
    monkeypatch.setattr("huggingface_hub.hf_api.constants.ENDPOINT", address)
    monkeypatch.setattr(
        "huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE",
        address + "/{repo_id}/resolve/{revision}/{filename}",
    )
