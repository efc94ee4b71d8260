"""Samples of inspect_ai's logs (its `EvalSample`): messages, scores, usage, and all else as
metadata.

Frames are attachments, which messages refer to by their hash, or words in their places.
"""

import hashlib
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.exports.measures import Measure
from infthor_eval.exports.samples import ACT, describe_result, facts_of, payload_of
from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.sample import Sample, TokenCounts
from infthor_eval.runs import StoredFrames

Document = dict[str, Any]
_ERROR = ("message", "traceback", "traceback_ansi")  # which have the reason each
FindFrames = Callable[[Any], Sequence[FrameRef]]


class SampleWriter:
    """Turns the samples of a task into documents.

    Attributes:
        problems: why frames could not be attached, one for each sample.
    """

    def __init__(
        self, model: str, measures: Sequence[Measure], find_frames: FindFrames | None
    ) -> None:
        """Take the model's name, the task's metrics, and what finds frames; None to leave them."""
        self._model = model
        self._find_frames = find_frames
        self._scores: dict[tuple[str, int], dict[str, float]] = {}
        for measure in measures:
            for scored in measure.samples:
                for record, score in scored.repetitions:
                    key = scored.name, record.repeat
                    self._scores.setdefault(key, {})[measure.metric] = score
        self.problems: list[str] = []

    def write(self, sample: Sample) -> Document:
        """Return the document of a sample."""
        record = sample.record
        name = str(record.key.once)
        attachments: dict[str, str] = {}
        asked = self._asked(sample, attachments)
        messages = [asked, *self._replies(sample)]
        replies = [message for message in messages if message["role"] == "assistant"]
        usage = model_usage(sample.tokens)
        document: Document = {
            "id": name,
            "epoch": record.repeat,
            "input": [asked],
            "target": sample.target,
            "messages": messages,
            "output": self._output(replies, usage, record.seconds),
            "scores": {
                metric: {"value": score, "answer": sample.reply}
                for metric, score in self._scores.get((name, record.repeat), {}).items()
            },
            "metadata": {**facts_of(sample), "payload": msgspec.json.decode(payload_of(sample))},
            "model_usage": {self._model: usage} if usage else {},
            "total_time": record.seconds,
            "working_time": record.seconds,
            "attachments": attachments,
        }
        if record.failure is not None:
            document["error"] = dict.fromkeys(_ERROR, record.failure)
        return document

    def _asked(self, sample: Sample, attachments: dict[str, str]) -> Document:
        question = sample.question
        if sample.request is None or sample.is_episode:  # of an episode all of the history
            goal = f"{sample.target}\n" if sample.is_episode else ""
            return {"role": "user", "content": f"{goal}{question}", "source": "input"}
        frames = iter(self._frames(sample))
        content: list[Document] = []
        for part in sample.request.parts:
            if not isinstance(part, StoredFrames):
                content.append(_text(question if part is None else part))
                continue
            images = [_attach(next(frames), attachments) for _ in range(part.n)]
            content += images if all(images) else [_text(part.in_words)]
        return {"role": "user", "content": _joined(content), "source": "input"}

    def _frames(self, sample: Sample) -> Iterator[FrameRef | None]:
        """Yield the frames of a request, then None for ever."""
        if self._find_frames is not None:
            try:
                yield from self._find_frames(sample.record)
            except DataError as error:
                self.problems.append(str(error))
        while True:
            yield None

    def _replies(self, sample: Sample) -> Iterator[Document]:
        if not sample.is_episode:
            if sample.record.failure is None:
                yield self._assistant(_content(sample))
            return
        for number, step in enumerate(sample.steps):
            call = f"{ACT}-{number}"
            made = {
                "id": call,
                "function": ACT,
                "arguments": {"action": step.action},
                "type": "function",
            }
            said = self._assistant(step.reply or step.action)
            yield said | {"tool_calls": [made]}
            yield {
                "role": "tool",
                "content": describe_result(step),
                "tool_call_id": call,
                "function": ACT,
            }

    def _assistant(self, content: str | list[Document]) -> Document:
        return {
            "role": "assistant",
            "content": content,
            "source": "generate",
            "model": self._model,
        }

    def _output(
        self, replies: Sequence[Document], usage: Document | None, seconds: float
    ) -> Document:
        choices = [{"message": message, "stop_reason": "stop"} for message in replies[-1:]]
        return {"model": self._model, "choices": choices, "usage": usage, "time": seconds}


def sample_summary(document: Mapping[str, Any]) -> Document:
    """Return what inspect's list of samples needs of a sample."""
    kept = ("id", "epoch", "target", "scores", "model_usage", "total_time", "working_time")
    asked = document["metadata"]["payload"].get("question")
    error = document.get("error")
    return {
        **{name: document[name] for name in kept},
        "input": asked or _summary_text(document["input"][0]["content"]),
        "metadata": {
            name: value for name, value in document["metadata"].items() if name != "payload"
        },
        "error": None if error is None else error["message"],
        "completed": True,
        "message_count": len(document["messages"]),
    }


def model_usage(tokens: TokenCounts | None) -> Document | None:
    """Return tokens as inspect counts them: those of the cache are no input tokens."""
    if tokens is None:
        return None
    return {
        "input_tokens": tokens.context - tokens.cached,
        "output_tokens": tokens.reply,
        "total_tokens": tokens.context + tokens.reply,
        "input_tokens_cache_read": tokens.cached,
    }


def _summary_text(content: str | Sequence[Mapping[str, Any]]) -> str:
    if isinstance(content, str):
        return content
    return " ".join(part.get("text", "") for part in content)


def _attach(frame: FrameRef | None, attachments: dict[str, str]) -> Document:
    """Return the part of a message that shows a frame; empty if there is none."""
    if frame is None:
        return {}
    content, media_type = frame.encoded()
    uri = f"data:{media_type};base64,{b64encode(content).decode()}"
    name = hashlib.md5(uri.encode(), usedforsecurity=False).hexdigest()
    attachments[name] = uri
    return {"type": "image", "image": f"attachment://{name}", "detail": "auto"}


def _text(text: str) -> Document:
    return {"type": "text", "text": text}


def _joined(content: Sequence[Document]) -> list[Document]:
    """Return parts with neighbouring texts as one."""
    parts: list[Document] = []
    for kind, group in groupby(content, key=lambda part: part["type"]):
        same = list(group)
        if kind == "text":
            same = [_text("".join(part["text"] for part in same))]
        parts += same
    return parts


def _content(sample: Sample) -> str | list[Document]:
    if sample.thinking is None:
        return sample.reply
    return [{"type": "reasoning", "reasoning": sample.thinking}, _text(sample.reply)]
