"""Packing a set into Parquet, and unpacking it.

Pictures keep their bytes, so that a run on either form is the same. Tables are compressed over all
rows of a row group: pictures that are not compressed themselves, such as those of the bundled sets,
take a few bytes each where they are nearly equal.
"""

import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import IMAGE_FOLDERS, NiehSet
from infthor_eval.formats.packed.pack import METADATA, SHARED, ParquetPack, split_log
from infthor_eval.formats.packed.paths import REMOTE, ImageSize, SetPath, is_packed, table_configs
from infthor_eval.formats.packed.tables import SCHEMAS, shard_name
from infthor_eval.formats.question import Question
from infthor_eval.formats.reading import file_problem
from infthor_eval.formats.step_log import LOG, Step, read_steps
from infthor_eval.formats.twins import TwinPair
from infthor_eval.storage.digests import digest

CARD = ("README.md", "croissant.json", "card.png")  # written of either form by `card`
_README = """
An NIEH set of infthor-eval in Parquet; `infthor-eval card` writes a whole card here.
"""
_SHARD_BYTES = 500_000_000
_FRAMES = 32  # in a row group: what is fetched for one of them
_QUESTIONS = 256  # in a row group
_LARGE_PART = 2**26  # bytes of a row group of files
_LARGE_FILE = 2**22  # bytes; it is a row group by itself
_LARGEST = 2**63  # a number that no column can hold
_LARGEST_FILE = 2**31 - 2  # bytes that a column cannot hold
_ONE_PAGE = 2**30  # bytes; a page is what is compressed together


@dataclass(frozen=True)
class PackSettings:
    """How tables are written.

    Attributes:
        frames_per_group: frames that are compressed together, and read together.
        level: zstd's level of compression.
    """

    frames_per_group: int = _FRAMES
    level: int = 6


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


def pack_set(
    data: NiehSet,
    out: Path,
    settings: PackSettings = PackSettings(),
    advance: Callable[[], None] = lambda: None,
) -> Packed:
    """Write a set in Parquet.

    Args:
        data: the set.
        out: folder of the new one, which exists and has no such files.
        settings: how tables are written.
        advance: called after each trajectory.

    Raises:
        OSError: a file cannot be written.
    """
    packed = Packed()
    tables = _Tables(out, settings)
    trajectories: list[dict[str, Any]] = []
    for names in _groups(data).values():
        trajectories += _Group(data, tables, packed).write(names)
        for _ in names:
            advance()
    if trajectories:
        tables.write("trajectories", trajectories)
        packed.n_trajectories = len(trajectories)
    for at in range(0, len(data.questions), _QUESTIONS):
        part = data.questions[at : at + _QUESTIONS]
        tables.write("questions", [_question_row(data, it, packed.left_out) for it in part])
    pairs = {pair.id: pair for pair in data.twins.values()}
    if pairs:
        tables.write("twins", [_pair_row(pair) for pair in pairs.values()])
    tables.close()
    for file in sorted(data.directory.iterdir()):
        if file.name not in (METADATA, SHARED) and not _copy_file(file, out):
            packed.left_out[str(file)] = "is no file of a set's own"
    front = yaml.safe_dump({"configs": table_configs(out)}, sort_keys=False)
    (out / CARD[0]).write_text(f"---\n{front}---\n{_README}", encoding="utf-8")
    return packed


def unpack_set(root: Path, out: Path, *, skip_damaged: bool) -> Packed:
    """Write a packed set as the folder that it was made of, but for its card.

    Args:
        root: the packed set.
        out: folder of the new one, which exists and is empty.
        skip_damaged: True to leave out trajectories that cannot be read.

    Raises:
        DataError: one cannot be read, and they are not left out.
        OSError: a file cannot be written.
    """
    pack = ParquetPack(root, check=not skip_damaged)
    unpacked = Packed(damaged=pack.refused)
    for folder in pack.metadata.iterdir():
        try:
            _copy_files(folder, out / METADATA / folder.name)
            for picture in pack.shared_files(folder.name):
                if not (out / SHARED / picture.name).exists():
                    _write(picture, out / SHARED / picture.name)
            unpacked.n_trajectories += 1
        except DataError as error:
            if not skip_damaged:
                raise
            shutil.rmtree(out / METADATA / folder.name, ignore_errors=True)
            unpacked.damaged.append(str(error))
    for file in root.iterdir():
        _copy_file(file, out)
    return unpacked


def _copy_file(file: Path, out: Path) -> bool:
    """Copy a file of the set's own; return False for what is none. A card is made anew."""
    if file.name in CARD or (file.suffix == ".parquet" and is_packed(file.parent)):
        return True
    if file.name == REMOTE or file.name.startswith(".") or file.is_symlink() or not file.is_file():
        return False
    shutil.copyfile(file, out / file.name)
    return True


