"""Replays that share pictures write what replays that draw each one write."""

import pytest

from infthor_eval.errors import SimulatorError
from infthor_eval.formats.pictures.png import PngWriter
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.replay import replay
from infthor_eval.thor.drawn_pictures import DrawnPictures

from ..helpers.trajectories import FORK, cut_trajectory, write_trajectories


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    folder = write_trajectories(tmp_path_factory.mktemp("data") / "one", cut_trajectory(FORK, 8))
    return next(iter_trajectories(next(folder.iterdir())))


def written(trajectory, simulator, folder, drawn=None):
    folder.mkdir()
    report = replay(trajectory, simulator, folder, "", drawn=drawn)
    assert report.complete
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_a_second_replay_draws_nothing_and_writes_the_same(
    trajectory, simulator, tmp_path, monkeypatch
):
    plain = written(trajectory, simulator, tmp_path / "plain")
    kept = tmp_path / "kept"
    kept.mkdir()
    drawn = DrawnPictures(simulator, kept)
    assert written(trajectory, simulator, tmp_path / "first", drawn) == plain
    n_kept = len(list(kept.iterdir()))
    assert n_kept <= len(trajectory.plan.low_actions)

    def refuse(*args, **kwargs):
        raise AssertionError("a picture was drawn again")

    monkeypatch.setattr(simulator, "query", refuse)
    assert written(trajectory, simulator, tmp_path / "second", drawn) == plain
    assert len(list(kept.iterdir())) == n_kept


def test_a_simulator_that_sends_no_frame_is_named(simulator, tmp_path, monkeypatch):
    simulator.reset("kitchen-1")
    view = simulator.step("Pass", imageDigest=True, renderImage=False)
    monkeypatch.setattr(simulator, "query", lambda *args, **kwargs: view)
    drawn = DrawnPictures(simulator, tmp_path)
    with PngWriter(tmp_path) as images, pytest.raises(SimulatorError, match="no frame"):
        drawn.write(images, "0.png", view, str(view.image_digest))
