"""Location and download of checkpoints."""

from collections.abc import Sequence
from pathlib import Path

from huggingface_hub import HfApi, snapshot_download
from huggingface_hub.errors import (
    HfHubHTTPError,
    HFValidationError,
    HTTPError,
    LocalEntryNotFoundError,
)

from infthor_eval.errors import ModelError

# `.metadata` is that of a distributed checkpoint, by which it is told from one that models load.
_FILES = ["*.json", "*.jinja", "*.model", "*.py", "*.safetensors", "*.txt", ".metadata"]
_TIMEOUT_S = 10.0
_NO_PARTS = ("", ".", "..")  # of a hub id


def fetch(
    pretrained: str,
    revision: str | None,
    *,
    option: str = "pretrained=",
    extra_patterns: Sequence[str] = (),
) -> tuple[Path, str | None]:
    """Return the folder of a checkpoint, downloading it unless it is in the hub's cache.

    One request, without retries, asks the hub for the commit. If the hub cannot be reached, the
    cache is used. So a cached checkpoint needs no network, and a missing one without network fails
    at once.

    Args:
        pretrained: a folder, a hub id (`owner/name`), or a folder of a hub's repository
            (`owner/name/folder`).
        revision: branch, tag or commit on the hub; the default branch where None.
        option: the option that names the checkpoint, as users type it, for the message.
        extra_patterns: patterns of files to download in addition to the usual ones.

    Returns:
        The folder, and the commit that it holds (None for a folder of the user's).
    """
    path = Path(pretrained).expanduser()
    if path.is_dir():
        return path, None
    parts = pretrained.split("/")
    if pretrained.startswith("~") or len(parts) < 2 or any(part in _NO_PARTS for part in parts):
        raise ModelError(
            f"{option}{pretrained}: there is no such folder, and hub ids have the form owner/name "
            "or owner/name/folder"
        )
    repository = "/".join(parts[:2])
    inside = "".join(f"{part}/" for part in parts[2:])
    at = f"{pretrained} at revision {revision}" if revision else pretrained
    try:
        commit = HfApi().model_info(repository, revision=revision, timeout=_TIMEOUT_S).sha
        patterns = [f"{inside}{pattern}" for pattern in (*_FILES, *extra_patterns)]
        root = Path(snapshot_download(repository, revision=commit, allow_patterns=patterns))
    except (HfHubHTTPError, HFValidationError) as error:
        raise ModelError(
            f"the hub refuses {at} ({_first_line(error)}); check the name, or log in with `hf auth "
            "login`"
        ) from error
    except (HTTPError, OSError) as error:
        root = _cached_folder(repository, inside, revision, at, option, error)
    folder = root / inside
    if not folder.is_dir():
        raise ModelError(
            f"{option}{pretrained}: {repository} has no checkpoint there at {root.name[:12]}; "
            "check the folder's name"
        )
    return folder, root.name


def _cached_folder(
    repository: str, inside: str, revision: str | None, at: str, option: str, reason: Exception
) -> Path:
    try:
        return Path(snapshot_download(repository, revision=revision, local_files_only=True))
    except LocalEntryNotFoundError as error:
        files = f" --include '{inside}*'" if inside else ""
        folder = "/".join(("DIR", *filter(None, inside.split("/"))))
        raise ModelError(
            f"{at} is not in the local cache and the hub cannot be reached "
            f"({_first_line(reason)}); download it where there is network with `hf download "
            f"{repository}{files} --local-dir DIR` and give {option}{folder}"
        ) from error


def _first_line(error: Exception) -> str:
    text = str(error).strip()
    return (text.splitlines()[0] if text else type(error).__name__).rstrip(".")
