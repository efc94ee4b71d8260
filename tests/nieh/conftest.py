"""Runs of NIEH as the tests make them: from names, as the command line does."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.runs import PreparedRun, prepare


@pytest.fixture
def data(make_nieh_set: Callable[..., Path]) -> Path:
    """A small set of plain frames."""
    return make_nieh_set(size=56)


@pytest.fixture
def prepare_run(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """A run on that set, ready to be executed; keyword arguments are the model's and those of
    `RunOptions`."""

    def make(
        model: str = "oracle", model_options: dict[str, str] | None = None, **changes: object
    ) -> PreparedRun:
        settings = {"tasks": ("nieh",), "data": data, "output": tmp_path / "out", **changes}
        ((request, suite),) = RunOptions(
            (ModelSpec(model, model_options or {}),), **settings
        ).requests()
        return prepare(request, suite)

    return make