def _copy_files(folder: SetPath, out: Path) -> None:
    for path in folder.iterdir():
        if path.is_dir():
            _copy_files(path, out / path.name)
        else:
            _write(path, out / path.name)


def _write(path: SetPath, out: Path) -> None:
    content = path.read_bytes()
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(content)


def _groups(data: NiehSet) -> dict[str, list[str]]:
    """Return the set's trajectories by what they are compressed with: worlds by their base."""
    groups: dict[str, list[str]] = {}
    for folder in _sorted(data.folder("")) if data.has_frames else ():
        if folder.is_dir():
            world = data.twins.get(folder.name)
            groups.setdefault(world.base if world else folder.name, []).append(folder.name)
    return groups


class _Tables:
    """The tables that are written, a row group at a time."""

    def __init__(self, out: Path, settings: PackSettings) -> None:
        self._out = out
        self.settings = settings
        self._files: dict[str, list[Path]] = {}
        self._open: dict[str, pq.ParquetWriter] = {}
        self._n_groups: dict[str, int] = {}

    def write(self, table: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
        """Write a row group, and return its place."""
        files = self._files.setdefault(table, [])
        if files and files[-1].stat().st_size > _SHARD_BYTES:
            self._close(table)
        if table not in self._open:
            path = self._out / f".{table}-{len(files):05d}.partial"
            files.append(path)
            self._open[table] = self._writer(table, path)
            self._n_groups[table] = 0
        writer = self._open[table]
        writer.write_table(pa.Table.from_pylist(list(rows), writer.schema), len(rows))
        self._n_groups[table] += 1
        return {"shard": len(files) - 1, "row_group": self._n_groups[table] - 1}

    def close(self) -> None:
        """Finish all files, and give them their names."""
        for table, files in self._files.items():
            self._close(table)
            for at, path in enumerate(files):
                path.replace(self._out / shard_name(table, at, len(files)))

    def _close(self, table: str) -> None:
        if table in self._open:
            self._open.pop(table).close()

    def _writer(self, table: str, path: Path) -> pq.ParquetWriter:
        # Clue frames of several questions are written once: no reader of ours opens that table.
        return pq.ParquetWriter(
            path,
            _with_images(SCHEMAS[table]),
            compression="zstd",
            compression_level=self.settings.level,
            use_dictionary=table == "questions",
            dictionary_pagesize_limit=_ONE_PAGE,
            data_page_size=_ONE_PAGE,
            write_statistics=False,
        )


def _with_images(schema: pa.Schema) -> pa.Schema:
    """Return a schema that tells `datasets`, and so the hub, which columns are pictures."""
    from datasets import Features, Image, List

    features = Features.from_arrow_schema(schema)
    images = {"image": Image(), "clue_frames": List(Image())}
    features.update({name: image for name, image in images.items() if name in features})
    return schema.with_metadata(features.arrow_schema.metadata)


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


class _Group:
    """Trajectories that are compressed together."""

    def __init__(self, data: NiehSet, tables: _Tables, packed: Packed) -> None:
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
        if not numbers or max(map(abs, numbers)) >= _LARGEST or not _is_text(name):
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
        if problem is None and not _is_text(path.name):
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
        for path in _sorted(folder):
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


def _sorted(folder: SetPath) -> list[SetPath]:
    paths: list[SetPath] = [*folder.iterdir()]
    return sorted(paths, key=lambda path: path.name)


def _size_of(frame: FrameRef) -> ImageSize | None:
    try:
        return frame.size
    except DataError:  # is said of it when it is shown
        return None


def _is_text(name: str) -> bool:
    """Return False for a name that is not UTF-8 on the disk."""
    return not any("\ud800" <= letter <= "\udfff" for letter in name)


def _question_row(data: NiehSet, question: Question, left_out: Collection[str]) -> dict[str, Any]:
    frames = data.clue_frames(question) if data.has_frames else ()
    return {
        "id": question.id,
        "traj_id": question.traj_id,
        "question": question.text,
        "answer": [str(answer) for answer in question.answers],
        "gt_img_idx": question.clues,
        "question_type": question.question_type,
        "absence": question.absence,
        "moment": question.moment,
        "pair": question.pair or None,
        "fact": question.fact or None,
        "file": question.file or None,
        "clue_frames": [
            {"bytes": frame.path.read_bytes(), "path": frame.name}
            for frame in frames
            if frame.problem is None and str(frame.path) not in left_out
        ],
    }


def _pair_row(pair: TwinPair) -> dict[str, Any]:
    return {
        "id": pair.id,
        "kind": pair.kind,
        "scene": pair.floor_plan,
        "base": pair.base,
        "traj_ids": pair.traj_ids,
        "types": pair.types,
        "changed": pair.changed,
        "differing_frames": [at for at, frame in enumerate(pair.frames) if not frame.same],
        "questions": [
            {
                "question": question.text,
                "answers": [[str(one) for one in answers] for answers in question.answers],
            }
            for question in pair.questions
        ],
    }
