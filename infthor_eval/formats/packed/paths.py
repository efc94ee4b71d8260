"""Paths of files in a packed set, which are read as files in a folder are."""

import errno
import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from infthor_eval.formats.packed.pack import ParquetPack

ImageSize = tuple[int, int]  # width, height
READ = ("trajectories", "steps", "frames", "files")  # by us; the others are to be looked at
REMOTE = "remote.json"  # of a set on the hub, in the folder that stands for it
TABLES = ("questions", "frames", "steps", "trajectories", "twins", "files")


@dataclass(frozen=True, order=True)
class PackedPath:
    """A path in a packed set, with those of `pathlib.Path`'s methods that readers of sets need."""

    path: str
    pack: "ParquetPack"

    @property
    def name(self) -> str:
        """Last part of the path."""
        return PurePosixPath(self.path).name

    @property
    def stem(self) -> str:
        """Last part of the path without its suffix."""
        return PurePosixPath(self.path).stem

    @property
    def suffix(self) -> str:
        """Suffix of the last part of the path."""
        return PurePosixPath(self.path).suffix

    @property
    def parent(self) -> "PackedPath":
        """The folder that it is in; the set's own is "."."""
        return PackedPath(str(PurePosixPath(self.path).parent), self.pack)

    @property
    def image_size(self) -> ImageSize | None:
        """Width and height of a frame, pixels; None if it is no image."""
        return self.pack.image_size(self.path)

    def __truediv__(self, name: str) -> "PackedPath":
        """Return a path below this one."""
        return PackedPath(str(PurePosixPath(self.path) / name), self.pack)

    def __str__(self) -> str:
        """Return the path as messages show it."""
        return str(self.pack.root / self.path)

    def with_name(self, name: str) -> "PackedPath":
        """Return a path beside this one."""
        return self.parent / name

    def exists(self) -> bool:
        """Return True for a file or folder of the set."""
        return self.is_file() or self.is_dir()

    def is_file(self) -> bool:
        """Return True for a file of the set."""
        return self.pack.n_bytes(self.path) is not None

    def is_dir(self) -> bool:
        """Return True for a folder of the set."""
        return self.pack.names(self.path) is not None

    def iterdir(self) -> Iterator["PackedPath"]:
        """Yield what is in the folder."""
        for name in self.pack.names(self.path) or ():
            yield self / name

    def stat(self) -> os.stat_result:
        """Return kind and size, as the system does for a file."""
        n_bytes = self.pack.n_bytes(self.path)
        if n_bytes is None and not self.is_dir():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(self))
        kind = stat.S_IFDIR if n_bytes is None else stat.S_IFREG
        return os.stat_result((kind, 0, 0, 1, 0, 0, n_bytes or 0, 0, 0, 0))

    def read_bytes(self) -> bytes:
        """Return the content of the file."""
        self.stat()
        return self.pack.read(self.path)

    def open(self, mode: str = "rb") -> BytesIO:
        """Return the content of the file as an open one; `mode` is that of binary reading."""
        assert mode == "rb"
        return BytesIO(self.read_bytes())


SetPath = Path | PackedPath  # of a file or folder that belongs to a set


def is_packed(root: Path) -> bool:
    """Return True for a folder with a packed set."""
    return root.is_dir() and any(root.glob("trajectories-*-of-*.parquet"))


def metadata_folder(root: Path) -> SetPath:
    """Return the folder of the trajectories' folders of a set, packed or not."""
    if not is_packed(root):
        return root / "metadata"
    from infthor_eval.formats.packed.pack import ParquetPack  # which others need not load

    return ParquetPack(root).metadata


def frame_sources(root: Path) -> list[Path]:
    """Return what holds a set's frames and logs: `metadata/`, or the files of tables."""
    packed = [path for table in READ for path in sorted(root.glob(f"{table}-*-of-*.parquet"))]
    return [path for path in (root / "metadata", *packed, root / REMOTE) if path.exists()]


def table_configs(root: Path) -> list[dict[str, Any]]:
    """Return the tables of a packed set as the hub's cards name them, the first as the default."""
    found = {path.name.split("-")[0] for path in root.glob("*-*-of-*.parquet")}
    return [
        {"config_name": table, "data_files": f"{table}-*.parquet"}
        for table in TABLES
        if table in found
    ]
