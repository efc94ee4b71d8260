"""Worlds that begin as their episode does are what a replay from the start makes of them."""

import random
from contextlib import ExitStack

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import ApiAction, iter_trajectories
from infthor_eval.generation.replay import replay
from infthor_eval.generation.twins import replays
from infthor_eval.generation.twins.carrying import PutTarget
from infthor_eval.generation.twins.comparison import Difference
from infthor_eval.generation.twins.replays import WORLD, Replays
from infthor_eval.generation.twins.rewriting import with_inserted, without_traces
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator


@pytest.fixture(scope="module")
def marking():
    """A simulator that stores many states, and the actions that it carried out."""
    with Simulator(embedded_launch(), max_copies=64) as simulator:
        yield simulator


@pytest.fixture
def read(file, marking, monkeypatch):
    """Replays, the episode, and the names of the actions since it was read."""
    monkeypatch.setattr(replays, "_MARKED", 5)
    done = []
    with ExitStack() as stack:
        made = Replays(marking, stack)
        episode = made.read(next(iter_trajectories(file)))
        step = marking.step
        monkeypatch.setattr(
            marking, "step", lambda action, **more: done.append(action) or step(action, **more)
        )
        yield made, episode, done


def contents(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def replayed_whole(world, simulator, tmp_path):
    folder = tmp_path / "whole"
    folder.mkdir()
    assert replay(world, simulator, folder, "").complete
    return contents(folder)


@pytest.mark.parametrize("number", range(4))
def test_a_world_that_begins_as_the_episode_is_carried_out_from_a_mark_on(
    number, read, marking, tmp_path
):
    made, episode, done = read
    edits = list(PutTarget().propose(episode, random.Random(number)))
    edit = max(edits, key=lambda edit: edit.index)
    world = without_traces(edit.apply(episode, marking).pair[number % 2], WORLD)
    del done[:]
    files = contents(made.replayed(world).folder)
    n_actions = len(world.plan.low_actions)
    assert edit.index >= 5
    assert len([name for name in done if name not in {"Pass", "RestoreState"}]) <= (
        n_actions - edit.index + 5
    )
    assert files == replayed_whole(world, marking, tmp_path)


def test_the_episode_itself_is_taken_over(read, marking, tmp_path):
    made, episode, done = read
    world = without_traces(episode.trajectory, WORLD)
    files = contents(made.replayed(world).folder)
    assert len([name for name in done if name != "RestoreState"]) < 5
    assert files == replayed_whole(world, marking, tmp_path)


def test_after_another_start_a_world_is_carried_out_from_its_own(read, marking, tmp_path):
    made, episode, done = read
    world = without_traces(episode.trajectory, WORLD)
    marking.reset("kitchen-2")
    files = contents(made.replayed(world).folder)
    assert len(done) >= len(world.plan.low_actions)
    assert files == replayed_whole(world, marking, tmp_path)


def test_what_is_refused_in_the_middle_is_named(read):
    made, episode, done = read
    at = len(episode.trajectory.plan.low_actions) - 2
    wrong = ApiAction("OpenObject", "Fridge|9|9|9")
    world = without_traces(with_inserted(episode.trajectory, at, [wrong]), WORLD)
    for _ in range(2):
        with pytest.raises(Difference, match="OpenObject is refused"):
            made.replayed(world)
    assert len(done) < 10


def test_an_episode_that_cannot_be_carried_out_is_no_episode(file, marking):
    trajectory = next(iter_trajectories(file))
    trajectory.plan.low_actions.insert(3, trajectory.plan.low_actions[-1])
    with ExitStack() as stack, pytest.raises(DataError, match="step 3"):
        Replays(marking, stack).read(trajectory)
