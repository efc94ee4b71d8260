"""The published NIEH data: their download from the Hugging Face hub, and their folder."""

from pathlib import Path

from infthor_eval.errors import DataError, in_one_line
from infthor_eval.formats.archive import unpack_tar
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.storage.folders import user_cache

NIEH_REPOSITORY = "PEARLS-Lab/infini-thor-nieh"
_FILES = ["qa_set_nieh_single_clue.csv", "qa_set_nieh_multi_clue.csv", "metadata.tar"]


def default_folder() -> Path:
    """Return the default folder of the published data, in the user's cache."""
    return user_cache("nieh")


def fetch_nieh(folder: Path, token: str | None = None, endpoint: str | None = None) -> NiehSet:
    """Download, unpack and check the published NIEH data; files that exist are kept.

    An interrupted download is resumed. The archive is deleted once it is unpacked and the set is
    checked.

    Args:
        folder: folder of the set.
        token: access token; None for the one that `hf auth login` stored.
        endpoint: URL of another hub; None for the public one.
    """
    if not (folder / "metadata").is_dir():
        _download(folder, token, endpoint)
        unpack_tar(folder / "metadata.tar", folder / "metadata")
    data = NiehSet(folder)
    if not data.questions:
        reasons = "; ".join(reason for reason, _ in data.reasons().most_common(3))
        raise DataError(
            f"{folder}: none of its questions can be asked ({reasons}); delete the folder and "
            "fetch again"
        )
    (folder / "metadata.tar").unlink(missing_ok=True)
    return data


def _download(folder: Path, token: str | None, endpoint: str | None) -> None:
    from huggingface_hub import HfApi, snapshot_download
    from huggingface_hub.constants import DEFAULT_REVISION
    from huggingface_hub.errors import GatedRepoError, RepositoryNotFoundError

    try:
        # A download takes what is in the folder for the data if the hub does not answer.
        HfApi(endpoint, token=token).repo_info(
            NIEH_REPOSITORY, repo_type="dataset", revision=DEFAULT_REVISION
        )
        snapshot_download(
            NIEH_REPOSITORY,
            repo_type="dataset",
            local_dir=folder,
            allow_patterns=_FILES,
            token=token,
            endpoint=endpoint,
        )
    except (GatedRepoError, RepositoryNotFoundError) as error:
        raise DataError(
            f"{NIEH_REPOSITORY}: no access; request it on the hub's page, then log in with `hf "
            "auth login`"
        ) from error
    # Each version of the hub's library has another one of the network.
    except Exception as error:
        raise DataError(
            f"{NIEH_REPOSITORY}: cannot be fetched ({in_one_line(error)}); go online, or copy the "
            f"set to {folder} from a machine that has it"
        ) from error
    missing = [name for name in _FILES if not (folder / name).is_file()]
    if missing:
        raise DataError(
            f"{NIEH_REPOSITORY}: has no {', '.join(missing)}; the data set has changed, report it"
        )
