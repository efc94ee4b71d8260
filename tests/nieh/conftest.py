"""Runs of NIEH as the tests make them: from names, as the command line does."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.cli.options.requests import Asked, requests_for
from infthor_eval.runs import PreparedRun, prepare


@pytest.fixture
def data(make_nieh_set: Callable[..., Path]) -> Path:
    """A small set of plain frames."""
    return make_nieh_set(size=56)


@pytest.fixture
def prepared(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """A run on that set, ready to be executed; keyword arguments are the model's and those of `Asked`."""

    def make(model: str = "oracle", model_options: dict[str, str] | None = None, **changes: object) -> PreparedRun:
        name = changes.pop("name", None)
        settings = {"tasks": ("nieh",), "data": data, "output": tmp_path / "out", **changes}
        ((request, suite),) = requests_for(Asked(**settings), model, model_options or {}, name)
        return prepare(request, suite)

    return make
