"""Folders of the installed package's data, and of the user's cache.

In a wheel, `tasks/`, `results/` and the bundled sets are inside `infthor_eval`. In a checkout,
`tasks/` and `results/` are beside it.
"""

import os
from importlib import resources
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors


def packaged_folder(name: str) -> Path:
    """Return the package's data folder of this name ("tasks", "results", "sets/nieh_mini")."""
    package = resources.files("infthor_eval")
    for folder in (package.joinpath(name), package.joinpath("..", name)):
        with wrap_errors(
            f"the installation lacks its data folder {name!r:.60}",
            "give another",
            catch=(OSError, ValueError),
        ):
            if isinstance(folder, Path) and folder.is_dir():
                return folder.resolve()
    raise DataError(f"the installation lacks its data folder {name!r}; install infthor-eval again")


def user_cache(name: str) -> Path:
    """Return a folder, which may not exist yet, in `$XDG_CACHE_HOME` or else `~/.cache`."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "infthor-eval" / name
