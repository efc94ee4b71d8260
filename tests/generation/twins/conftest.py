"""Two short trajectories, in a kitchen and in a living room."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.replays import Replays

from ...helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """Its file."""
    folder = write_trajectories(tmp_path_factory.mktemp("data") / "one", cut_trajectory(FORK, 8))
    return next(folder.iterdir())


@pytest.fixture(scope="module")
def living_room(tmp_path_factory, simulator) -> Iterator[Episode]:
    """An episode in which things of all kinds of exchange stand where the published table says."""
    folder = write_trajectories(tmp_path_factory.mktemp("data") / "one", cut_trajectory(CANDLE, 20))
    with ExitStack() as stack:
        yield Replays(simulator, stack).read(next(iter_trajectories(next(folder.iterdir()))))
