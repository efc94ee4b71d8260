"""`infthor-eval pack` and `unpack`: a set as few Parquet files, and as the folder again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH, SET
from infthor_eval.errors import UsageError, wrap_errors
from infthor_eval.terminal import error_console, print_line, progress_bar

if TYPE_CHECKING:
    from infthor_eval.formats.packed.groups import Packed

_out = click.option("--out", required=True, type=PATH, help="Folder of the new set, new or empty.")


@example_command("pack", "infthor-eval pack SET --out PACKED")
@click.argument("set_folder", metavar="SET", type=PATH)
@_out
def pack(set_folder: Path, out: Path) -> int:
    """Write SET as few Parquet files, which every command reads as it reads the folder.

    The Hugging Face hub shows them, and `datasets` loads them: `load_dataset(OUT, "questions")`.
    Exit code 1 if a trajectory cannot be read, and is left out.
    """
    from infthor_eval.cli.progress.bar import PacedBar
    from infthor_eval.formats.nieh_set import NiehSet
    from infthor_eval.formats.packed.writing import pack_set

    data = NiehSet(set_folder)
    if not set_folder.is_dir() or not (data.has_frames and (data.directory / "metadata").is_dir()):
        raise UsageError(f"{set_folder}: has no metadata/ to pack; give a set that is a folder")
    if out.resolve().is_relative_to(set_folder.resolve()):
        raise UsageError(f"--out {out}: is within the set; give another place")
    with _new_folder(out) as folder, progress_bar(error_console()) as progress:
        n_trajectories = sum(path.is_dir() for path in data.folder("").iterdir())
        packed = pack_set(
            data, folder, advance=PacedBar(progress, out.name, n_trajectories).advance
        )
    return _finish(packed, out)


@example_command("unpack", "infthor-eval unpack PACKED --out SET")
@click.argument("packed", metavar="PACKED", type=SET)
@_out
@click.option("--skip-damaged", is_flag=True, help="Leave out trajectories that cannot be read.")
def unpack(packed: Path, out: Path, skip_damaged: bool) -> int:
    """Write a packed set as the folder that it was made of, byte for byte, without its card.

    Exit code 1 if a trajectory cannot be read, and is left out.
    """
    from infthor_eval.formats.packed.paths import is_packed
    from infthor_eval.formats.packed.writing import unpack_set

    if not is_packed(packed):
        raise UsageError(f"{packed}: has no trajectories-*.parquet; give a packed set")
    with _new_folder(out) as folder:
        unpacked = unpack_set(packed, folder, skip_damaged=skip_damaged)
    return _finish(unpacked, out)


@contextmanager
def _new_folder(out: Path) -> Iterator[Path]:
    """Yield a folder that becomes `out` when all is written."""
    from infthor_eval.storage.files import prepare_folder, write_atomically, writing_hint

    prepare_folder(out)
    with wrap_errors(f"{out}: cannot be written", writing_hint(", or give another --out")):
        if any(out.iterdir()):
            raise UsageError(f"{out}: not empty; give a new folder with --out")
        with write_atomically(out) as folder:
            folder.mkdir()
            yield folder
            out.rmdir()


def _finish(packed: Packed, out: Path) -> int:
    """Print what was written and what was left out; return the exit code."""
    files = [path for path in out.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    print_line(
        f"{packed.n_trajectories} trajectories, {len(files)} files, {size / 1e6:.1f} MB: {out}"
    )
    files_left_out = (f"{path}: {reason}" for path, reason in packed.left_out.items())
    for line in (*packed.damaged, *files_left_out):
        error_console().print(f"left out: {line}", style="red", markup=False)
    return int(bool(packed.damaged))
