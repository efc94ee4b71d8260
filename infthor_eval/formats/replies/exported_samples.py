"""Samples in the words of Every Eval Ever, as replies; and what our own exports say beside them.

Exports write under `metadata` what their format has no field for: id, variant and repetition of the
unit, task, context, frames. Other harnesses write what they like there.
"""

import re
from collections.abc import Mapping
from typing import Any

import msgspec

from infthor_eval.formats.replies.logged import LoggedReply, Texts
from infthor_eval.quantities import Amount, Count

_STRETCHES = re.compile(r"\d{1,9}(-\d{1,9})?(,\d{1,9}(-\d{1,9})?)*", re.ASCII)
_LONGEST_STRETCH = 1_000_000  # frames


class _Output(msgspec.Struct, frozen=True):
    raw: Texts
    reasoning_trace: tuple[str, ...] | None = None


class _Tokens(msgspec.Struct, frozen=True):
    input_tokens: Count
    output_tokens: Count


class _Performance(msgspec.Struct, frozen=True):
    latency_ms: Amount | None = None


class _Row(msgspec.Struct, frozen=True):
    """A line; fields that do not matter here are not read."""

    sample_id: str
    model_id: str
    output: _Output | None = None
    error: str | None = None
    token_usage: _Tokens | None = None
    performance: _Performance | None = None
    metadata: dict[str, Any] | None = None


class EveryEvalEverRows:
    """Reads the lines of one file, which has each reply once for each metric."""

    def __init__(self) -> None:
        self._seen: set[tuple[str, str, str, int]] = set()

    def read(self, number: int, entry: Mapping[str, Any]) -> list[LoggedReply]:
        """Return the replies of a line that none before it had; none of a line on a group.

        Raises:
            ValueError: it is no sample of this form, or an episode.
        """
        row = msgspec.convert(entry, _Row)
        fields = fields_of_metadata(row.metadata or {}, row.sample_id)
        if "members" in (row.metadata or {}):
            return []
        if row.output is None:
            raise ValueError("an episode, and no reply to a question")
        tokens = row.token_usage
        thoughts = row.output.reasoning_trace or ()
        seconds = 0.0 if row.performance is None else (row.performance.latency_ms or 0.0) / 1000
        texts = row.output.raw or ("",)
        if not row.output.raw and row.error is None:
            raise ValueError("output.raw is empty")
        replies = [
            LoggedReply(
                number,
                "" if row.error is not None else text,
                failure=row.error,
                model=row.model_id,
                n_context_tokens=None if tokens is None else tokens.input_tokens,
                n_reply_tokens=None if tokens is None else tokens.output_tokens,
                seconds=seconds,
                thinking=thoughts[0] if thoughts else None,
                **{**fields, "repeat": fields["repeat"] + at},
            )
            for at, text in enumerate(texts)
        ]
        return [reply for reply in replies if self._is_new(reply)]

    def _is_new(self, reply: LoggedReply) -> bool:
        what = reply.task, f"{reply.question_id} {reply.variant}", reply.text, reply.repeat
        if what in self._seen:
            return False
        self._seen.add(what)
        return True


def fields_of_metadata(metadata: Mapping[str, Any], sample_id: str) -> dict[str, Any]:
    """Return the fields of a `LoggedReply` in a sample's metadata, if they are ours."""
    texts = {
        name: str(metadata.get(name, ""))
        for name in ("task", "context", "frame_ablation", "variant")
    }
    repeat = str(metadata.get("repeat", ""))
    return {
        **texts,
        "question_id": str(metadata.get("question_id") or sample_id),
        "repeat": int(repeat) if re.fullmatch(r"[1-9]\d{0,8}", repeat, re.ASCII) else 1,
        "frames": _frames(str(metadata.get("frames", ""))),
    }


def _frames(text: str) -> tuple[int, ...] | None:
    """Return the numbers of frames in stretches ("0-12,14"); None if there are none."""
    if _STRETCHES.fullmatch(text) is None:
        return None
    frames: list[int] = []
    for stretch in text.split(","):
        first, _, last = stretch.partition("-")
        end = int(last or first) + 1
        if len(frames) + end - int(first) > _LONGEST_STRETCH:
            raise ValueError(f"frames {text!r:.40} are more than {_LONGEST_STRETCH:,}")
        frames += range(int(first), end)
    return tuple(frames)
