"""Twins for agents, made of a short trajectory in a kitchen."""

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.replay_set import select
from infthor_eval.generation.twins.drafting import TwinSettings
from infthor_eval.generation.twins.twin_set import make_final_tasks
from infthor_eval.household.first_place import apart, is_looked_at
from infthor_eval.household.scout import reachable_grid
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.plan import plans_of
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings

from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories

SETTINGS = TwinSettings(("move",), 3, 1)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data") / "one"
    return write_trajectories(folder, cut_trajectory(FORK, 15))


@pytest.fixture(scope="module")
def made(data, tmp_path_factory):
    """The folder of a set, and the numbers of making it."""
    out = tmp_path_factory.mktemp("made") / "twins"
    return out, make(data, out)


@pytest.fixture(scope="module")
def pair(made):
    out, _ = made
    one, other = iter_trajectories(out / "trajectories")
    return one, other


def make(data, out, settings=SETTINGS):
    return make_final_tasks(
        select([data]), embedded_launch(), out, settings, worker_settings=WorkerSettings()
    )


def test_edits_are_counted_and_pairs_resumed(data, made):
    out, summary = made
    assert summary.pairs == summary.kept["move"] >= 1
    assert summary.proposed["move"] == summary.kept["move"] + sum(summary.rejected.values())
    assert not summary.failures
    again = make(data, out)
    assert (again.resumed, again.pairs) == (1, summary.pairs)
    refused = make(data, out, TwinSettings(("move",), 4, 1))
    assert "made with other kinds, seed" in refused.failures[0]


def test_both_worlds_have_the_same_words_and_exchanged_places(pair):
    one, other = pair
    assert one.twin.pair == other.twin.pair
    assert one.twin.base == other.twin.base
    assert one.twin.places == other.twin.places[::-1]
    assert apart(one.twin.places) >= 1.5
    for words in Words:
        ours, theirs = ([plan.text for plan in plans_of(world, words)] for world in pair)
        assert ours == theirs
    assert one.long_horizon_task == other.long_horizon_task
    assert [low.api_action.action for low in one.plan.low_actions] != [
        low.api_action.action for low in other.plan.low_actions
    ]


def test_no_plan_of_the_final_task_says_where_the_object_is(pair):
    for world in pair:
        final = [plan for plan in plans_of(world, Words.NATURAL) if plan.is_final]
        assert [plan.kind for plan in final] == ["PickupObject", "PutObject"]
        places = {place.receptacle.partition("|")[0].lower() for place in world.twin.places}
        assert not places & {word for plan in final for word in plan.text.split()}


def test_the_final_task_begins_in_the_same_pose_at_neither_place(pair, simulator):
    poses = []
    for world in pair:
        environment = PlanEnvironment(world, simulator)
        first = next(plan for plan in environment.plans if plan.is_final)
        observation, _ = environment.reset(first.index)
        poses.append(observation.view.agent)
        item = environment.named_objects(first.index)[0]
        assert not observation.view.objects[item].visible
        assert not any(is_looked_at(poses[-1], place) for place in world.twin.places)
        holder = world.twin.places[0].receptacle
        assert holder in observation.view.objects[item].parent_receptacles
        assert world.twin.places[1].receptacle in observation.view.objects
        assert reachable_grid(simulator).cells
        assert len(world.object_log) == len(world.plan.low_actions) + 1
    assert poses[0] == poses[1]


def test_the_same_seed_makes_the_same_files(data, made, tmp_path):
    out, _ = made
    make(data, tmp_path / "again")
    for file in (out / "trajectories").iterdir():
        assert (tmp_path / "again" / "trajectories" / file.name).read_bytes() == file.read_bytes()


def test_a_trajectory_without_tasks_is_refused(data, tmp_path):
    document = cut_trajectory(FORK, 4) | {"sub_trajs": [], "sub_tasks": []}
    lone = write_trajectories(tmp_path / "lone", document)
    (failure,) = make(lone, tmp_path / "out").failures
    assert "it has no tasks for a final one to follow" in failure
    with pytest.raises(DataError, match=r"no .* file in this folder"):
        list(iter_trajectories(tmp_path / "out" / "trajectories"))
