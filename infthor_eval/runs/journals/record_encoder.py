"""Encodes records for a journal, and refuses what its reader would refuse or read otherwise.

A record holds what code and files of others gave: adapters, memories, scorers, judges, servers,
logs. One line that the reader refuses would cost a run everything else that is in its journal.

To add or change a limit of what records hold: its type, in the suite's `records.py`
(`infthor_eval.quantities` has those of numbers).
"""

from typing import Any, Generic

import msgspec

from infthor_eval.errors import DataError, in_one_line
from infthor_eval.runs.journals.records import Payload, RecordTypes
from infthor_eval.storage.limits import LINE_MB

_MB = 2**20
_HINT = "fix what gives it (the adapter, memory, scorer or suite) and run the same command again"
_LONGEST_VALUE = 60  # characters of a value in a message


class RefusedRecordError(DataError):
    """A record that a journal cannot hold; the message names the field, and what is wrong."""


class RecordEncoder(Generic[Payload]):
    """Turns records of one suite into lines, each of which decodes to an equal record."""

    def __init__(self, types: RecordTypes[Payload]) -> None:
        """Take the types by which journals of the suite are read."""
        self._decoder = types.decoder()
        self._encoder = msgspec.json.Encoder()

    def encode(self, record: Any) -> bytes:
        """Return the line of a record, header or artifact, without its end."""
        try:
            line = self._encoder.encode(record)
            decoded = self._decoder.decode(line)
        # ValueError: of msgspec, and of lone surrogates; TypeError: an object that is no JSON.
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise _refusal(in_one_line(error)) from error
        if len(line) > LINE_MB.value * _MB:
            raise _refusal(f"it is longer than {LINE_MB.value} MiB; {LINE_MB.hint}")
        if decoded != record:  # NaN in a field of any type is null, bytes are a text
            raise _refusal(_difference(record, decoded))
        return line


def _refusal(reason: str) -> RefusedRecordError:
    return RefusedRecordError(f"the record cannot be kept ({reason}); {_HINT}")


def _difference(given: Any, read: Any) -> str:
    """Return the first field that is read otherwise, in words."""
    path = "$"
    while pair := next(_differing_items(given, read), None):
        name, given, read = pair
        path = f"{path}.{name}" if isinstance(name, str) else f"{path}[{name}]"
    return f"{given!r:.{_LONGEST_VALUE}} would be read as {read!r:.{_LONGEST_VALUE}} - at `{path}`"


def _differing_items(given: Any, read: Any) -> Any:
    """Yield name, value given and value read of items that differ, if both have the same."""
    if type(given) is not type(read):
        return
    if isinstance(given, msgspec.Struct):
        names: Any = given.__struct_fields__
        items = [(name, getattr(given, name), getattr(read, name)) for name in names]
    elif isinstance(given, dict) and given.keys() == read.keys():
        items = [(name, given[name], read[name]) for name in given]
    elif isinstance(given, tuple | list) and len(given) == len(read):
        items = list(zip(range(len(given)), given, read, strict=True))
    else:
        return
    yield from (item for item in items if item[1] != item[2])
