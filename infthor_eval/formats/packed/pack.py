"""Reading a packed set as the folder that it was made of.

Every file that is read has the digest that the tables have of it, or is refused.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packed.hub import HubStore
from infthor_eval.formats.packed.paths import READ, REMOTE, ImageSize, PackedPath
from infthor_eval.formats.packed.tables import DAMAGED, HINT, LocalStore, Shards, Store
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import write_atomically, writing_hint

METADATA = "metadata"
SHARED = "frames"
_LOG_START, _LOG_BREAK, _LOG_END = b"[\n", b",\n", b"\n]\n"  # of our step logs, an entry a line
_STEP_COLUMNS = (
    "traj_id",
    "file",
    "frame",
    "n_bytes",
    "width",
    "height",
    "shard",
    "row_group",
    "row",
)


@dataclass(frozen=True)
class _Entry:
    """A file, and where its content is: in `frames`, in `files`, or, a log, in `steps`."""

    table: str
    n_bytes: int
    digest: str
    shard: int
    row_group: int
    row: int = 0
    size: ImageSize | None = None


def split_log(content: bytes) -> list[bytes] | None:
    """Return the entries of a step log, or None if `join_log` would not give its bytes again."""
    lines = content[len(_LOG_START) : -len(_LOG_END)].split(_LOG_BREAK)
    return lines if join_log(lines) == content else None


def join_log(lines: list[bytes]) -> bytes:
    """Return the content of a step log with these entries."""
    return _LOG_START + _LOG_BREAK.join(lines) + _LOG_END


class ParquetPack:
    """The files of a packed set, by path.

    Args:
        root: its folder; the tables of one that is on the hub are read there.
        check: False to open them only as they are needed: one may be damaged.
    """

    def __init__(self, root: Path, *, check: bool = True) -> None:
        self.root = root
        self._store: Store = HubStore(root) if (root / REMOTE).is_file() else LocalStore(root)
        self._tables = {table: Shards(table, self._store) for table in READ}
        if check:
            for shards in self._tables.values():
                shards.check()
        self._files: dict[str, Mapping[str, _Entry]] = {}
        self._shared: dict[str, _Entry] = {}

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Path]]:
        """Frames of one set that are sent to another process have one pack there too."""
        return _open_once, (self.root,)

    @property
    def metadata(self) -> PackedPath:
        """The folder of the trajectories' folders."""
        return PackedPath(METADATA, self)

    def names(self, folder: str) -> Collection[str] | None:
        """Return the names of what is in a folder, or None if there is none of this path."""
        top, *parts = PurePosixPath(folder).parts
        if top != METADATA:
            return None
        if not parts:
            return self._trajectories.keys()
        if parts[0] not in self._trajectories:
            return None
        above = "".join(f"{part}/" for part in parts[1:])
        inside = self._read_trajectory(parts[0])
        below = [name.removeprefix(above) for name in inside if name.startswith(above)]
        return list(dict.fromkeys(name.split("/")[0] for name in below)) or None

    def n_bytes(self, file: str) -> int | None:
        """Return the size of a file, or None if there is none of this path."""
        entry = self._find(file)
        return entry.n_bytes if entry else None

    def image_size(self, file: str) -> ImageSize | None:
        """Return the size of a frame in pixels, or None if it is no image."""
        entry = self._find(file)
        return entry.size if entry else None

    def shared_files(self) -> Iterator[PackedPath]:
        """Yield the pictures that are in no trajectory's folder."""
        for traj_id in self._trajectories:
            self._read_trajectory(traj_id)
        for name in self._shared:
            yield PackedPath(f"{SHARED}/{name}", self)

    def read(self, file: str) -> bytes:
        """Return the content of a file that is there.

        Raises:
            DataError: it cannot be read, or is not what it was.
        """
        entry = self._find(file)
        assert entry is not None
        content = self._read_kept(entry)
        if content is None:
            content = self._read_entry(entry, file)
            self._keep(entry, content)
        return content

    def _read_kept(self, entry: _Entry) -> bytes | None:
        """Return the content of a frame of a set on a server that was read before."""
        kept = self._store.kept(entry.digest) if entry.table == "frames" else None
        if kept is None or not kept.is_file():
            return None
        content = kept.read_bytes()
        return content if digest(content) == entry.digest else None

    def _keep(self, entry: _Entry, content: bytes) -> None:
        kept = self._store.kept(entry.digest) if entry.table == "frames" else None
        if kept is not None:
            with wrap_errors(f"{kept}: cannot be written", writing_hint(", or set XDG_CACHE_HOME")):
                kept.parent.mkdir(parents=True, exist_ok=True)
                with write_atomically(kept) as partial:
                    partial.write_bytes(content)

    def _read_entry(self, entry: _Entry, file: str) -> bytes:
        table = self._tables[entry.table]
        where = f"{self.root / file}: cannot be read"
        if entry.table == "steps":
            rows = table.read(entry.shard, entry.row_group, ("traj_id", "log"))
            with wrap_errors(where, HINT, catch=DAMAGED):
                named = zip(rows["traj_id"].to_pylist(), rows["log"].to_pylist(), strict=True)
                traj_id = PurePosixPath(file).parts[1]
                content = join_log([log.encode() for name, log in named if name == traj_id])
        else:
            column = "image" if entry.table == "frames" else "content"
            rows = table.read(entry.shard, entry.row_group, (column,))
            with wrap_errors(where, HINT, catch=DAMAGED):
                value = rows[column][entry.row].as_py()
                content = value["bytes"] if entry.table == "frames" else value
        if not isinstance(content, bytes) or digest(content) != entry.digest:
            raise DataError(
                f"{self.root / file}: is not the content that its digest was taken of; {HINT}"
            )
        return content

    def _find(self, file: str) -> _Entry | None:
        parts = PurePosixPath(file).parts
        if parts[0] == METADATA and len(parts) > 2 and parts[1] in self._trajectories:
            return self._read_trajectory(parts[1]).get("/".join(parts[2:]))
        if parts[0] != SHARED or len(parts) != 2:
            return None
        if parts[1] not in self._shared:  # of a trajectory that was not opened in this process
            list(self.shared_files())
        return self._shared.get(parts[1])

    @cached_property
    def _trajectories(self) -> Mapping[str, Mapping[str, Any]]:
        table = self._tables["trajectories"]
        names = ("traj_id", "shard", "row_group", "files")
        rows = [row for at in table.groups() for row in table.read(*at, names).to_pylist()]
        by_name = {row["traj_id"]: row for row in rows}
        if len(by_name) < len(rows):
            raise DataError(f"{self.root}: has rows of a trajectory twice; {HINT}")
        for name in by_name:
            self._check_name(name, 1)
        return by_name

    def _read_trajectory(self, traj_id: str) -> Mapping[str, _Entry]:
        """Return the files of a trajectory's folder by their path in it."""
        if traj_id not in self._files:
            with wrap_errors(f"{self.root}: trajectory {traj_id}", HINT, catch=DAMAGED):
                self._files[traj_id] = self._index(traj_id)
        return self._files[traj_id]

    def _index(self, traj_id: str) -> dict[str, _Entry]:
        row = self._trajectories[traj_id]
        files = {}
        for file in row["files"]:
            in_steps = file["shard"] is None
            place = row if in_steps else file
            files[self._check_name(file["name"])] = _Entry(
                "steps" if in_steps else "files",
                file["n_bytes"],
                file["digest"],
                place["shard"],
                place["row_group"],
                file["row"] or 0,
            )
        steps = self._tables["steps"].read(row["shard"], row["row_group"], _STEP_COLUMNS)
        for step in steps.to_pylist():
            if step["traj_id"] != traj_id or step["frame"] is None:
                continue
            size = None if step["width"] is None else (step["width"], step["height"])
            place = (step["shard"], step["row_group"], step["row"])
            frame = _Entry("frames", step["n_bytes"], step["frame"], *place, size)
            name = self._check_name(step["file"])
            if name.startswith(f"{SHARED}/"):
                self._shared[name.removeprefix(f"{SHARED}/")] = frame
            else:
                files[name] = frame
        return files

    def _check_name(self, name: object, most: int = 8) -> str:
        """Return a path within the set that cannot lead out of it."""
        parts = name.split("/") if isinstance(name, str) else [""]
        if len(parts) > most or any(part in {"", ".", ".."} or "\0" in part for part in parts):
            raise DataError(f"{self.root}: {name!r:.80} is no path within a set; {HINT}")
        return str(name)


@cache
def _open_once(root: Path) -> ParquetPack:
    return ParquetPack(root)
