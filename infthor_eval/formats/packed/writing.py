"""Packing a set into Parquet, and unpacking it.

Pictures keep their bytes, so that a run on either form is the same. Tables are compressed over all
rows of a row group: pictures that are not compressed themselves, such as those of the bundled sets,
take a few bytes each where they are nearly equal.
"""

import shutil
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.groups import GroupWriter, Packed, sorted_paths
from infthor_eval.formats.packed.pack import METADATA, SHARED, ParquetPack
from infthor_eval.formats.packed.paths import REMOTE, SetPath, is_packed, table_configs
from infthor_eval.formats.packed.table_writer import PackSettings, TableWriter
from infthor_eval.formats.question import Question
from infthor_eval.formats.twins import TwinPair

CARD = ("README.md", "croissant.json", "card.png")  # written of either form by `card`
_README = """
An NIEH set of infthor-eval in Parquet; `infthor-eval card` writes a whole card here.
"""
_QUESTIONS = 256  # in a row group
_SETTINGS = PackSettings()


def pack_set(
    data: NiehSet,
    out: Path,
    settings: PackSettings = _SETTINGS,
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
    tables = TableWriter(out, settings)
    trajectories: list[dict[str, Any]] = []
    for names in _groups(data).values():
        trajectories += GroupWriter(data, tables, packed).write(names)
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
    for folder in sorted_paths(data.folder("")) if data.has_frames else ():
        if folder.is_dir():
            world = data.twins.get(folder.name)
            groups.setdefault(world.base if world else folder.name, []).append(folder.name)
    return groups


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
