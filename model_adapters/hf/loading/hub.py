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

__all__ = ["fetch"]

_FILES = ["*.json", "*.jinja", "*.model", "*.py", "*.safetensors", "*.txt"]
_TIMEOUT_S = 10.0


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
        pretrained: a folder, or a hub id.
        revision: branch, tag or commit on the hub; the default branch where None.
        option: the option that names the checkpoint, as users type it, for the message.
        extra_patterns: patterns of files to download in addition to the usual ones.

    Returns:
        The folder, and the commit that it holds (None for a folder of the user's).

    Raises:
        ModelError: the checkpoint is neither a folder nor in the hub or its cache; the message says
            what to do.
    """
    path = Path(pretrained).expanduser()
    if path.is_dir():
        return path, None
    if pretrained.startswith((".", "/", "~")) or pretrained.count("/") != 1:
        raise ModelError(
            f"{option}{pretrained}: there is no such folder, and hub ids have the form owner/name"
        )
    at = f"{pretrained} at revision {revision}" if revision else pretrained
    try:
        commit = HfApi().model_info(pretrained, revision=revision, timeout=_TIMEOUT_S).sha
        folder = Path(
            snapshot_download(
                pretrained, revision=commit, allow_patterns=[*_FILES, *extra_patterns]
            )
        )
    except (HfHubHTTPError, HFValidationError) as error:
        raise ModelError(
            f"the hub refuses {at} ({_first_line(error)}); check the name, or log in with `hf auth "
            "login`"
        ) from error
    except (HTTPError, OSError) as error:
        folder = _cached_folder(pretrained, revision, at, option, error)
    return folder, folder.name


def _cached_folder(
    pretrained: str, revision: str | None, at: str, option: str, reason: Exception
) -> Path:
    try:
        return Path(snapshot_download(pretrained, revision=revision, local_files_only=True))
    except LocalEntryNotFoundError as error:
        raise ModelError(
            f"{at} is not in the local cache and the hub cannot be reached "
            f"({_first_line(reason)}); download it where there is network with `hf download "
            f"{pretrained} --local-dir DIR` and give {option}DIR"
        ) from error


def _first_line(error: Exception) -> str:
    text = str(error).strip()
    return (text.splitlines()[0] if text else type(error).__name__).rstrip(".")
