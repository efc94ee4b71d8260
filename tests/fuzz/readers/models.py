"""What servers answer, and the files of checkpoints."""

import json
from functools import cache, partial
from pathlib import Path

import msgspec
import numpy as np
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.loading.card import read_card_words
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.http.adapter import HttpPolicy, encode_array
from model_adapters.policies.statistics import select_statistics
from model_adapters.served.completion import decode_reply
from model_adapters.served.openai import ChatCompletion

from ..damage import Form
from ..reader import Reader

__all__ = ["READERS"]

_COMPLETION = {
    "id": "x", "object": "chat.completion", "created": 1, "model": "m",
    "choices": [{
        "index": 0, "finish_reason": "stop",
        "message": {"role": "assistant", "content": "yes", "refusal": None,
                    "reasoning_content": "so"},
    }],
    "usage": {"prompt_tokens": 9, "completion_tokens": 2,
              "prompt_tokens_details": {"cached_tokens": 4}},
}  # fmt: skip
_BOUNDS = {
    "q01": [-1.0] * 7,
    "q99": [1.0] * 7,
    "mask": [True] * 6 + [False],
    "mean": [0.0] * 7,
    "std": [1.0] * 7,
}
_CARD = "---\nlicense: mit\nwords: natural\ntags:\n- a\ndate: 2024-01-01\n---\n# A model\n"


def _make(name: str, document: object, folder: Path) -> Path:
    text = document if isinstance(document, str) else json.dumps(document)
    (folder / name).write_text(text)
    return folder / name


def _complete(folder: Path) -> None:
    body = (folder / "reply.json").read_bytes()
    completion = decode_reply("http://server", body, ChatCompletion, "a chat completion")
    completion.text("http://server")
    tokens = completion.tokens
    if tokens is not None:
        assert tokens.completion_tokens >= 0
        assert (tokens.n_cached or 0) <= tokens.prompt_tokens


@cache
def _policy() -> HttpPolicy:
    return HttpPolicy("vla-http", VlaHttpOptions(url="http://127.0.0.1:9"))


def _act(folder: Path) -> None:
    policy = _policy()
    policy._client.send = lambda _: (folder / "reply.json").read_bytes()  # type: ignore[method-assign]
    frame = folder / "a.png"
    if not frame.exists():
        Image.new("RGB", (8, 8)).save(frame)
    for delta in policy.act(FrameRef(frame), "pick it up"):
        assert all(
            np.isfinite(value)
            for value in msgspec.to_builtins(delta).values()
            if isinstance(value, float)
        )


def _statistics(folder: Path) -> None:
    checkpoint = PolicyCheckpoint(folder, "mine", {})
    checkpoint.require_model_type("openvla")
    known = checkpoint.read("config.json", _Config).norm_stats
    select_statistics(known, None, "mine")


class _Config(msgspec.Struct):
    norm_stats: dict[str, dict[str, object]]


_ARRAY = encode_array(np.zeros((2, 7), np.float32))
READERS = (
    Reader("chat completion", Form.JSON, partial(_make, "reply.json", _COMPLETION), _complete),
    Reader("policy reply", Form.JSON, partial(_make, "reply.json", [[0.0] * 7, [0.1] * 7]), _act),
    Reader("policy reply, packed", Form.JSON, partial(_make, "reply.json", _ARRAY), _act),
    Reader(
        "policy statistics",
        Form.JSON,
        partial(
            _make,
            "config.json",
            {"model_type": "openvla", "norm_stats": {"a": {"action": _BOUNDS}}},
        ),
        _statistics,
    ),
    Reader("model card", Form.TEXT, partial(_make, "README.md", _CARD), read_card_words),
)
