"""Copying a set of twins without what its questions do not need, in few bytes."""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

from msgspec.structs import replace

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.shared_frames import write_frame_names
from infthor_eval.formats.step_log import pack_steps
from infthor_eval.formats.twins import ComparedFrame, TwinPair, read_pairs, write_pairs
from infthor_eval.generation.compact.pictures import PictureStore

_SET_INFO = "set.json"


def copy_compactly(source: Path, out: Path, colors: int) -> None:
    """Copy the worlds that questions are asked in: their logs, packed, and pictures.

    Left out are drafts, trajectories (`traj_data.json`), and actions and states in words.

    Args:
        source: a set of twins.
        out: folder of the copy, which exists and is empty.
        colors: number of colours of the pictures of one base trajectory.

    Raises:
        DataError: the set cannot be read.
    """
    data = NiehSet(source)
    by_base: dict[str, list[TwinPair]] = {}
    pairs = read_pairs(source)
    for pair in pairs:
        by_base.setdefault(pair.base, []).append(pair)
    names: dict[str, Sequence[str]] = {}
    for group in by_base.values():
        names.update(_copy_worlds(data, group, out, colors))
    write_pairs(out, [_compared(pair, names) for pair in pairs])
    for file in (_SET_INFO, *(f"{name}.csv" for name in data.files)):
        shutil.copyfile(source / file, out / file)


def _copy_worlds(
    data: NiehSet, pairs: Sequence[TwinPair], out: Path, colors: int
) -> Iterator[tuple[str, Sequence[str]]]:
    """Copy the worlds of one base trajectory, and yield the names of each one's pictures."""
    worlds: dict[str, Sequence[FrameRef]] = {
        name: data.frames(name) for pair in pairs for name in pair.traj_ids
    }
    pictures = PictureStore(out, chain.from_iterable(worlds.values()), colors)
    for name, frames in worlds.items():
        folder = out / "metadata" / name
        folder.mkdir(parents=True)
        stored = [pictures.name(frame) for frame in frames]
        write_frame_names(folder, stored, packed=True)
        pack_steps(data.folder(name), folder)
        yield name, stored


def _compared(pair: TwinPair, names: Mapping[str, Sequence[str]]) -> TwinPair:
    """Return a pair with what is equal now: fewer colours can make more pictures equal."""
    stored = zip(*(names[world] for world in pair.traj_ids), strict=True)
    frames = (
        ComparedFrame(first == second, frame.changed)
        for frame, (first, second) in zip(pair.frames, stored, strict=True)
    )
    return replace(pair, frames=tuple(frames))
