"""Inputs of twice the size, to find readers that take more than twice as long.

Each part of a sound input grows in turn: lists by equal and by different entries, mappings by
names, texts by words. A reader may refuse what has grown, in whatever time is no more than twice
that for half of it.
"""

import contextlib
import copy
import gc
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .damage import CODECS, Form
from .reader import Reader

__all__ = ["find_growth"]

_SIZE = 150_000  # characters that are added, and twice as many
_SECONDS = 6.0  # of the processor for a reader: the outer parts of its input come first
_LEAST = 6  # ways of growing that are tried, however slow the reader is
_MOST = 2.6  # times as long for twice the size
_QUICK_S = 0.15  # of the processor, in which even twice the size is read: nothing to compare
_TRIES = 5  # until one is quick enough: a busy machine makes some slow, and none too quick

_Grow = Callable[[int], Any]


def find_growth(reader: Reader, folder: Path) -> Iterator[str]:
    """Yield a line for each part of a reader's input whose growth takes too long to read."""
    file = reader.make(folder)
    sound = file.read_bytes()
    reader.read(folder)
    end = time.process_time() + _SECONDS
    for number, (name, make) in enumerate(_grown(sound, reader.form)):
        if number >= _LEAST and time.process_time() > end:
            break

        def time_for(size: int, make: Callable[[int], bytes] = make) -> float:
            file.write_bytes(make(size))
            gc.collect()
            gc.disable()  # its turns are no part of the reader
            start = time.process_time()
            with contextlib.suppress(Exception):  # a refusal; fuzzing tells others from it
                reader.read(folder)
            seconds = time.process_time() - start
            gc.enable()
            return seconds

        ratio = 0.0
        for _ in range(_TRIES):
            twice = time_for(2 * _SIZE)
            if twice < _QUICK_S:
                break
            ratio = twice / time_for(_SIZE)
            if ratio <= _MOST:
                break
        else:
            yield f"{reader.name}, {name}: {ratio:.1f} times as long for twice the size"
    file.write_bytes(sound)


def _grown(sound: bytes, form: Form) -> Iterator[tuple[str, Callable[[int], bytes]]]:
    if form is Form.BYTES:
        return
    if form is Form.TEXT:
        lines = sound.splitlines(keepends=True)
        yield "its lines", lambda size: sound + b"".join(lines[1:]) * (size // len(sound) + 1)
        yield "its last line", lambda size: sound.rstrip() + b" word" * (size // 5)
        return
    read, write = CODECS[form]
    document = read(sound)
    for path in _places(document):
        value = _at(document, path)
        for how, grow in _ways(value):

            def make(size: int, path: tuple[Any, ...] = path, grow: _Grow = grow) -> bytes:
                if not path:
                    return write(grow(size))
                whole = copy.deepcopy(document)
                _at(whole, path[:-1])[path[-1]] = grow(size)
                return write(whole)

            yield f"{'/'.join(map(str, path)) or 'all of it'}, {how}", make


def _places(document: Any) -> list[tuple[Any, ...]]:
    """Return the paths of texts, lists and mappings, one of each kind of place."""
    found: dict[tuple[Any, ...], tuple[Any, ...]] = {}
    queue: list[tuple[Any, ...]] = [()]
    for path in queue:
        value = _at(document, path)
        kind = tuple("*" if isinstance(part, int) and part > 1 else part for part in path)
        if not isinstance(value, str | list | dict) or kind in found:
            continue
        found[kind] = path
        if isinstance(value, dict):
            queue += [(*path, name) for name in list(value)[:20]]
        elif isinstance(value, list):
            queue += [(*path, at) for at in range(min(3, len(value)))]
    return list(found.values())


def _at(document: Any, path: tuple[Any, ...]) -> Any:
    for part in path:
        document = document[part]
    return document


def _ways(value: Any) -> Iterator[tuple[str, _Grow]]:
    if isinstance(value, str):
        yield "words", lambda size: value + " word" * (size // 5)
        yield "one word", lambda size: value + "a" * size
        return
    entry = (list(value.values()) if isinstance(value, dict) else value[-1:] or [0])[-1:] or [0]
    length = len(json.dumps(entry[0], default=str)) + 10

    def entries(size: int, *, equal: bool) -> list[Any]:
        return [entry[0] if equal else _other(entry[0], at) for at in range(size // length + 1)]

    if isinstance(value, list):
        yield "equal entries", lambda size: value + entries(size, equal=True)
        yield "entries", lambda size: value + entries(size, equal=False)
    else:
        yield (
            "names",
            lambda size: (
                value | {f"n{at}": one for at, one in enumerate(entries(size, equal=True))}
            ),
        )


def _other(value: Any, number: int) -> Any:
    """Return a value with another number in each text and each integer of it."""
    if isinstance(value, str):
        return f"{value}{number}"
    if isinstance(value, bool) or not isinstance(value, int | list | dict):
        return value
    if isinstance(value, int):
        return value + number
    if isinstance(value, list):
        return [_other(one, number) for one in value]
    return {name: one if name == "type" else _other(one, number) for name, one in value.items()}
