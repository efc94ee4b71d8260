"""Packed sets on the Hugging Face hub, `hf://OWNER/NAME[@REVISION]`.

What is small is downloaded into a folder of the user's cache, which stands for the set everywhere.
Of its tables only what is shown is fetched. Frames are kept by their digest.
"""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, UsageError, in_one_line
from infthor_eval.formats.packed.paths import REMOTE
from infthor_eval.formats.reading import read_json
from infthor_eval.storage.files import write_atomically
from infthor_eval.storage.folders import user_cache

SCHEME = "hf://"
_ADDRESS = re.compile(r"hf://?([\w.-]+/[\w.-]+?)(?:@([\w./-]+))?/?", re.ASCII)
_FETCHED_WHOLE = ("*.csv", "*.json", "*.jsonl", "trajectories-*.parquet")
_HINT = "delete the folder, and fetch the set again"


class Remote(msgspec.Struct, frozen=True):
    """Where the tables of a set are: repository, commit, and sizes of the files by name."""

    repository: str
    commit: str
    files: dict[str, int]


def set_folder(place: str | Path) -> Path:
    """Return the folder of a set that may be on the hub, from where its small files are fetched.

    Raises:
        UsageError: the address is not of this form.
        DataError: the hub does not answer, or has no such set.
    """
    text = str(place)
    if not text.startswith("hf:/"):  # as `Path` has it, too
        return Path(place)
    match = _ADDRESS.fullmatch(text)
    if match is None:
        raise UsageError(f"{text[:80]}: no address of a set; write hf://OWNER/NAME[@REVISION]")
    from huggingface_hub import HfApi, snapshot_download

    repository, revision = match.groups()
    try:
        info = HfApi().dataset_info(repository, revision=revision, files_metadata=True)
        name = f"{repository.replace('/', '--')}-{str(info.sha)[:12]}"
        folder = _folders() / name
        if not (folder / REMOTE).is_file():
            snapshot_download(
                repository,
                repo_type="dataset",
                revision=info.sha,
                local_dir=folder,
                allow_patterns=list(_FETCHED_WHOLE),
            )
            sizes = {file.rfilename: file.size or 0 for file in info.siblings or ()}
            remote = Remote(repository, str(info.sha), sizes)
            with write_atomically(folder / REMOTE) as partial:  # it says that all is there
                partial.write_bytes(msgspec.json.encode(remote))
    # Each version of the hub's library has another one of the network.
    except Exception as error:
        raise DataError(
            f"{SCHEME}{repository}: cannot be read ({in_one_line(error)}); check the name, log in "
            "with `hf auth login`, or give a folder"
        ) from error
    return folder


def is_remote(root: Path) -> bool:
    """Return True for a folder that stands for a set on the hub: one that was made here."""
    remote = root / REMOTE
    return remote.is_file() and remote.resolve().parent.parent == _folders().resolve()


def _folders() -> Path:
    return user_cache("hub_sets")


@dataclass(frozen=True)
class HubStore:
    """The Parquet files of a set on the hub, of which parts are fetched."""

    root: Path
    # Each version of the hub's library has another one of the network.
    failures: tuple[type[Exception], ...] = (Exception,)

    @cached_property
    def _remote(self) -> Remote:
        return read_json(self.root / REMOTE, _HINT, Remote)

    def names(self) -> list[str]:
        """Return the names of its Parquet files."""
        return [name for name in self._remote.files if name.endswith(".parquet")]

    def open(self, name: str) -> Any:
        """Return a file whose parts are fetched when they are read, or the path of one here."""
        if (self.root / name).is_file():
            return str(self.root / name)
        from huggingface_hub import HfFileSystem

        place = f"datasets/{self._remote.repository}@{self._remote.commit}/{name}"
        return HfFileSystem().open(place, cache_type="none")

    def kept(self, digest: str) -> Path:
        """Return where a frame is kept, which may not exist yet."""
        return user_cache("hub_frames") / digest[:2] / digest
