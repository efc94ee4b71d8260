"""Hypothesis strategies that damage a sound input: in its structure, so that it keeps its format,
or in its bytes.

A huge list and a deep nesting are written by name (`DEEP`, `MANY`) and put in as text at the end:
Python's own encoder would not take them.
"""

import copy
import csv
import gzip
import io
import json
import math
from collections.abc import Callable
from enum import StrEnum
from typing import Any

from hypothesis import strategies as st

__all__ = ["CODECS", "Form", "damaged"]


class Form(StrEnum):
    """The format of an input."""

    BYTES = "bytes"
    TEXT = "text"
    JSON = "JSON, or YAML"
    JSON_LINES = "one JSON value a line"
    PACKED_LINES = "one JSON value a line, packed"
    CSV = "CSV"


DEEP, MANY = "@deep@", "@many@"
_RAW = {DEEP: "[" * 100_000 + "]" * 100_000, MANY: "[" + ",".join(["0"] * 100_000) + "]"}
_TEXTS = (
    "", " ", "\0", "\n", "a\nb", "\r", "\x1b[31m", "\u202e", "\ud800", "x" * 5_000,
    "../../etc/passwd", "/dev/zero",
    "é" * 300, "|", "||||", "Mug|a|b|c", "Mug|nan|inf|1e999", "1e999", "{0}", "%s", "__class__",
    "-1", "NaN", "=1+1",
)  # fmt: skip
_NUMBERS = (
    0, -1, 1, 2**31, 2**63 - 1, 2**63, -(2**63) - 1, 2**64, 10**30, 10**400, 0.5, -0.0, 1e18,
    1e308, 5e-324,
    math.nan, math.inf, -math.inf,
)  # fmt: skip
_OTHERS = (
    None,
    True,
    False,
    [],
    {},
    [[]],
    [None],
    {"": None},
    {"x": {}},
    [1, "a", None],
    DEEP,
    MANY,
)
_ODD = (*_TEXTS, *_NUMBERS, *_OTHERS)
_PIECES = (
    b"\0", b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\n", b"\r", b'"', b"'", b",", b"{", b"}", b"[",
    b"]", b"\\", b"&a ",
    b"*a", b"!!python/object:os.system ", b"\x80", b"\xed\xa0\x80", b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff", b"9" * 40,
    b"\x1b[2J",
)  # fmt: skip
_MOST_PATHS = 3000


def damaged(content: bytes, form: Form) -> st.SearchStrategy[bytes]:
    """Return a strategy of inputs that differ from a sound one by up to three damages."""
    in_bytes = _damaged_bytes(content)
    if form in (Form.BYTES, Form.TEXT):
        return in_bytes
    return st.one_of(_damaged_values(content, form), _damaged_values(content, form), in_bytes)


@st.composite
def _damaged_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, max(len(content) - 1, 0)))
        end = min(len(content), at + draw(st.sampled_from((1, 1, 1, 4, 40, 4000))))
        do = draw(st.sampled_from(("flip", "flip", "cut", "drop", "repeat", "insert")))
        if do == "flip":
            content = content[:at] + bytes([draw(st.integers(0, 255))]) + content[at + 1 :]
        elif do == "cut":
            content = content[:at]
        elif do == "drop":
            content = content[:at] + content[end:]
        elif do == "repeat":
            content = content[:end] + content[at:]
        else:
            content = content[:at] + draw(st.sampled_from(_PIECES)) + content[at:]
    return content


def _damaged_values(content: bytes, form: Form) -> st.SearchStrategy[bytes]:
    read, write = CODECS[form]
    return _damaged_document(read(content)).map(write)


@st.composite
def _damaged_document(draw: st.DrawFn, sound: Any) -> Any:
    holder = [copy.deepcopy(sound)]  # so that the whole can be replaced as a part is
    for _ in range(draw(st.integers(1, 3))):
        places = _places(holder)
        parent, key = places[draw(st.integers(0, len(places) - 1))]
        do = draw(
            st.sampled_from(
                ("replace", "replace", "replace", "drop", "repeat", "rename", "text", "swap")
            )
        )
        value = parent[key]
        if do == "replace" or parent is holder:
            parent[key] = copy.deepcopy(draw(st.sampled_from(_ODD)))
        elif do == "drop":
            del parent[key]
        elif do == "text":
            parent[key] = f"{value}"[:2000]
        elif do == "swap":  # for another value of the document
            other, name = places[draw(st.integers(0, len(places) - 1))]
            parent[key] = copy.deepcopy(other[name])
        elif isinstance(parent, list):
            parent.insert(key, copy.deepcopy(value))
        else:
            parent[draw(st.sampled_from(_TEXTS))] = (
                parent.pop(key) if do == "rename" else copy.deepcopy(value)
            )
    return holder[0]


def _places(holder: list[Any]) -> list[tuple[Any, Any]]:
    """Return parent and key of every value, outer ones first."""
    places: list[tuple[Any, Any]] = [(holder, 0)]
    for parent, key in places:
        value = parent[key]
        if isinstance(value, dict | list) and len(places) < _MOST_PATHS:
            places += [
                (value, inner)
                for inner in (value if isinstance(value, dict) else range(len(value)))
            ]
    return places


def _text(document: Any) -> str:
    text = json.dumps(document)
    for name, raw in _RAW.items():
        text = text.replace(f'"{name}"', raw)
    return text


def _json(document: Any) -> bytes:
    return _text(document).encode()


def _lines(document: Any) -> bytes:
    return "".join(
        _text(item) + "\n" for item in (document if isinstance(document, list) else [document])
    ).encode()


def _read_csv(content: bytes) -> Any:
    return [list(row) for row in csv.reader(io.StringIO(content.decode(), newline=""))]


def _csv(document: Any) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    for row in document if isinstance(document, list) else [document]:
        cells = row if isinstance(row, list) else [row]
        writer.writerow([str(cell)[:4000].replace(DEEP, "[" * 5000) for cell in cells])
    return text.getvalue().encode(errors="surrogatepass")


_Codec = tuple[Callable[[bytes], Any], Callable[[Any], bytes]]
CODECS: dict[Form, _Codec] = {
    Form.JSON: (json.loads, _json),
    Form.JSON_LINES: (lambda content: [json.loads(line) for line in content.splitlines()], _lines),
    Form.PACKED_LINES: (
        lambda content: [json.loads(line) for line in gzip.decompress(content).splitlines()],
        lambda document: gzip.compress(_lines(document), 1),
    ),
    Form.CSV: (_read_csv, _csv),
}
