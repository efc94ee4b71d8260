"""Data files of the installed package: `tasks/`, `results/` and the bundled question sets.

In a wheel they are inside `infthor_eval`. In a checkout `tasks/` and `results/` are beside it.
"""

from importlib import resources
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors

__all__ = ["packaged_folder"]


def packaged_folder(name: str) -> Path:
    """Return the package's data folder of this name ("tasks", "results", "sets/nieh_mini").

    Raises:
        DataError: the installation lacks the folder.
    """
    package = resources.files("infthor_eval")
    for place in (package.joinpath(name), package.joinpath("..", name)):
        with wrap_errors(
            f"the installation lacks its data folder {name!r:.60}",
            "give another",
            catch=(OSError, ValueError),
        ):
            if isinstance(place, Path) and place.is_dir():
                return place.resolve()
    raise DataError(f"the installation lacks its data folder {name!r}; install infthor-eval again")
