"""The Parquet tables of a packed set: their columns, and reading them safely.

A table is in shards, `TABLE-00000-of-00002.parquet`. Rows of others are named by shard, row group
and row, so that a reader that has a set on a server fetches what it shows and no more. Pictures and
logs of one trajectory, or of all worlds of one base, are in row groups of their own.
"""

import re
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

import pyarrow as pa
import pyarrow.parquet as pq

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packed.hub import HubStore
from infthor_eval.formats.reading import file_problem
from infthor_eval.storage.limits import FILE_MB

_IMAGE = pa.struct({"bytes": pa.binary(), "path": pa.string()})
_ROWS = {"shard": pa.int32(), "row_group": pa.int32()}
_PLACE = {**_ROWS, "row": pa.int32()}
_POSE = ("x", "y", "z", "rotation", "horizon")
_TEXTS = pa.list_(pa.string())
SCHEMAS = {
    "questions": pa.schema(
        {
            "id": pa.string(),
            "traj_id": pa.string(),
            "question": pa.string(),
            "answer": _TEXTS,
            "gt_img_idx": pa.list_(pa.int64()),
            "question_type": pa.string(),
            "absence": pa.bool_(),
            "moment": pa.int64(),
            "pair": pa.string(),
            "fact": pa.string(),
            "file": pa.string(),
            "clue_frames": pa.list_(_IMAGE),
        }
    ),
    "frames": pa.schema({"digest": pa.string(), "image": _IMAGE}),
    "steps": pa.schema(
        {
            "traj_id": pa.string(),
            "img_idx": pa.int64(),
            "file": pa.string(),
            "frame": pa.string(),
            "n_bytes": pa.int64(),
            "width": pa.int32(),
            "height": pa.int32(),
            **_PLACE,
            "action": pa.string(),
            "success": pa.bool_(),
            **dict.fromkeys(_POSE, pa.float64()),
            "log": pa.string(),
        }
    ),
    "files": pa.schema({"traj_id": pa.string(), "name": pa.string(), "content": pa.binary()}),
    "trajectories": pa.schema(
        {
            "traj_id": pa.string(),
            "scene": pa.string(),
            "base": pa.string(),
            "n_frames": pa.int64(),
            **_ROWS,
            "files": pa.list_(
                pa.struct(
                    {"name": pa.string(), "n_bytes": pa.int64(), "digest": pa.string(), **_PLACE}
                )
            ),
        }
    ),
    "twins": pa.schema(
        {
            "id": pa.string(),
            "kind": pa.string(),
            "scene": pa.string(),
            "base": pa.string(),
            "traj_ids": _TEXTS,
            "types": _TEXTS,
            "changed": _TEXTS,
            "differing_frames": pa.list_(pa.int64()),
            "questions": pa.list_(
                pa.struct({"question": pa.string(), "answers": pa.list_(_TEXTS)})
            ),
        }
    ),
}
_ENCODINGS = {"PLAIN", "RLE", "BIT_PACKED"}
_SHARD = re.compile(r"([a-z]+)-(\d{5})-of-(\d{5})\.parquet")
_LARGEST_GROUP = 2**20  # rows
_MOST_VALUES = 2**22  # in a column of a row group
_MOST_SHARDS = 100_000
_KEPT = 2**28  # bytes of row groups, decoded
HINT = "pack the set again, or save what is whole: infthor-eval unpack --skip-damaged"

# What pyarrow raises on damaged and forged files. RuntimeError: thrift's.
DAMAGED = (
    pa.ArrowException,
    AttributeError,
    OSError,
    ValueError,
    LookupError,
    TypeError,
    ArithmeticError,
    MemoryError,
    RuntimeError,
)


@dataclass(frozen=True)
class LocalStore:
    """A folder of this machine."""

    root: Path
    failures: tuple[type[Exception], ...] = DAMAGED  # raised where a file is damaged

    def kept(self, digest: str) -> None:
        """Return None: frames are here anyway."""

    def names(self) -> Sequence[str]:
        """Return the names of its Parquet files."""
        return [path.name for path in self.root.glob("*.parquet")]

    def open(self, name: str) -> str:
        """Return a file's path.

        Raises:
            OSError: it is no file; a pipe would block.
        """
        problem = file_problem(self.root / name)
        if problem is not None:
            raise OSError(problem)
        return str(self.root / name)


Store = LocalStore | HubStore  # where the files of a packed set are


def shard_name(table: str, shard: int, n_shards: int) -> str:
    """Return the name of a table's file."""
    return f"{table}-{shard:05d}-of-{n_shards:05d}.parquet"


