"""Data files that come with the package: `tasks/`, `results/` and the bundled question sets.

In a wheel they lie inside `infthor_eval`; in a checkout (and an editable install of one) `tasks/` and `results/`
lie beside it. Both are found from the package itself.
"""

from importlib import resources
from pathlib import Path

from infthor_eval.errors import DataError

__all__ = ["packaged_folder"]


def packaged_folder(name: str) -> Path:
    """The folder `name` ("tasks", "results", "sets/nieh_mini") as the installed package carries it.

    Raises:
        DataError: the installation lacks it.
    """
    package = resources.files("infthor_eval")
    for place in (package.joinpath(name), package.joinpath("..", name)):
        if isinstance(place, Path) and place.is_dir():
            return place.resolve()
    raise DataError(f"the installation lacks its data folder {name!r}; install infthor-eval again")
