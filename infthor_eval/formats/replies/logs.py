"""Replies to NIEH questions that others made, in five forms.

Four have a JSON object a line (`.gz` too); inspect_ai's log is a zip of JSON documents.

| form | question | reply |
|---|---|---|
| published log | `qidx`, its row in the question file | `llm_response` |
| neutral | `question_id`, its id or qid | `reply` |
| lm-eval's `samples_<task>_<time>.jsonl` | `doc`: `question_id` | `resps` |
| Every Eval Ever's `_samples.jsonl` | `question_id` in `metadata`, or `sample_id` | `output` |
| inspect_ai's `.eval` | `question_id` in `metadata`, or `id` | `output` |

A published log is named `eval_<question file>_<model>_<mode>.log`; a row
repeats its question (`question`, `traj_id`, `gt_img_idx`, `gt_answer`) and has a `score`. A neutral
one may have `n_context_tokens`, `n_reply_tokens`, `seconds` and `frames_shown`, the numbers of the
frames that were shown.

To add a form of replies that others made: here; a published mode in
`infthor_eval/nieh/published/imported_replies.py: _MODES`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, in_one_line
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import json_value, lines_of
from infthor_eval.formats.replies.exported_samples import EveryEvalEverRows
from infthor_eval.formats.replies.inspect_logs import INSPECT_SUFFIX, inspect_rows
from infthor_eval.formats.replies.logged import LoggedReply, Texts, UnreadRow
from infthor_eval.quantities import MOST_REPEATS, Amount, Count, Number, Whole

# characters of a reply: scoring compares texts in quadratic time, and an answer has a few words
_LONGEST = 20_000
_HINT = "give a log with a JSON object a line"
_WITHOUT_REPLIES = (".yaml", ".yml")  # results for the hub


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
    variant: str = ""


class _LmEvalRow(msgspec.Struct, frozen=True):
    doc: _Doc
    resps: tuple[Texts, ...]


def read_reply_log(path: Path) -> Iterator[LoggedReply | UnreadRow]:
    """Yield the replies of a log in order; a bad line, such as a cut last one, is an `UnreadRow`.

    A row that repeats a reply for another metric yields nothing.
    """
    if path.suffix in _WITHOUT_REPLIES:
        raise DataError(
            f"{path}: has results, and no replies; give the samples of the run, or a log with a "
            "JSON object a line"
        )
    if path.suffix == INSPECT_SUFFIX:
        yield from _each(inspect_rows(path))
        return
    rows = EveryEvalEverRows()
    yield from _each(
        (number, partial(_read_row, number, line, rows)) for number, line in lines_of(path, _HINT)
    )


def _each(
    rows: Iterable[tuple[int, Callable[[], Sequence[LoggedReply]]]],
) -> Iterator[LoggedReply | UnreadRow]:
    for number, read in rows:
        try:
            replies = read()
        except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
            yield UnreadRow(number, f"is not a reply ({in_one_line(error)})")
            continue
        for reply in replies:
            yield _within_limits(reply)


def _within_limits(reply: LoggedReply) -> LoggedReply | UnreadRow:
    length = len(reply.text)
    if length > _LONGEST:
        problem = f"has a reply of {length:,} characters; at most {_LONGEST:,} can be scored"
    elif reply.repeat > MOST_REPEATS:
        problem = f"is repetition {reply.repeat:,}; at most {MOST_REPEATS:,} are read"
    else:
        return reply
    return UnreadRow(reply.line, problem)


def _read_row(number: int, line: bytes, rows: EveryEvalEverRows) -> Sequence[LoggedReply]:
    entry = json_value(line)
    if not isinstance(entry, dict):
        raise ValueError("not a JSON object")
    if "llm_response" in entry:
        return [_published_reply(number, msgspec.convert(entry, _PublishedRow))]
    if "resps" in entry:
        return _lm_eval_replies(number, msgspec.convert(entry, _LmEvalRow))
    if "evaluation_id" in entry:
        return rows.read(number, entry)
    row = msgspec.convert(entry, _NeutralRow)
    reply = LoggedReply(
        number,
        row.reply,
        row.question_id,
        frames=row.frames_shown,
        n_context_tokens=row.n_context_tokens,
        n_reply_tokens=row.n_reply_tokens,
        seconds=row.seconds,
    )
    return [reply]


def _lm_eval_replies(number: int, sample: _LmEvalRow) -> list[LoggedReply]:
    if not sample.resps or not sample.resps[0]:
        raise ValueError("resps is empty")
    return [
        LoggedReply(number, text, sample.doc.question_id, variant=sample.doc.variant, repeat=repeat)
        for repeat, text in enumerate(sample.resps[0], start=1)
    ]


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
