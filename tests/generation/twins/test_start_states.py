"""Which containers are open or closed at the start of the two worlds."""

import random
from dataclasses import replace

import pytest
from msgspec.structs import replace as replace_fields

from infthor_eval.generation.twins.start_states import Opened


def opened(episode):
    """The containers that each edit turns, by world, and the edit's two objects."""
    for edit in Opened().propose(episode, random.Random(0)):
        own = {obj.name: obj.is_open for obj in (edit.one, edit.other)}
        worlds = edit.apply(episode, None).pair
        states = [{one.name: one.is_open for one in world.scene.object_states} for world in worlds]
        assert all(world.keys() == own.keys() for world in states)
        yield edit, [{name for name in own if world[name] != own[name]} for world in states]


def as_at_start(episode, is_open):
    """The episode as if the containers had begun so."""
    objects = {
        key: replace_fields(obj, is_open=is_open(obj)) if obj.openable else obj
        for key, obj in episode.start.objects.items()
    }
    return replace(episode, start=replace(episode.start, received=objects))


@pytest.mark.parametrize(
    "is_open",
    [
        lambda obj: obj.is_open,
        lambda _: False,
        lambda _: True,
        lambda obj: obj.object_type in ("Laptop", "Box"),
        lambda obj: obj.object_type == "Drawer",
    ],
)
def test_each_world_turns_one_container_so_neither_is_the_episode(living_room, is_open):
    edits = list(opened(as_at_start(living_room, is_open)))
    assert edits
    for edit, turned in edits:
        assert turned == [{edit.one.name}, {edit.other.name}]
        assert {edit.one.object_id, edit.other.object_id} <= living_room.history.seen
