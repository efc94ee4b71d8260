"""Twins of a short trajectory in a kitchen, and broken edits, each of which is rejected."""

import json
import random
from contextlib import ExitStack
from dataclasses import replace as replace_fields
from functools import partial

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.formats.trajectory import (
    ApiAction,
    ExpertPlan,
    InitAction,
    Scene,
    StartState,
    Trajectory,
    encode_trajectory,
    iter_trajectories,
)
from infthor_eval.formats.twins import PairedQuestion
from infthor_eval.generation.twins.comparison import Difference, World
from infthor_eval.generation.twins.drafting import (
    TwinSettings,
    check_original,
    draft_twins,
    is_flipped,
    is_shown,
    name_worlds,
)
from infthor_eval.generation.twins.exchanges import Exchange
from infthor_eval.generation.twins.kinds import KINDS, EditKind, EditRefused, Worlds
from infthor_eval.generation.twins.openings import CountOpen
from infthor_eval.generation.twins.pairing import AskedWorld
from infthor_eval.generation.twins.pictures import are_clearly_unlike
from infthor_eval.generation.twins.replays import Replays
from infthor_eval.generation.twins.rewriting import in_world, without_traces
from infthor_eval.nieh.scoring import score

from ...helpers.trajectories import FORK
from ..questions.logs import history
from ..questions.logs import state as object_state

STRICT = partial(score, scorer="strict")
FRIDGE, OVEN = "Fridge|1|0|0", "Microwave|1|0|0"
TRAJECTORY = Trajectory(Scene("kitchen-1", InitAction(0.0, 0.9, 0.0)), ExpertPlan([]))
WORLDS = Worlds((TRAJECTORY, TRAJECTORY), frozenset({FRIDGE, OVEN}), frozenset({"Fridge"}))
LEFT, RIGHT = slice(0, 40), slice(60, 100)  # where fridge and microwave are, in columns


@pytest.fixture(scope="module")
def episode(file, simulator):
    with ExitStack() as stack:
        yield Replays(simulator, stack).read(next(iter_trajectories(file)))


def draft(file, simulator, out, *kinds, per_kind=1):
    (out / "metadata").mkdir(parents=True)
    settings = TwinSettings(kinds, 0, per_kind)
    trajectory = next(iter_trajectories(file))
    return draft_twins(trajectory, "base", settings, STRICT, simulator, out)


def break_start(trajectory, scene):
    states = [StartState("Nothing_1", is_open=True)]
    return replace(trajectory, scene=replace(scene, object_states=states))


def break_third(trajectory, scene):
    states = [StartState("", is_open=True)]
    return replace(trajectory, scene=replace(scene, object_states=states))


def break_pose(trajectory, scene):
    lowered = replace(scene.init_action, horizon=scene.init_action.horizon + 5.0)
    return replace(trajectory, scene=replace(scene, init_action=lowered))


def break_length(trajectory, scene):
    plan = replace(trajectory.plan, low_actions=trajectory.plan.low_actions[:-1])
    return replace(trajectory, plan=plan)


def break_action(trajectory, scene):
    low_actions = list(trajectory.plan.low_actions)
    number = next(n for n, low in enumerate(low_actions) if low.api_action.action == "PutObject")
    api = replace(low_actions[number].api_action, receptacle_id="Fridge|9|9|9")
    low_actions[number] = replace(low_actions[number], api_action=api)
    return replace(trajectory, plan=replace(trajectory.plan, low_actions=low_actions))


class Broken:
    """A kind whose only edit breaks something that it does not declare."""

    name = "broken"
    damage = None

    def propose(self, episode, rng):
        yield self

    def apply(self, episode, simulator):
        whole = in_world(episode.trajectory, episode.trajectory.scene)
        broken = type(self).damage(whole, whole.scene)
        states = broken.scene.object_states or []
        # Any drawer, whose name the damage does not know.
        drawer = next(o for o in episode.start.objects.values() if o.object_type == "Drawer")
        for state in states:
            state.name = state.name or drawer.name
        return Worlds((whole, broken), frozenset(), frozenset({"Drawer"}))


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (break_start, "its start cannot be restored"),
        (break_third, "an object differs that was not to be changed"),
        (break_pose, "the agent is elsewhere"),
        (break_length, "another number of frames"),
        (break_action, "PutObject is refused"),
    ],
)
def test_a_broken_edit_is_rejected_and_counted(
    damage, reason, file, simulator, tmp_path, monkeypatch
):
    monkeypatch.setitem(KINDS.built_in, "broken", f"{__name__}:Broken")
    monkeypatch.setattr(Broken, "damage", staticmethod(damage))
    made = draft(file, simulator, tmp_path, "broken")
    assert made.proposed == {"broken": 1}
    assert made.rejected == {"broken": {reason: 1}}
    assert not made.pairs
    assert not list((tmp_path / "metadata").iterdir())


class DoneUnseen:
    """A kind that waits in one world, while a container is opened in the other."""

    name = "unseen"

    def propose(self, episode, rng):
        edit = next(CountOpen().propose(episode, rng))
        waits = [ApiAction("Pass") for _ in edit.actions[0]]
        yield replace_fields(edit, actions=(edit.actions[0], waits))


