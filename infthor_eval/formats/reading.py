"""Reading files of users safely; every such file is read by one of these functions.

Opening a named pipe or a device would block for ever, a packed file can hold a thousand times its
size, and a nested one can exceed any decoder's recursion limit. Each of these is a `DataError`
here, with the file, the reason and a hint.

To add or change a check of files before they are read: here, for `csv_files.py` and `yaml_files.py`
too; size limits in `infthor_eval/storage/limits.py`.
"""

import gzip
import json
import lzma
import stat
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar, overload

import msgspec

from infthor_eval.errors import DataError, in_one_line, wrap_errors
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.storage.limits import FILE_MB, LINE_MB

T = TypeVar("T")

# What the decoders of gzip, xz and zip raise on damaged content, beside OSError.
DAMAGED = (EOFError, zlib.error, lzma.LZMAError)
# What a damaged zip archive raises when it is opened, and when a member is read. RuntimeError: of a
# member that is encrypted, or packed in a way that is not known.
DAMAGED_ZIP = (zipfile.BadZipFile, OSError, RuntimeError, struct.error, *DAMAGED)
# What `msgspec` raises on what is not JSON of its type.
NOT_JSON = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
_MB = 2**20


def file_problem(path: SetPath) -> str | None:
    """Return why a path is not a file that can be opened without blocking, or None if it is one."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        return f"cannot be read ({in_one_line(error)})"
    if stat.S_ISREG(mode):
        return None
    return "is a folder, not a file" if stat.S_ISDIR(mode) else "is a pipe or a device, not a file"


def require_file(path: SetPath, hint: str, max_mb: int | None = None) -> None:
    """Check that a path is a file that can be read, of at most `max_mb` MiB."""
    reason = file_problem(path)
    if reason is not None:
        raise DataError(f"{path}: {reason}; {hint}")
    if max_mb is not None and path.stat().st_size > max_mb * _MB:
        raise DataError(f"{path}: is larger than {max_mb} MiB; {FILE_MB.hint}")


def require_plain_files(folder: Path, hint: str) -> None:
    """Check that a folder has no pipes or devices in it, before another library reads its files."""
    with wrap_errors(f"{folder}: cannot be read", hint):
        for path in sorted(folder.iterdir()):
            if not path.is_dir():
                require_file(path, hint)


def read_bytes(path: SetPath, hint: str) -> bytes:
    """Return the content of a file; `hint` is the way to fix a bad one, for the message."""
    require_file(path, hint, FILE_MB.value)
    with wrap_errors(f"{path}: cannot be read", hint):
        return path.read_bytes()


def read_text(path: SetPath, hint: str) -> str:
    """Return the content of a UTF-8 file without byte order mark; line ends are kept."""
    with wrap_errors(f"{path}: not UTF-8 text", hint, catch=UnicodeDecodeError):
        return read_bytes(path, hint).decode("utf-8-sig")


@overload
def read_json(path: SetPath, hint: str) -> Any: ...
@overload
def read_json(path: SetPath, hint: str, data_type: type[T]) -> T: ...
def read_json(path: SetPath, hint: str, data_type: Any = Any) -> Any:
    """Return the content of a JSON file as the type that `msgspec` decodes it to."""
    return decode_json(read_bytes(path, hint), path, hint, data_type)


def decode_json(content: bytes, path: SetPath, hint: str, data_type: Any = Any) -> Any:
    """Return the content of a JSON file that was read; see `read_json`."""
    expected = "valid JSON" if data_type is Any else "in its documented form"
    with wrap_errors(f"{path}: not {expected}", hint, catch=NOT_JSON):
        return msgspec.json.decode(content, type=data_type)


def lines_of(path: Path, hint: str) -> Iterator[tuple[int, bytes]]:
    """Yield number (from 1) and content of the lines of a file (`.gz` too) that are not empty."""
    require_file(path, hint)
    number = 0
    try:
        with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
            left = FILE_MB.value * _MB
            while line := file.readline(LINE_MB.value * _MB + 1):
                number = number + 1
                left = left - len(line)
                if len(line) > LINE_MB.value * _MB:
                    raise DataError(
                        f"{path}, line {number}: is longer than {LINE_MB.value} MiB; {LINE_MB.hint}"
                    )
                if left < 0:
                    raise DataError(f"{path}: is longer than {FILE_MB.value} MiB; {FILE_MB.hint}")
                if line.strip():
                    yield number, line
    except (OSError, *DAMAGED) as error:
        raise DataError(
            f"{path}: cannot be read after line {number} ({in_one_line(error)}); {hint}"
        ) from error


def json_value(text: bytes) -> Any:
    """Return the value of a JSON text of others, NaN where it has it, without lone surrogates.

    Python's decoder lets these through, and no file could hold what is made of them.

    Raises:
        ValueError: it is not JSON.
        RecursionError: it is nested too deep.
    """
    value = json.loads(text)
    if b"\xed" in text or b"\\u" in text:
        json.dumps(value, ensure_ascii=False).encode()
    return value


def json_lines_of(path: Path, hint: str) -> Iterator[dict[str, Any]]:
    """Yield the JSON objects of a file that has one per line."""
    for number, line in lines_of(path, hint):
        with wrap_errors(
            f"{path}, line {number}: not JSON", hint, catch=(ValueError, RecursionError)
        ):
            entry = json_value(line)
        if not isinstance(entry, dict):
            raise DataError(f"{path}, line {number}: not a JSON object; {hint}")
        yield entry


def first_duplicate(values: Iterable[T]) -> T | None:
    """Return the first value that is there more than once, None if there is none."""
    return next((value for value, n in Counter(values).items() if n > 1), None)


def is_encodable(text: str) -> bool:
    """Return False for a text with lone surrogates, which no file of ours can hold."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)
