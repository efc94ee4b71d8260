"""A server of Anthropic's messages and their batches, for tests."""

import json
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..batches.server import BatchServer

__all__ = ["AnthropicServer", "errored", "message"]


def message(text: str = "yes", **fields: Any) -> dict[str, Any]:
    """What the server answers: 30 new tokens, 50 put into the cache, 20 found there."""
    usage = {
        "input_tokens": 30,
        "cache_creation_input_tokens": 50,
        "cache_read_input_tokens": 20,
        "output_tokens": 10,
    }
    return {
        "id": "msg_1",
        "type": "message",
        "role": "assistant",
        "model": "m",
        "content": [{"type": "text", "text": text}],
        "stop_reason": "end_turn",
        "stop_sequence": None,
        "usage": usage,
    } | fields


def errored(status: int, kind: str, words: str = "no") -> tuple[int, dict[str, Any]]:
    """An error, as the server writes it."""
    return status, {"type": "error", "error": {"type": kind, "message": words}}


class AnthropicServer(BatchServer):
    """See `BatchServer`."""

    def answer_to(self, method: str, path: str, headers: Any, body: bytes) -> Any:
        assert headers["anthropic-version"] == "2023-06-01"
        parts = urlsplit(path)
        match (method, parts.path.removeprefix("/v1/messages").strip("/").split("/")):
            case "POST", [""]:
                return self.process(json.loads(body))
            case "POST", ["batches"]:
                return 200, _shown(self.add(json.loads(body), len(body)))
            case "GET", ["batches"]:
                return 200, self.listed(parse_qs(parts.query))
            case "GET", ["batches", name] if name in self.batches:
                self.look_at(self.batches[name])
                return 200, _shown(self.batches[name])
            case "GET", ["batches", name, "results"] if name in self.batches:
                lines = self.batches[name]["results"]
                return 200, b"".join(json.dumps(line).encode() + b"\n" for line in lines)
        return errored(404, "not_found_error")

    def process(self, body: dict[str, Any]) -> Any:
        assert body["max_tokens"] > 0
        assert {turn["role"] for turn in body["messages"]} <= {"user", "assistant"}
        return super().process(body)

    def add(self, request: dict[str, Any], size: int) -> dict[str, Any]:
        lines = request["requests"]
        self.sizes.append((len(lines), size))
        assert len({line["custom_id"] for line in lines}) == len(lines)
        assert all(len(line["custom_id"]) <= 64 for line in lines)
        number = next(self.numbers)
        batch = {
            "id": f"msgbatch_{number}",
            "type": "message_batch",
            "processing_status": "in_progress",
            "created_at": f"2033-05-18T03:33:{number:02}.000Z",
            "cancel_initiated_at": None,
            "lines": lines,
            "looks": self.looks,
            "status": "in_progress",
        }
        self.batches[str(batch["id"])] = batch
        return batch

    def finish(self, batch: dict[str, Any]) -> None:
        batch["processing_status"] = batch["status"] = "ended"
        if self.last_status == "cancelled":
            batch["cancel_initiated_at"] = batch["created_at"]
        batch["results"] = [
            {"custom_id": line["custom_id"], "result": self.result(line["params"])}
            for line in batch["lines"]
        ]

    def result(self, body: dict[str, Any]) -> dict[str, Any]:
        outcome = self.process(body)
        if isinstance(outcome, str):
            return {"type": outcome}
        status, content = outcome
        if status == 200:
            return {"type": "succeeded", "message": content}
        return {"type": "errored", "error": content}

    def listed(self, query: dict[str, list[str]]) -> dict[str, Any]:
        names = list(reversed(self.batches))
        after = query.get("after_id", [""])[0]
        names = names[names.index(after) + 1 :] if after else names
        data = [_shown(self.batches[name]) for name in names[:2]]  # so that there are pages
        last = data[-1]["id"] if data else None
        return {"data": data, "has_more": len(names) > 2, "first_id": None, "last_id": last}


def _shown(batch: dict[str, Any]) -> dict[str, Any]:
    counts = {"processing": 0, "succeeded": 0, "errored": 0, "canceled": 0, "expired": 0}
    if "results" in batch:
        for line in batch["results"]:
            counts[line["result"]["type"]] += 1
    else:
        counts["processing"] = len(batch["lines"])
    hidden = ("lines", "looks", "results", "status")
    shown = {name: value for name, value in batch.items() if name not in hidden}
    return shown | {"request_counts": counts}
