"""A server of the Gemini API and its batches, for tests."""

import json
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..batches.server import BatchServer

__all__ = ["GeminiServer", "content", "errored"]


def content(text: str = "yes", reason: str = "STOP", **fields: Any) -> dict[str, Any]:
    """What the server answers: 100 tokens read, 40 of them cached, 10 written, 5 thought."""
    usage = {
        "promptTokenCount": 100,
        "candidatesTokenCount": 10,
        "thoughtsTokenCount": 5,
        "cachedContentTokenCount": 40,
        "totalTokenCount": 115,
    }
    candidate = {"content": {"parts": [{"text": text}], "role": "model"}, "finishReason": reason}
    return {"candidates": [candidate], "usageMetadata": usage, "modelVersion": "m"} | fields


def errored(status: int, kind: str, words: str = "no") -> tuple[int, dict[str, Any]]:
    """An error, as the server writes it."""
    return status, {"error": {"code": status, "message": words, "status": kind}}


class GeminiServer(BatchServer):
    """See `BatchServer`; an outcome in words is the state that the batch ends in."""

    root = "/v1beta"

    def answer_to(  # noqa: PLR0911
        self, method: str, path: str, headers: Any, body: bytes
    ) -> Any:
        parts = urlsplit(path)
        match (method, parts.path.strip("/").split("/")):
            case "POST", ["v1beta", "models", "m:generateContent"]:
                return self.process(json.loads(body))
            case "POST", ["upload", "v1beta", "files"]:
                assert headers["X-Goog-Upload-Command"] == "start"
                self.expected = int(headers["X-Goog-Upload-Header-Content-Length"])
                host = headers["Host"]
                return 200, b"", {"X-Goog-Upload-URL": f"http://{host}/put/here?upload_id=1"}
            case "POST", ["put", "here"]:
                assert headers["X-Goog-Upload-Command"] == "upload, finalize"
                assert len(body) == self.expected
                return 200, {"file": {"name": f"files/{self.add_file(body)}"}}
            case "POST", ["v1beta", "models", "m:batchGenerateContent"]:
                return 200, _shown(self.add(json.loads(body)["batch"]))
            case "GET", ["v1beta", "batches"]:
                return 200, self.listed(parse_qs(parts.query))
            case "GET", ["v1beta", "batches", name] if name in self.batches:
                self.look_at(self.batches[name])
                return 200, _shown(self.batches[name])
            case "GET", ["download", "v1beta", "files", name]:
                return 200, self.files[name.removesuffix(":download")]
        return errored(404, "NOT_FOUND")

    def process(self, body: dict[str, Any]) -> Any:
        assert body["generationConfig"]["maxOutputTokens"] > 0
        outcome = self.answer(body)
        self.asked[body["contents"][-1]["parts"][-1]["text"]] += 1
        return outcome if isinstance(outcome, tuple) else (200, outcome)

    def add(self, request: dict[str, Any]) -> dict[str, Any]:
        file = self.files[request["inputConfig"]["fileName"].removeprefix("files/")]
        lines = [json.loads(line) for line in file.splitlines()]
        self.sizes.append((len(lines), len(file)))
        name = f"b{next(self.numbers)}"
        self.batches[name] = {
            "name": f"batches/{name}",
            "display": request["displayName"],
            "status": "in_progress",
            "state": "BATCH_STATE_PENDING",
            "looks": self.looks,
            "lines": lines,
        }
        return self.batches[name]

    def finish(self, batch: dict[str, Any]) -> None:
        batch["status"] = "ended"
        batch["state"] = f"BATCH_STATE_{self.last_status.upper()}"
        if self.last_status != "succeeded":
            batch["error"] = next(iter(self.errors), None)
            return
        lines = [self.result(line) for line in batch["lines"]]
        content = b"".join(json.dumps(line).encode() + b"\n" for line in lines)
        batch["output"] = {"responsesFile": f"files/{self.add_file(content, 'out')}"}

    def result(self, line: dict[str, Any]) -> dict[str, Any]:
        status, body = self.process(line["request"])
        if status == 200:
            return {"key": line["key"], "response": body}
        return {"key": line["key"], "error": {"code": _GRPC[status], "message": "no"}}

    def listed(self, query: dict[str, list[str]]) -> dict[str, Any]:
        names = list(self.batches)
        begin = int(query.get("pageToken", ["0"])[0])
        page = [_shown(self.batches[name]) for name in names[begin : begin + 2]]
        more = {"nextPageToken": str(begin + 2)} if len(names) > begin + 2 else {}
        return {"operations": page} | more


_GRPC = {400: 3, 429: 8, 503: 14}


def _shown(batch: dict[str, Any]) -> dict[str, Any]:
    kind = "type.googleapis.com/google.ai.generativelanguage.v1main.GenerateContentBatch"
    metadata = {"@type": kind, "displayName": batch["display"], "state": batch["state"]}
    output = {"output": batch["output"]} if batch.get("output") else {}
    shown = {"name": batch["name"], "metadata": metadata | output}
    if batch["status"] == "ended":
        shown["done"] = True
    if batch.get("error"):
        shown["error"] = batch["error"]
    return shown
