"""Writing trajectories that are compressed together: their pictures, logs and files."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import IMAGE_FOLDERS, NiehSet
from infthor_eval.formats.packed.pack import SHARED, split_log
from infthor_eval.formats.packed.paths import ImageSize, SetPath
from infthor_eval.formats.packed.table_writer import TableWriter
from infthor_eval.formats.reading import file_problem, is_encodable
from infthor_eval.formats.step_log import LOG, Step, read_steps
from infthor_eval.storage.digests import digest

_LARGE_PART = 2**26  # bytes of a row group of files
_LARGE_FILE = 2**22  # bytes; it is a row group by itself
_LARGEST = 2**63  # a number that no column can hold
_LARGEST_FILE = 2**31 - 2  # bytes that a column cannot hold


@dataclass
class Packed:
    """What became of a set.

    Attributes:
        n_trajectories: trajectories that are in the new one.
        damaged: why others are not.
        left_out: why other files are not, by path.
    """

    n_trajectories: int = 0
    damaged: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Picture:
    """A frame that is written: digest, bytes, size in pixels, and place."""

    digest: str
    n_bytes: int
    size: ImageSize | None
    place: Mapping[str, int]

    @property
    def row(self) -> dict[str, Any]:
        """What a step's row says of it."""
        size = dict(zip(("width", "height"), self.size, strict=True)) if self.size else {}
        return {"frame": self.digest, "n_bytes": self.n_bytes, **size, **self.place}


@dataclass(frozen=True)
class _Log:
    """A step log: entries, as JSON, and the file's content if it is made of these alone."""

    steps: Sequence[Step]
    lines: Sequence[str | None]
    content: bytes | None = None


