"""Reading a packed set as the folder that it was made of.

Every file that is read has the digest that the tables have of it, or is refused.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packed.hub import HubStore, is_remote
from infthor_eval.formats.packed.paths import READ, ImageSize, PackedPath
from infthor_eval.formats.packed.tables import DAMAGED, HINT, LocalStore, Shards, Store
from infthor_eval.storage.digests import digest
from infthor_eval.storage.files import write_atomically, writing_hint

METADATA = "metadata"
SHARED = "frames"
_LOG_START, _LOG_BREAK, _LOG_END = b"[\n", b",\n", b"\n]\n"  # of our step logs, an entry a line
_DEEPEST = 100  # folders in one another
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

    def __post_init__(self) -> None:
        """Raise ValueError if this is no place of a file."""
        numbers = (self.n_bytes, self.shard, self.row_group, self.row)
        if not all(isinstance(number, int) and number >= 0 for number in numbers):
            raise ValueError(f"no place of a file: {numbers}")


@dataclass(frozen=True)
class _Steps:
    """What a row group of steps has: frames by trajectory and file, and each one's rows."""

    frames: Mapping[str, Mapping[str, _Entry]]
    rows: Mapping[str, range]


def _is_name(part: str) -> bool:
    """Return True for what a file can be called anywhere."""
    return part not in {"", ".", ".."} and "\0" not in part and len(part.encode()) < 256


