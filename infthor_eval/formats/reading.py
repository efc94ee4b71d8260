"""The one place where a file is opened and judged: what it is, how large, and whether it holds what it should.

Whatever reads a file of somebody else's reads it by one of these. A named pipe or a device would be waited for without
end, a packed file can hold a thousand times its size, a nested one is deeper than any decoder goes: each is one
`DataError` here, with the file, the reason and the mend.
"""

import gzip
import json
import lzma
import stat
import zlib
from collections.abc import Iterator
from io import BufferedIOBase
from pathlib import Path
from typing import Any, TypeVar, overload

import msgspec

from infthor_eval.errors import DataError, in_one_line, wrap_errors
from infthor_eval.formats.limits import FILE_MB, LINE_MB

__all__ = [
    "DAMAGED",
    "file_problem",
    "json_lines_of",
    "lines_of",
    "read_bytes",
    "read_json",
    "read_text",
    "require_file",
    "require_plain_files",
]

T = TypeVar("T")

# What damaged content is told by, beside OSError: by the decoders of gzip, xz and zip.
DAMAGED = (EOFError, zlib.error, lzma.LZMAError)
_MB = 2**20


def file_problem(path: Path) -> str | None:
    """Why a file cannot be opened without waiting, or is none; None where it can."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a name with a null in it
        return f"cannot be read ({in_one_line(error)})"
    if stat.S_ISREG(mode):
        return None
    return "is a folder, not a file" if stat.S_ISDIR(mode) else "is a pipe or a device, not a file"


def require_file(path: Path, hint: str, max_mb: int | None = None) -> None:
    """Refuse what is no file that can be read.

    Args:
        path: of the file.
        mend: what to do, for the message.
        max_mb: refuse it where it is larger, MiB.

    Raises:
        DataError: it is not there, a folder, a pipe or a device, or too large.
    """
    reason = file_problem(path)
    if reason is not None:
        raise DataError(f"{path}: {reason}; {hint}")
    if max_mb is not None and path.stat().st_size > max_mb * _MB:
        raise DataError(f"{path}: is larger than {max_mb} MiB; {FILE_MB.hint}")


def require_plain_files(folder: Path, hint: str) -> None:
    """Refuse a folder with pipes or devices in it, for what another library reads of it.

    Raises:
        DataError: it has one, or a link that leads nowhere.
    """
    with wrap_errors(f"{folder}: cannot be read", hint):
        for path in sorted(folder.iterdir()):
            if not path.is_dir():
                require_file(path, hint)


def read_bytes(path: Path, hint: str) -> bytes:
    """The content of a file.

    Args:
        path: of the file.
        mend: what to do where it cannot be read, for the message.

    Raises:
        DataError: no file, too large, or it cannot be read.
    """
    require_file(path, hint, FILE_MB.value)
    with wrap_errors(f"{path}: cannot be read", hint):
        return path.read_bytes()


def read_text(path: Path, hint: str) -> str:
    """The content of a UTF-8 file, without a byte order mark, its line ends as they are.

    Raises:
        DataError: as `read_bytes`, or it is not UTF-8.
    """
    with wrap_errors(f"{path}: not UTF-8 text", hint, catch=UnicodeDecodeError):
        return read_bytes(path, hint).decode("utf-8-sig")


@overload
def read_json(path: Path, hint: str) -> Any: ...
@overload
def read_json(path: Path, hint: str, form: type[T]) -> T: ...
def read_json(path: Path, hint: str, form: Any = Any) -> Any:
    """What a JSON file holds, in the form of a type.

    Args:
        path: of the file.
        mend: what to do where it is not what it should be, for the message.
        form: what `msgspec` converts it to.

    Raises:
        DataError: as `read_bytes`; not JSON, nested too deep, or of another form.
    """
    content = read_bytes(path, hint)
    wanted = "valid JSON" if form is Any else "in its documented form"
    with wrap_errors(f"{path}: not {wanted}", hint, catch=(msgspec.DecodeError, UnicodeDecodeError, RecursionError)):
        return msgspec.json.decode(content, type=form)


def lines_of(path: Path, hint: str) -> Iterator[tuple[int, bytes]]:
    """The lines of a file, packed by gzip if it is called `.gz`, that are not empty, with their numbers from 1.

    Raises:
        DataError: no file, damaged, or a line or the whole is longer than the limits.
    """
    require_file(path, hint)
    number = 0
    try:
        with _opened(path) as file:
            left = FILE_MB.value * _MB
            while line := file.readline(LINE_MB.value * _MB + 1):
                number, left = number + 1, left - len(line)
                if len(line) > LINE_MB.value * _MB:
                    raise DataError(f"{path}, line {number}: is longer than {LINE_MB.value} MiB; {LINE_MB.hint}")
                if left < 0:
                    raise DataError(f"{path}: is longer than {FILE_MB.value} MiB; {FILE_MB.hint}")
                if line.strip():
                    yield number, line
    except (OSError, *DAMAGED) as error:
        raise DataError(f"{path}: cannot be read after line {number} ({in_one_line(error)}); {hint}") from error


def json_lines_of(path: Path, hint: str) -> Iterator[dict[str, Any]]:
    """The JSON objects of a file with one a line.

    Raises:
        DataError: as `lines_of`, or a line is no JSON object.
    """
    for number, line in lines_of(path, hint):
        with wrap_errors(f"{path}, line {number}: not JSON", hint, catch=(ValueError, RecursionError)):
            found = json.loads(line)
        if not isinstance(found, dict):
            raise DataError(f"{path}, line {number}: not a JSON object; {hint}")
        yield found


def _opened(path: Path) -> BufferedIOBase:
    return gzip.open(path) if path.suffix == ".gz" else path.open("rb")
