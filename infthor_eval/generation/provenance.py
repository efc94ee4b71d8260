"""What made a trajectory, and when: fields of `gen_info` that no setting determines.

The same command writes the same bytes on the same installation, so the clock is not read.
"""

import os
from importlib.metadata import distribution, version
from typing import Any

import msgspec

from infthor_eval import __version__
from infthor_eval.errors import UsageError

_TIME = "SOURCE_DATE_EPOCH"  # of reproducible-builds.org


def provenance() -> dict[str, Any]:
    """Return the versions of the code, and when the trajectory was made, as JSON values.

    - `generator`, `ai2thor`: versions
    - `git`: first digits of the commit that the package was installed from; null if it was
      installed from a release or a folder
    - `created`: seconds since 1970, from the environment variable SOURCE_DATE_EPOCH; null without
      it

    Raises:
        UsageError: the environment variable is not a whole number.
    """
    return {
        "generator": f"infthor-eval {__version__}",
        "ai2thor": version("ai2thor"),
        "git": _commit(),
        "created": _created(),
    }


def _commit() -> str | None:
    """Return the installed commit by the file that installers write (PEP 610)."""
    text = distribution("infthor-eval").read_text("direct_url.json")
    origin = msgspec.json.decode(text) if text is not None else {}
    commit = origin.get("vcs_info", {}).get("commit_id")
    return None if commit is None else str(commit)[:7]


def _created() -> int | None:
    text = os.environ.get(_TIME)
    if text is None:
        return None
    if not text.isdecimal():
        raise UsageError(f"{_TIME}: {text!r:.60} is not a whole number; give seconds since 1970")
    return int(text)