class Shards:
    """The files of one table."""

    def __init__(self, table: str, store: Store) -> None:
        """Find them; none is opened."""
        self._table = table
        self._schema = SCHEMAS[table]
        self._store = store
        found = [match for name in store.names() if (match := _SHARD.fullmatch(name))]
        self._found = sorted(match[0] for match in found if match[1] == table)
        n_shards = min(max((int(it[3]) for it in found if it[1] == table), default=0), _MOST_SHARDS)
        self._names = [shard_name(table, at, n_shards) for at in range(n_shards)]
        self._files: dict[str, pq.ParquetFile] = {}
        self._read: OrderedDict[tuple[object, ...], pa.Table] = OrderedDict()
        self._lock = Lock()  # pyarrow's readers are not made for several threads

    def check(self) -> None:
        """Open all files.

        Raises:
            DataError: one is missing, cannot be opened, or has other columns.
        """
        if self._found != self._names:
            raise DataError(
                f"{self._store.root}: has {len(self._found)} of {len(self._names)} files "
                f"{self._table}-*.parquet; {HINT}"
            )
        for name in self._names:
            self._open(name)

    def groups(self) -> list[tuple[int, int]]:
        """Return shard and number of each row group."""
        counts = [self._open(name).num_row_groups for name in self._names]
        return [(shard, group) for shard, n in enumerate(counts) for group in range(n)]

    def read(self, shard: int, row_group: int, columns: Sequence[str]) -> pa.Table:
        """Return columns of a row group.

        Raises:
            DataError: there is no such row group, it is too large, or damaged.
        """
        key = (shard, row_group, *columns)
        with self._lock:
            if key in self._read:
                self._read.move_to_end(key)
                return self._read[key]
            self._read[key] = table = self._decode(shard, row_group, columns)
            while len(self._read) > 1 and sum(it.nbytes for it in self._read.values()) > _KEPT:
                self._read.popitem(last=False)
            return table

    def _decode(self, shard: int, row_group: int, columns: Sequence[str]) -> pa.Table:
        if not 0 <= shard < len(self._names):
            raise DataError(
                f"{self._store.root}: file {shard} of {self._table} is not there; {HINT}"
            )
        path = self._store.root / self._names[shard]
        file = self._open(self._names[shard])
        if not 0 <= row_group < file.num_row_groups:
            raise DataError(f"{path}: has no row group {row_group}; {HINT}")
        failures = self._store.failures
        with wrap_errors(f"{path}: row group {row_group} cannot be read", HINT, catch=DAMAGED):
            group = file.metadata.row_group(row_group)
        self._check_size(path, group)
        with wrap_errors(f"{path}: row group {row_group} cannot be read", HINT, catch=failures):
            table = file.read_row_group(row_group, columns=list(columns), use_threads=False)
            table.validate(full=True)  # a forged file may have texts that are not UTF-8
            return table

    def _check_size(self, path: Path, group: pq.RowGroupMetaData) -> None:
        """Refuse a row group that would fill the memory."""
        columns = [group.column(at) for at in range(group.num_columns)]
        n_bytes = sum(column.total_uncompressed_size for column in columns)
        n_bytes = max(n_bytes, group.total_byte_size)
        if group.num_rows > _LARGEST_GROUP or n_bytes > FILE_MB.value * 2**20:
            raise DataError(
                f"{path}: a row group of {group.num_rows:,} rows and {n_bytes:,} bytes is too "
                f"large; {FILE_MB.hint}"
            )
        for column in columns:
            # In others a long value can stand for a million; ours are not so encoded.
            others = set(column.encodings) - _ENCODINGS
            if others or column.num_values > _MOST_VALUES:
                what = f"encoded as {min(others)}" if others else f"{column.num_values:,} values"
                raise DataError(f"{path}: {column.path_in_schema} is {what}; {HINT}")

    def _open(self, name: str) -> pq.ParquetFile:
        if name not in self._files:
            path = self._store.root / name
            failures = self._store.failures
            with wrap_errors(f"{path}: not a Parquet file, or cut off", HINT, catch=failures):
                file = pq.ParquetFile(self._store.open(name))
                schema = file.schema_arrow
            self._check_columns(path, schema)
            self._files[name] = file
        return self._files[name]

    def _check_columns(self, path: Path, schema: pa.Schema) -> None:
        for field in self._schema:
            at = schema.get_field_index(field.name)
            found = None if at < 0 else schema.field(at).type
            if found != field.type:
                what = "no such column" if found is None else f"{found}, not {field.type}"
                raise DataError(f"{path}: column {field.name}: {what}; {HINT}")