def _size(size: Sequence[int | None]) -> ImageSize | None:
    width, height = size
    return None if width is None or height is None else (width, height)


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
        self._store: Store = HubStore(root) if is_remote(root) else LocalStore(root)
        self._tables = {table: Shards(table, self._store) for table in READ}
        self._is_checked = check
        self.refused: list[str] = []  # why trajectories are not read, of a set that is not checked
        if check:
            for shards in self._tables.values():
                shards.check()
        self._files: dict[str, Mapping[str, _Entry]] = {}
        self._steps: dict[tuple[int, int], _Steps] = {}  # by shard and row group
        self._shared: dict[str, _Entry] = {}
        self._shared_by: dict[str, Mapping[str, _Entry]] = {}  # by trajectory

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

    def shared_files(self, traj_id: str) -> Iterator[PackedPath]:
        """Yield a trajectory's pictures that are not in its folder."""
        self._read_trajectory(traj_id)
        for name in self._shared_by[traj_id]:
            yield PackedPath(f"{SHARED}/{name}", self)

    def read(self, file: str) -> bytes:
        """Return the content of a file that is there.

        Raises:
            DataError: it cannot be read, or is not what it was.
        """
        entry = self._find(file)
        assert entry is not None
        # Of a set on a server, a frame that was read before is here.
        kept = self._store.kept(entry.digest) if entry.table == "frames" else None
        if kept is None:
            return self._read_entry(entry, file)
        with wrap_errors(f"{kept}: cannot be kept", writing_hint(", or set XDG_CACHE_HOME")):
            if kept.is_file() and digest(content := kept.read_bytes()) == entry.digest:
                return content
            content = self._read_entry(entry, file)
            kept.parent.mkdir(parents=True, exist_ok=True)
            with write_atomically(kept) as partial:
                partial.write_bytes(content)
        return content

    def _read_entry(self, entry: _Entry, file: str) -> bytes:
        table = self._tables[entry.table]
        where = f"{self.root / file}: cannot be read"
        if entry.table == "steps":
            rows = table.read(entry.shard, entry.row_group, ("log",))
            with wrap_errors(where, HINT, catch=DAMAGED):
                group = self._read_steps(entry.shard, entry.row_group)
                own = group.rows[PurePosixPath(file).parts[1]]
                logs = rows["log"].slice(own.start, len(own)).to_pylist()
                content = join_log([log.encode() for log in logs])
        else:
            column = "image" if entry.table == "frames" else "content"
            rows = table.read(entry.shard, entry.row_group, (column,))
            with wrap_errors(where, HINT, catch=DAMAGED):
                value = rows[column][entry.row].as_py()
                content = value["bytes"] if entry.table == "frames" else value
        is_bytes = isinstance(content, bytes) and len(content) == entry.n_bytes
        if not is_bytes or digest(content) != entry.digest:
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
            for traj_id in self._trajectories:
                self._read_trajectory(traj_id)
        return self._shared.get(parts[1])

    @cached_property
    def _trajectories(self) -> Mapping[str, Mapping[str, Any]]:
        table = self._tables["trajectories"]
        names = ("traj_id", "shard", "row_group", "files")
        by_name: dict[str, Mapping[str, Any]] = {}
        n_rows = 0
        for place in table.groups():
            with wrap_errors(f"{self.root}: its trajectories cannot be read", HINT, catch=DAMAGED):
                rows = table.read(*place, names).to_pylist()
            by_name |= {row["traj_id"]: row for row in rows}
            n_rows += len(rows)
            if len(by_name) < n_rows:
                raise DataError(f"{self.root}: has rows of a trajectory twice; {HINT}")
        for name in list(by_name):
            try:
                self._check_name(name, 1)
            except DataError as error:
                if self._is_checked:
                    raise
                self.refused.append(str(error))
                del by_name[name]
        return by_name

    def _read_trajectory(self, traj_id: str) -> Mapping[str, _Entry]:
        """Return the files of a trajectory's folder by their path in it."""
        if traj_id not in self._files:
            row = self._trajectories[traj_id]
            shared: dict[str, _Entry] = {}
            with wrap_errors(f"{self.root}: trajectory {traj_id}", HINT, catch=DAMAGED):
                files = self._index_files(row)
                group = self._read_steps(row["shard"], row["row_group"])
                for name, frame in group.frames.get(traj_id, {}).items():
                    if self._check_name(name).startswith(f"{SHARED}/"):
                        shared[name.removeprefix(f"{SHARED}/")] = frame
                    elif name in files:
                        raise DataError(f"{self.root}: {traj_id} has {name} twice; {HINT}")
                    else:
                        files[name] = frame
                folders = {str(above) for name in files for above in PurePosixPath(name).parents}
                if both := sorted(folders & files.keys()):
                    raise DataError(f"{self.root}: {traj_id}/{both[0]} is a file and a folder")
            self._files[traj_id] = files
            self._shared_by[traj_id] = shared
            self._shared |= shared
        return self._files[traj_id]

    def _index_files(self, row: Mapping[str, Any]) -> dict[str, _Entry]:
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
        return files

    def _read_steps(self, shard: int, row_group: int) -> _Steps:
        """Return what a row group of steps has of each trajectory in it."""
        if (shard, row_group) not in self._steps:
            steps = self._tables["steps"].read(shard, row_group, _STEP_COLUMNS)
            frames: dict[str, dict[str, _Entry]] = {}
            rows: dict[str, range] = {}  # those of a trajectory are neighbours
            columns = [steps[name].to_pylist() for name in _STEP_COLUMNS]
            for at, (name, file, frame, n_bytes, *size, group, at_group, at_row) in enumerate(
                zip(*columns, strict=True)
            ):
                rows[name] = range(rows[name].start if name in rows else at, at + 1)
                if frame is not None:
                    entry = _Entry("frames", n_bytes, frame, group, at_group, at_row, _size(size))
                    frames.setdefault(name, {})[file] = entry
            self._steps[shard, row_group] = _Steps(frames, rows)
        return self._steps[shard, row_group]

    def _check_name(self, name: object, most: int = _DEEPEST) -> str:
        """Return a path within the set that cannot lead out of it."""
        parts = name.split("/") if isinstance(name, str) else [""]
        if len(parts) > most or not all(map(_is_name, parts)):
            raise DataError(f"{self.root}: {name!r:.80} is no path within a set; {HINT}")
        return str(name)


@cache
def _open_once(root: Path) -> ParquetPack:
    return ParquetPack(root)
