"""The batches of a run, on disk: which requests each has, its name at the server, its replies."""

import os
import secrets
import time
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.storage.files import remove, write_atomically, writing_hint
from model_adapters.served.batches.service import Batch, BatchReply

_BATCH = ".json"
_REQUESTS = ".requests.jsonl"
_REPLIES = ".replies.jsonl"


class Ledger:
    """A folder with three files for each batch.

    `NAME.requests.jsonl` is what is submitted, and is removed once the server has it. `NAME.json`
    is the batch (`Batch`): it is written when the requests are complete, again when the server's
    name of it is known, and when it has ended. `NAME.replies.jsonl` is what the server gave. Each
    is replaced as a whole, and is on disk before the next step.
    """

    def __init__(self, folder: Path) -> None:
        """Read a folder, or create it; requests that a killed process left incomplete are
        removed."""
        self._folder = folder
        with wrap_errors(f"{folder}: cannot be written", writing_hint("")):
            folder.mkdir(parents=True, exist_ok=True)
            self.batches = {
                path.name.removesuffix(_BATCH): self._read(path)
                for path in sorted(folder.glob(f"*{_BATCH}"))
                if not path.name.startswith(".")
            }
            for path in folder.glob(f"*{_REQUESTS}"):
                if path.name.removesuffix(_REQUESTS) not in self.batches:
                    remove(path)
        # A name of this run, so that no batch of another one is taken for one of it.
        known = next(iter(self.batches), None)
        self._run = known.partition("-")[0] if known else secrets.token_hex(4)

    def requests_file(self, name: str) -> Path:
        """Return the file with the requests of a batch."""
        return self._folder / f"{name}{_REQUESTS}"

    def next_name(self) -> str:
        """Return the name of the next batch."""
        numbers = [int(name.partition("-")[2]) for name in self.batches]
        return f"{self._run}-{max(numbers, default=0) + 1}"

    def prepare(self, name: str, ids: Sequence[str]) -> Batch:
        """Add a batch whose requests are complete."""
        self.batches[name] = Batch(name, list(ids), time.time())
        self._write(self.batches[name])
        return self.batches[name]

    def note_submitted(self, batch: Batch, server_id: str) -> None:
        """Note that the server has a batch."""
        batch.server_id = server_id
        self._write(batch)
        remove(self.requests_file(batch.name))

    def note_ended(self, batch: Batch, replies: Iterable[BatchReply]) -> None:
        """Keep the replies of a batch."""
        lines = b"".join(msgspec.json.encode(reply) + b"\n" for reply in replies)
        self._write_file(self._folder / f"{batch.name}{_REPLIES}", lines)
        batch.ended = True
        self._write(batch)
        remove(self.requests_file(batch.name))

    def replies(self, batch: Batch) -> list[BatchReply]:
        """Return the replies of a batch that has ended."""
        path = self._folder / f"{batch.name}{_REPLIES}"
        decode = msgspec.json.Decoder(BatchReply).decode
        with _wrap_reading(path):
            return [decode(line) for line in path.read_bytes().splitlines()]

    def _read(self, path: Path) -> Batch:
        with _wrap_reading(path):
            batch = msgspec.json.decode(path.read_bytes(), type=Batch)
        if batch.name != path.name.removesuffix(_BATCH):
            raise DataError(f"{path}: is of the batch {batch.name!r:.40}; rename it")
        return batch

    def _write(self, batch: Batch) -> None:
        self._write_file(self._folder / f"{batch.name}{_BATCH}", msgspec.json.encode(batch))

    def _write_file(self, path: Path, content: bytes) -> None:
        hint = writing_hint(" and run the same command again, which resumes it")
        with (
            wrap_errors(f"{path}: cannot be written", hint),
            write_atomically(path) as partial,
            partial.open("wb") as file,
        ):
            file.write(content)
            file.flush()
            os.fsync(file.fileno())


def _wrap_reading(path: Path) -> AbstractContextManager[None]:
    hint = "put it back, or start again with --fresh, which asks and pays again"
    return wrap_errors(f"{path}: cannot be read", hint, catch=(OSError, msgspec.DecodeError))