def test_what_cannot_be_seen_to_be_done_is_rejected(file, simulator, tmp_path, monkeypatch):
    monkeypatch.setitem(KINDS.built_in, "unseen", f"{__name__}:DoneUnseen")
    made = draft(file, simulator, tmp_path, "unseen")
    assert made.rejected == {"unseen": {"an action that is added cannot be seen": 1}}


def test_every_question_can_be_told_by_eye_from_a_clue_frame(made):
    drafted, out = made
    for pair in drafted.pairs:
        first, second = (NiehSet(out, needs_questions=False).frames(name) for name in pair.traj_ids)
        for question in pair.questions:
            assert any(
                are_clearly_unlike(first[clue].path, second[clue].path) for clue in question.clues
            )


def test_an_exchange_without_room_is_refused(episode, simulator):
    one, other = episode.loose[:2]
    nowhere = replace(other, parent_receptacles=["Shelf|9|9|9"])  # which nothing comes to lie on
    with pytest.raises(EditRefused, match="no room"):
        Exchange((None, (one, nowhere))).apply(episode, simulator)


def test_an_episode_with_a_refused_action_has_no_twins(file, simulator):
    trajectory = next(iter_trajectories(file))
    with ExitStack() as stack, pytest.raises(DataError, match="PutObject"):
        Replays(simulator, stack).read(break_action(trajectory, trajectory.scene))


@pytest.fixture(scope="module")
def made(file, simulator, tmp_path_factory):
    """A draft of all kinds, and the folder of its set."""
    out = tmp_path_factory.mktemp("twins") / "set"
    return draft(file, simulator, out, *KINDS.names), out


def test_kinds_give_pairs_whose_two_worlds_differ_where_declared(made):
    drafted, _ = made
    assert len({pair.kind for pair in drafted.pairs}) >= 3
    for pair in drafted.pairs:
        assert any(not frame.same for frame in pair.frames)
        assert all(frame.same or frame.changed for frame in pair.frames)
        for question in pair.questions:
            assert question.answers[0] != question.answers[1]
            assert max(question.overlap) < 1


def test_frames_are_stored_once(made):
    drafted, out = made
    names = {
        name for file in out.glob("metadata/*/frames.txt") for name in file.read_text().splitlines()
    }
    assert {path.stem for path in (out / "frames").iterdir()} == names
    frames = NiehSet(out, needs_questions=False).frames(drafted.pairs[0].traj_ids[0])
    assert len(frames) == len(drafted.pairs[0].frames)
    assert all(frame.problem is None for frame in frames)


def test_no_file_of_a_world_names_the_episode(made):
    _, out = made
    for path in out.glob("metadata/*/*"):
        assert FORK not in path.read_text()


def shape(value):
    """What a document is made of, without its words and numbers."""
    if isinstance(value, dict):
        return {key: shape(item) for key, item in value.items()}
    return [shape(item) for item in value] if isinstance(value, list) else type(value).__name__


@pytest.mark.parametrize(
    "name", ["swap", "move", "replace", "state", "count-open", "count-move", "put-target"]
)
def test_both_worlds_are_written_alike(name, living_room, simulator):
    kind = KINDS.load(name, EditKind)()
    for proposal in kind.propose(living_room, random.Random(1)):
        try:
            worlds = proposal.apply(living_room, simulator)
        except EditRefused:
            continue
        documents = [
            json.loads(encode_trajectory(without_traces(world, "same"))) for world in worlds.pair
        ]
        assert shape(documents[0]) == shape(documents[1])
        assert documents[0] != documents[1]
        flipped = worlds.flipped()
        assert flipped.pair == (worlds.pair[1], worlds.pair[0])
        assert flipped.flipped() == worlds
        return
    pytest.skip("no room for any")


def first_worlds(name, episode, simulator):
    """The two scenes of a kind's first edit for which there is room."""
    for proposal in KINDS.load(name, EditKind)().propose(episode, random.Random(1)):
        try:
            return [world.scene for world in proposal.apply(episode, simulator).pair]
        except EditRefused:
            continue
    raise AssertionError("no room for any")


def test_what_is_not_there_is_put_aside_in_both_worlds(living_room, simulator):
    scenes = first_worlds("replace", living_room, simulator)
    places = []
    for scene in scenes:
        (gone,) = (state.name for state in scene.object_states or [] if state.is_disabled)
        places += [pose.position for pose in scene.object_poses if pose.name == gone]
    assert places[0] == places[1]
    assert places[0]["y"] > 10


def test_a_moved_object_stands_in_line_with_what_it_stands_on(living_room, simulator):
    before, after = (
        {pose.name: pose for pose in scene.object_poses}
        for scene in first_worlds("move", living_room, simulator)
    )
    one, other = (name for name, pose in before.items() if pose != after[name])
    assert after[one].rotation == before[other].rotation
    assert after[other].rotation == before[one].rotation


