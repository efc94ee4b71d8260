"""Runs of plans on trajectories that are cut down, in simulators that all tests share."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.runs import PreparedRun

from ..episodes.interrupted import simulator_calls  # noqa: F401 - a fixture
from ..episodes.pool import pool, shared_simulators  # noqa: F401 - fixtures
from ..episodes.preparing import make_preparer
from ..helpers.trajectories import FORK, cut_trajectory, write_trajectories


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with the first task of a kitchen."""
    return write_trajectories(tmp_path / "data", cut_trajectory(FORK))


@pytest.fixture
def prepare_run(data: Path, tmp_path: Path) -> Callable[..., PreparedRun]:
    """Prepares a run on that, see `make_preparer`."""
    return make_preparer("planner", tasks=("infthor_plans",), data=data, output=tmp_path / "out")
