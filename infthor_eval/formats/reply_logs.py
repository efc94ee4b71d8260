"""Replies to NIEH questions that others made, a JSON object a line (`.gz` too), in three forms.

| form | question | reply |
|---|---|---|
| published log | `qidx`, its row in the question file | `llm_response` |
| neutral | `question_id`, its id or qid | `reply` |
| lm-eval's `samples_<task>_<time>.jsonl` | `doc`: `question_id` | `resps` |

A published log is named `eval_<question file>_<model>_<mode>.log`; a row
repeats its question (`question`, `traj_id`, `gt_img_idx`, `gt_answer`) and has a `score`. A neutral
one may have `n_context_tokens`, `n_reply_tokens`, `seconds` and `frames_shown`, the numbers of the
frames that were shown.

To add a form of replies that others made: here; a published mode in
`infthor_eval/nieh/published/imported_replies.py: _MODES`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import in_one_line
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import json_value, lines_of
from infthor_eval.quantities import Amount, Count, Number, Whole

__all__ = ["LoggedReply", "UnreadRow", "read_reply_log"]

# characters of a reply: scoring compares texts in quadratic time, and an answer has a few words
_LONGEST = 20_000
_HINT = "give a log with a JSON object a line"


class _PublishedRow(msgspec.Struct, frozen=True):
    qidx: Count
    traj_id: str
    question: str
    gt_img_idx: tuple[Count, ...]
    gt_answer: tuple[str | Whole | Number, ...]
    llm_response: str
    score: Number | None = None
    ctx_n_tokens: Count | None = None
    eval_mode: str | None = None
    ctx_size_k: Amount | None = None
    n_imgs: Count | None = None
    selected_img_indices: tuple[Count, ...] | None = None


class _NeutralRow(msgspec.Struct, frozen=True):
    question_id: str
    reply: str
    n_context_tokens: Count | None = None
    n_reply_tokens: Count | None = None
    seconds: Amount = 0.0
    frames_shown: tuple[Count, ...] | None = None


class _Doc(msgspec.Struct, frozen=True):
    question_id: str


class _LmEvalRow(msgspec.Struct, frozen=True):
    doc: _Doc
    resps: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class LoggedReply:
    """A reply to a question, and what the row says of both.

    Attributes:
        line: number of the line, from 1.
        text: the reply.
        question_id: id of the question; None if the row has its number instead.
        row: number of the question in its file, from 0; None if the row has an id.
        published: the question as a published row repeats it; None in other forms.
        score: score in the log; None if there is none.
        mode: published name of the evaluation mode (`truncate_head`); None if the row names none.
        size: size of the context in kilo-tokens, in published rows.
        n_frames: number of frames that the model saw, in published rows.
        frames: numbers of these frames; None if they are not in the row.
        n_context_tokens: tokens of the request; None if they are not in the row.
        n_reply_tokens: tokens of the reply; None likewise.
        seconds: duration; 0 if it is not in the row.
    """

    line: int
    text: str
    question_id: str | None = None
    row: int | None = None
    published: Question | None = None
    score: float | None = None
    mode: str | None = None
    size: float | None = None
    n_frames: int | None = None
    frames: tuple[int, ...] | None = None
    n_context_tokens: int | None = None
    n_reply_tokens: int | None = None
    seconds: float = 0.0


@dataclass(frozen=True)
class UnreadRow:
    """A line that is not a reply, with the reason."""

    line: int
    reason: str


def read_reply_log(path: Path) -> Iterator[LoggedReply | UnreadRow]:
    """Yield the replies of a log in order; a bad line, such as a cut last one, is an `UnreadRow`.

    Raises:
        DataError: the file cannot be read.
    """
    for number, line in lines_of(path, _HINT):
        try:
            row = _read_row(number, json_value(line))
        except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
            yield UnreadRow(number, f"is not a reply ({in_one_line(error)})")
            continue
        if len(row.text) > _LONGEST:
            yield UnreadRow(
                number,
                f"has a reply of {len(row.text):,} characters; at most {_LONGEST:,} can be scored",
            )
        else:
            yield row


def _read_row(number: int, entry: Any) -> LoggedReply:
    if not isinstance(entry, dict):
        raise ValueError("not a JSON object")
    if "llm_response" in entry:
        return _published_reply(number, msgspec.convert(entry, _PublishedRow))
    if "resps" in entry:
        sample = msgspec.convert(entry, _LmEvalRow)
        if not sample.resps or not sample.resps[0]:
            raise ValueError("resps is empty")
        return LoggedReply(number, sample.resps[0][0], sample.doc.question_id)
    row = msgspec.convert(entry, _NeutralRow)
    return LoggedReply(
        number,
        row.reply,
        row.question_id,
        frames=row.frames_shown,
        n_context_tokens=row.n_context_tokens,
        n_reply_tokens=row.n_reply_tokens,
        seconds=row.seconds,
    )


def _published_reply(number: int, row: _PublishedRow) -> LoggedReply:
    return LoggedReply(
        number,
        row.llm_response,
        row=row.qidx,
        published=Question(row.traj_id, row.question, row.gt_img_idx, row.gt_answer),
        score=row.score,
        mode=row.eval_mode,
        size=row.ctx_size_k,
        n_frames=row.n_imgs,
        frames=row.selected_img_indices,
        n_context_tokens=row.ctx_n_tokens,
    )