class GroupWriter:
    """Trajectories that are compressed together."""

    def __init__(self, data: NiehSet, tables: TableWriter, packed: Packed) -> None:
        self._data = data
        self._packed = packed
        self._tables = tables
        roots = (data.folder(""), data.directory)
        self._inside = [root.resolve() for root in roots if isinstance(root, Path)]
        self._frames: dict[str, dict[int, FrameRef]] = {}
        self._pictures: dict[FrameRef, _Picture] = {}

    def write(self, names: Sequence[str]) -> list[dict[str, Any]]:
        """Write what can be read of trajectories, and return their own rows."""
        for name in names:
            try:
                numbers = self._data.frame_numbers(name)
                self._check(name, numbers)
                self._frames[name] = dict(zip(numbers, self._data.frames(name), strict=True))
            except DataError as error:
                self._packed.damaged.append(str(error))
        if not self._frames:
            return []
        self._write_frames()
        logs = {name: self._read_log(name) for name in self._frames}
        files = self._write_files(logs)
        steps = [self._steps(name, logs[name]) for name in self._frames]
        place = self._tables.write("steps", list(chain.from_iterable(steps)))
        return [self._trajectory(name, files[name]) | place for name in self._frames]

    def _check(self, name: str, numbers: Sequence[int]) -> None:
        """Refuse a trajectory that Parquet cannot hold."""
        if not numbers or max(map(abs, numbers)) >= _LARGEST or not is_encodable(name):
            folder = self._data.folder(name)
            raise DataError(f"{folder}: has no frame, or a number or name that no table can hold")

    def _write_frames(self) -> None:
        """Write each distinct picture once; those of one step are neighbours."""
        by_step = chain.from_iterable(zip_longest(*(it.values() for it in self._frames.values())))
        frames = iter(dict.fromkeys(frame for frame in by_step if frame is not None))
        places: dict[str, Mapping[str, int]] = {}
        while part := list(islice(frames, self._tables.settings.frames_per_group)):
            read = {
                frame: frame.path.read_bytes() for frame in part if self._may_be_read(frame.path)
            }
            digests = {frame: digest(content) for frame, content in read.items()}
            new = {name: frame for frame, name in digests.items() if name not in places}
            rows = [
                {"digest": name, "image": {"bytes": read[frame], "path": frame.name}}
                for name, frame in new.items()
            ]
            if rows:
                place = self._tables.write("frames", rows)
                places |= {name: {**place, "row": row} for row, name in enumerate(new)}
            for frame, name in digests.items():
                size = _size_of(frame)
                self._pictures[frame] = _Picture(name, len(read[frame]), size, places[name])

    def _may_be_read(self, path: SetPath) -> bool:
        """Return False for what is no file of the set; links that lead out of it are none."""
        problem = file_problem(path)
        if problem is None and not is_encodable(path.name):
            problem = "has a name that is no text"
        if problem is None and path.stat().st_size >= _LARGEST_FILE:
            problem = "is too large for a table"
        if problem is None and isinstance(path, Path):
            place = path.resolve()
            if not any(place.is_relative_to(root) for root in self._inside):
                problem = "is a link that leads out of the set"
        if problem is not None:
            self._packed.left_out[str(path)] = problem
        return problem is None

    def _read_log(self, name: str) -> _Log:
        folder = self._data.folder(name)
        steps = read_steps(folder)
        if not (folder / LOG).is_file():
            return _Log(steps, [None] * len(steps))
        content = (folder / LOG).read_bytes()
        lines = split_log(content)
        if lines is not None and len(lines) == len(steps):
            return _Log(steps, [line.decode() for line in lines], content)
        return _Log(steps, [msgspec.json.encode(step).decode() for step in steps])

    def _write_files(self, logs: Mapping[str, _Log]) -> dict[str, list[dict[str, Any]]]:
        """Write all that is in trajectories' folders but frames, and logs that are in the steps;
        return what each trajectory's row says of them."""
        frames = {str(frame.path) for frame in self._pictures}
        listed: dict[str, list[dict[str, Any]]] = {}
        small: list[list[dict[str, Any]]] = [[]]  # row groups
        large: list[list[dict[str, Any]]] = []
        n_bytes = 0  # of the last of the small ones
        for name, log in logs.items():
            folder = self._data.folder(name)
            listed[name] = [] if log.content is None else [_listed(LOG, log.content)]
            for path in self._walk(folder):
                if str(path) in frames or (log.content is not None and path == folder / LOG):
                    continue
                if not self._may_be_read(path):
                    continue
                inside = str(path).removeprefix(f"{folder}/")
                content = path.read_bytes()
                row = {"traj_id": name, "name": inside, "content": content}
                if len(content) > _LARGE_FILE:
                    large.append([row])
                    continue
                n_bytes += len(content)
                if n_bytes > _LARGE_PART:
                    small.append([])
                    n_bytes = len(content)
                small[-1].append(row)
        for part in filter(None, (*small, *large)):
            place = self._tables.write("files", part)
            for at, entry in enumerate(part):
                named = _listed(entry["name"], entry["content"])
                listed[entry["traj_id"]].append({**named, **place, "row": at})
        return listed

    def _walk(self, folder: SetPath) -> Iterator[SetPath]:
        """Yield all files below a folder, in order of their names."""
        for path in sorted_paths(folder):
            if isinstance(path, Path) and path.is_symlink() and path.is_dir():
                if path.name not in IMAGE_FOLDERS:
                    self._packed.left_out[str(path)] = "is a link to a folder"
            elif path.is_dir():
                yield from self._walk(path)
            else:
                yield path

    def _steps(self, name: str, log: _Log) -> Iterator[dict[str, Any]]:
        folder = f"{self._data.folder(name)}/"
        for step, line in zip(log.steps, log.lines, strict=True):
            frame = self._frames[name][step.img_idx]
            picture = self._pictures.get(frame)
            path = str(frame.path)
            yield {
                "traj_id": name,
                "img_idx": step.img_idx,
                "file": path.removeprefix(folder)
                if path.startswith(folder)
                else f"{SHARED}/{frame.name}",
                "action": step.action,
                "success": step.success,
                "log": line,
                **(msgspec.to_builtins(step.pose) if step.pose else {}),
                **(picture.row if picture else {}),
            }

    def _trajectory(self, name: str, files: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        world = self._data.twins.get(name)
        scene = world.floor_plan if world else None
        with suppress(DataError):  # contexts that need it say so
            outline = self._data.outline(name)
            scene = scene or (outline.floor_plan if outline else None)
        return {
            "traj_id": name,
            "scene": scene,
            "base": world.base if world else None,
            "n_frames": len(self._frames[name]),
            "files": files,
        }


def _listed(name: str, content: bytes) -> dict[str, Any]:
    return {"name": name, "n_bytes": len(content), "digest": digest(content)}


def sorted_paths(folder: SetPath) -> list[SetPath]:
    """Return what is in a folder, in order of the names."""
    paths: list[SetPath] = [*folder.iterdir()]
    return sorted(paths, key=lambda path: path.name)


def _size_of(frame: FrameRef) -> ImageSize | None:
    try:
        return frame.size
    except DataError:  # is said of it when it is shown
        return None
