"""A short trajectory in a kitchen."""

from pathlib import Path

import pytest

from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """Its file."""
    folder = write_trajectories(tmp_path_factory.mktemp("data") / "one", cut_trajectory(FORK, 8))
    return next(folder.iterdir())
