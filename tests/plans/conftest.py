"""Runs of plans on trajectories that are cut down, in simulators that all tests share."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Lock
from typing import Any

import pytest

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.runs import PreparedRun, prepare
from infthor_eval.thor.launch import embedded
from infthor_eval.thor.simulator import Simulator

from .cut import FORK, cut, write


class SharedSimulators:
    """Takes the place of `Simulators`: a process for all runs that ask for the same."""

    def __init__(self) -> None:
        self.open = ExitStack()
        self._found: dict[tuple[tuple[str, bool], ...], Simulator] = {}
        self._lock = Lock()

    @contextmanager
    def one(self, **options: bool) -> Iterator[Simulator]:
        key = tuple(sorted(options.items()))
        with self._lock:
            if key not in self._found:
                self._found[key] = self.open.enter_context(Simulator(embedded(), max_copies=64, **options))
            yield self._found[key]


@pytest.fixture(scope="session")
def simulators() -> Iterator[SharedSimulators]:
    shared = SharedSimulators()
    with shared.open:
        yield shared


@pytest.fixture
def shared_simulator(simulators: SharedSimulators, monkeypatch: pytest.MonkeyPatch) -> None:
    """Has runs of plans use the shared processes instead of starting their own."""

    class Shared:
        def __init__(self, name: str, scenes: Path | None, trajectories: object, **options: bool) -> None:
            self._options = options

        def one(self) -> Any:
            return simulators.one(**self._options)

        def close(self) -> None:
            """They go on for other tests."""

    monkeypatch.setattr("infthor_eval.episodes.evaluation.Simulators", Shared)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with the first task of a kitchen."""
    return write(tmp_path / "data", cut(FORK))


@pytest.fixture
def prepared(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """A prepared run; keyword arguments are the model, its options, those of `RunOptions` and those of the suite."""

    def make(model: str = "planner", model_options: dict[str, str] | None = None, **changes: Any) -> PreparedRun:
        settings = {
            name: changes.pop(name)
            for name in ("tasks", "data", "output", "seed", "limit", "fresh", "recover")
            if name in changes
        }
        settings = {"tasks": ("infthor_plans",), "data": data, "output": tmp_path / "out", **settings}
        models = (ModelSpec(model, model_options or {}),)
        ((request, suite),) = RunOptions(models, **settings, suite_options=changes).requests()
        return prepare(request, suite)

    return make