@pytest.mark.parametrize(("name", "n_moved"), [("move", 2), ("swap", 3), ("replace", 2)])
def test_whichever_object_stands_at_a_place_stands_at_the_same_point(
    name, n_moved, living_room, simulator
):
    points = []
    for scene in first_worlds(name, living_room, simulator):
        gone = {state.name for state in scene.object_states or [] if state.is_disabled}
        points.append(
            {
                pose.name: (round(pose.position["x"], 3), round(pose.position["z"], 3))
                for pose in scene.object_poses
                if pose.name not in gone
            }
        )
    before, after = points
    moved = before.items() ^ after.items()
    assert len({object_name for object_name, _ in moved}) == n_moved
    assert sorted(before.values()) == sorted(after.values())


def test_what_is_replaced_and_what_replaces_it_are_both_seen(living_room):
    kind = KINDS.load("replace", EditKind)()
    proposals = [*kind.propose(living_room, random.Random(1))]
    assert proposals
    for edit in proposals:
        assert {edit.one.object_id, edit.other.object_id} <= living_room.history.seen


def test_labels_are_drawn_by_coin():
    flipped = sum(is_flipped(f"swap-{number}") for number in range(400))
    assert 160 < flipped < 240


def test_names_tell_the_rooms_alone():
    first, second = name_worlds("kitchen-1", "swap-1")
    assert first != second
    assert {name.rpartition("-")[0] for name in (first, second)} == {"kitchen-1"}


def test_the_same_seed_gives_the_same_draft(made, file, simulator, tmp_path):
    drafted, out = made
    again = draft(file, simulator, tmp_path / "again", *KINDS.names)
    assert msgspec.json.encode(again) == msgspec.json.encode(drafted)
    for path in out.glob("metadata/*/*"):
        assert (tmp_path / "again" / path.relative_to(out)).read_bytes() == path.read_bytes()


def question(kind="Fridge"):
    answers = (("yes",), ("no",))
    return PairedQuestion(
        f"Was the {kind} open?", "Was {} open?", "open_state", f"open_state: {kind}", answers, (0,),
        ((0,), (0,)), (False, False), (0.0, 0.0),
    )  # fmt: skip


@pytest.fixture
def world(tmp_path):
    """Makes a world of one frame, lighter in some columns, which shows both objects or none."""

    def make(name, lighter=None, seen=True):
        pixels = np.full((100, 100, 3), 100, np.uint8)
        if lighter is not None:
            pixels[:, lighter] += np.uint8(50)
        path = tmp_path / f"{name}.png"
        Image.fromarray(pixels).save(path)
        log = history({FRIDGE: object_state(FRIDGE), OVEN: object_state(OVEN)})
        log.steps[0].seen = {
            FRIDGE: ObjectInFrame(4000, (0, 0, 39, 99)),
            OVEN: ObjectInFrame(4000, (60, 0, 99, 99)),
        }
        if not seen:
            log.steps[0].seen = {}
        return World(log.steps, [name if lighter else "same"], [path])

    return make


def test_another_thing_that_changed_beside_it_does_not_show_the_answer(world):
    closed = world("closed")
    assert is_shown(question(), WORLDS, closed, world("a", LEFT))
    assert not is_shown(question(), WORLDS, closed, world("b", RIGHT))
    assert is_shown(question("Microwave"), WORLDS, closed, world("b", RIGHT))
    assert not is_shown(question(), WORLDS, closed, world("c", slice(0, 2)))


def test_where_nothing_that_is_asked_about_is_in_view_all_counts(world):
    closed = world("closed", seen=False)
    assert is_shown(question(), WORLDS, closed, world("b", RIGHT, seen=False))


def test_equal_pictures_show_nothing(world):
    assert not is_shown(question(), WORLDS, world("closed"), world("closed"))


def asked(*shown):
    """A world of one frame that shows some of what changed."""
    log = history({FRIDGE: object_state(FRIDGE), OVEN: object_state(OVEN)})
    log.steps[0].seen = {key: ObjectInFrame(4000, (0, 0, 39, 99)) for key in shown}
    return AskedWorld.of(log.steps, WORLDS.changed, 0)


def test_a_world_that_hides_what_the_other_shows_is_no_twin_of_the_episode():
    check_original(True, [], asked(FRIDGE), asked(OVEN))
    check_original(True, [], asked(), asked())
    with pytest.raises(Difference, match="that the other hides"):
        check_original(True, [], asked(FRIDGE, OVEN), asked(OVEN))


def test_of_two_edited_worlds_none_looks_as_the_episode():
    episode = asked(FRIDGE, OVEN).history.steps
    larger = asked(FRIDGE, OVEN)
    larger.history.steps[0].seen[FRIDGE] = ObjectInFrame(4100, (0, 0, 40, 99))
    check_original(False, episode, larger, asked(FRIDGE))
    check_original(False, [*episode, *episode], larger, asked(FRIDGE, OVEN))
    for pair in ((asked(FRIDGE, OVEN), larger), (larger, asked(FRIDGE, OVEN))):
        check_original(True, episode, *pair)
        with pytest.raises(Difference, match="a world looks as the episode does"):
            check_original(False, episode, *pair)
