"""A local server that speaks the hub's protocol for one repository."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from .http_servers import SilentHandler, run_server

__all__ = ["COMMIT", "Hub", "serve_hub"]

COMMIT = "0" * 40


class Hub(SilentHandler):
    """The server's answers.

    `repository` is "datasets/owner/name" or "models/owner/name", `files` are its files by path, and
    `fetched` are those that were fetched; a `status` other than 200 is every answer's.
    """

    repository: str
    files: dict[str, bytes]
    fetched: list[str]
    status = 200

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        name = self.path.partition("/resolve/")[2].partition("/")[2]
        if self.status != 200:
            self._answer(self.status, b"{}", {"X-Error-Code": "GatedRepo"})
        elif "/tree/" in self.path:
            entries = [
                {
                    "type": "file",
                    "path": file,
                    "size": len(content),
                    "oid": hashlib.sha1(content).hexdigest(),
                }
                for file, content in self.files.items()
            ]
            self._answer(200, json.dumps(entries).encode(), {"Content-Type": "application/json"})
        elif self.path.startswith(f"/api/{self.repository}"):
            siblings = [{"rfilename": file} for file in self.files]
            name = self.repository.partition("/")[2]
            answer = {"id": name, "sha": COMMIT, "siblings": siblings}
            self._answer(200, json.dumps(answer).encode())
        elif name in self.files:
            content = self.files[name]
            if self.command == "GET":
                self.fetched.append(name)
            etag = hashlib.sha256(content).hexdigest()
            self._answer(200, content, {"ETag": f'"{etag}"', "X-Repo-Commit": COMMIT})
        else:
            self._answer(404, b"{}", {"X-Error-Code": "EntryNotFound"})

    def _answer(self, status: int, content: bytes, headers: Mapping[str, str] = {}) -> None:
        self.send_response(status)
        for key, value in headers.items():
            self.send_header(key, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(content)


@contextmanager
def serve_hub(repository: str, files: dict[str, bytes]) -> Iterator[tuple[str, type[Hub]]]:
    """Serve a repository; yields the address, and the answers, whose files may be changed."""
    answers = type("ThisHub", (Hub,), {"repository": repository, "files": files, "fetched": []})
    with run_server(answers) as address:
        yield address, answers
