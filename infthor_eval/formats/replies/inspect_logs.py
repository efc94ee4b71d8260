"""inspect_ai's logs (`.eval`): a zip with a JSON document for each sample, as replies.

The package writes them packed with zstandard, which Python's own zip reader does not know before
3.14; pyarrow unpacks it. Other packings than that, deflate and none are refused: Python's reader
unpacks theirs without a limit, whatever length a member has by its own word.
"""

import struct
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, in_one_line
from infthor_eval.formats.reading import DAMAGED_ZIP, json_value, require_file
from infthor_eval.formats.replies.exported_samples import fields_of_metadata
from infthor_eval.formats.replies.logged import LoggedReply
from infthor_eval.quantities import Amount, Count, Repetition
from infthor_eval.storage.limits import FILE_MB, LINE_MB

INSPECT_SUFFIX = ".eval"
_HEADER = ("header.json", "_journal/start.json")  # the second of a run that was stopped
_SAMPLES = "samples/"
_HINT = "give a log as inspect_ai writes it"
_ZSTANDARD = 93
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, _ZSTANDARD)
_LOCAL = struct.Struct("<26xHH")  # up to the lengths of a member's name and extra field
_MB = 1_000_000


class _Spec(msgspec.Struct, frozen=True):
    task: str
    model: str


class _Header(msgspec.Struct, frozen=True):
    eval: _Spec


class _Message(msgspec.Struct, frozen=True):
    content: str | list[dict[str, Any]]


class _Choice(msgspec.Struct, frozen=True):
    message: _Message


class _Output(msgspec.Struct, frozen=True):
    choices: list[_Choice] = []


class _Usage(msgspec.Struct, frozen=True):
    input_tokens: Count = 0
    output_tokens: Count = 0
    input_tokens_cache_read: Count | None = None
    input_tokens_cache_write: Count | None = None


class _Error(msgspec.Struct, frozen=True):
    message: str


class _Sample(msgspec.Struct, frozen=True):
    """A sample; fields that do not matter here are not read."""

    id: str | int
    epoch: Repetition = 1
    output: _Output = _Output()
    metadata: dict[str, Any] = {}
    model_usage: dict[str, _Usage] = {}
    total_time: Amount | None = None
    error: _Error | None = None


def inspect_rows(path: Path) -> Iterator[tuple[int, Callable[[], Sequence[LoggedReply]]]]:
    """Yield the number of each sample, from 1, and what reads its reply."""
    for number, (spec, document) in enumerate(_samples(path), start=1):
        yield number, partial(_read, number, document, spec)


def inspect_documents(path: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the document of each sample that is a JSON object."""
    yield from (document for _, document in _samples(path) if isinstance(document, Mapping))


def _samples(path: Path) -> Iterator[tuple[_Spec, Any]]:
    require_file(path, _HINT)
    try:
        with zipfile.ZipFile(path) as archive:
            members = {member.filename: member for member in archive.infolist()}
            header = next((members[name] for name in _HEADER if name in members), None)
            if header is None:
                raise DataError(f"{path}: has no {_HEADER[0]}; {_HINT}")
            spec = msgspec.convert(_document(archive, header), _Header).eval
            samples = [it for name, it in members.items() if name.startswith(_SAMPLES)]
            if sum(member.file_size for member in samples) > FILE_MB.value * _MB:
                raise ValueError(f"is longer than {FILE_MB.value} MB; {FILE_MB.hint}")
            for member in samples:
                yield spec, _document(archive, member)
    except (*DAMAGED_ZIP, ValueError) as error:  # msgspec's errors are ValueErrors
        raise DataError(f"{path}: not a log of inspect_ai ({in_one_line(error)}); {_HINT}") from (
            error
        )


def _document(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Any:
    name, length = member.filename, member.file_size
    if length > LINE_MB.value * _MB:
        raise ValueError(f"{name} is longer than {LINE_MB.value} MB; {LINE_MB.hint}")
    if member.compress_type not in _PACKINGS:
        raise ValueError(f"{name} is packed in another way than deflate or zstandard")
    if member.compress_type == _ZSTANDARD:
        content = _unpack(archive, member)
    else:
        with archive.open(member) as file:
            content = file.read(length + 1)  # of a longer one the check sum is another
    if len(content) != length:
        raise ValueError(f"{name} has another length than the archive says")
    return json_value(content)


def _unpack(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    """Return the content of a member that is packed with zstandard."""
    import pyarrow

    file = archive.fp
    assert file is not None
    file.seek(member.header_offset)
    n_name, n_extra = _LOCAL.unpack(file.read(_LOCAL.size))
    file.seek(n_name + n_extra, 1)
    packed = pyarrow.BufferReader(file.read(member.compress_size))
    with pyarrow.CompressedInputStream(packed, "zstd") as stream:
        return bytes(stream.read(member.file_size + 1))


def _read(number: int, document: Any, spec: _Spec) -> list[LoggedReply]:
    sample = msgspec.convert(document, _Sample)
    fields = fields_of_metadata(sample.metadata, str(sample.id))
    failure = None if sample.error is None else sample.error.message
    if failure is None and not sample.output.choices:
        raise ValueError("output has no choice")
    content = sample.output.choices[0].message.content if sample.output.choices else ""
    usage = list(sample.model_usage.values())
    reply = LoggedReply(
        number,
        "" if failure is not None else _text(content, "text"),
        failure=failure,
        model=spec.model,
        n_context_tokens=sum(map(_context, usage)) if usage else None,
        n_reply_tokens=sum(it.output_tokens for it in usage) if usage else None,
        seconds=sample.total_time or 0.0,
        thinking=_text(content, "reasoning") or None if isinstance(content, list) else None,
        **{**fields, "task": fields["task"] or spec.task, "repeat": sample.epoch},
    )
    return [reply]


def _text(content: str | Sequence[Mapping[str, Any]], kind: str) -> str:
    """Return the parts of one kind of a message's content."""
    if isinstance(content, str):
        return content
    return "".join(str(part.get(kind, "")) for part in content if part.get("type") == kind)


def _context(usage: _Usage) -> int:
    cached = (usage.input_tokens_cache_read or 0) + (usage.input_tokens_cache_write or 0)
    return usage.input_tokens + cached
