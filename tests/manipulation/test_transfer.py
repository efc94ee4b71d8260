"""Bringing an arm's simulator to where the expert's is: every thing lies where it should, and is as
it should be."""

import math
from dataclasses import replace

import msgspec
import pytest

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.thor.restore import restore
from infthor_eval.thor.transfer import transfer

# What calls can bring about; the temperature is not among them, it changes with what a thing is put
# into.
STATES = ("openness", "is_open", "is_toggled", "is_sliced", "is_broken", "is_dirty", "is_cooked",
          "is_filled_with_liquid")  # fmt: skip

FORK = "Fork|+00.44|+01.52|+02.22"


@pytest.fixture(scope="module")
def kitchen(arena):
    """A kitchen: a tomato is cut, a drawer, the fridge and the microwave are opened, things are put
    into them."""
    return arena("kitchen-1-seed7", 99)


@pytest.fixture(scope="module")
def drawers(arena):
    """Another one: a fork is put in a drawer, which is shut, and opened again."""
    return arena("kitchen-2-seed4", 99)


def start_of(arena):
    """The restored scene in the arm's simulator."""
    restore(arena.simulator, arena.trajectory.scene)
    return arena.simulator.mark()


def differences(here, wanted, held):
    """What is otherwise than wanted, of all things; where a hand holds something it lies
    nowhere."""
    otherwise = []
    for key in here.objects.keys() ^ wanted.objects.keys():
        otherwise.append((key, "is there in one alone"))
    for key in here.objects.keys() & wanted.objects.keys():
        item, there = here.objects[key], wanted.objects[key]
        otherwise += [
            (key, state) for state in STATES if getattr(item, state) != getattr(there, state)
        ]
        apart = math.dist(
            msgspec.structs.astuple(item.position), msgspec.structs.astuple(there.position)
        )
        if there.pickupable and apart > 0.01:
            otherwise.append((key, f"{apart} m away"))
        if key not in held and sorted(item.parent_receptacles or ()) != sorted(
            there.parent_receptacles or ()
        ):
            otherwise.append((key, f"in {item.parent_receptacles}, not {there.parent_receptacles}"))
    return otherwise


@pytest.mark.parametrize("name", ["kitchen", "drawers"])
def test_after_it_every_thing_is_where_and_as_it_should_be(name, request):
    arena = request.getfixturevalue(name)
    initial = start_of(arena)
    assert len(arena.states.starts) == len(arena.episodes) > 5
    for start in arena.states.starts.values():
        view = arena.simulator.rewind(initial, exactly=True)
        agent = view.agent
        assert transfer(arena.simulator, start.view) == []
        assert differences(arena.simulator.view, start.view, start.view.inventory) == []
        assert arena.simulator.view.agent == agent


def test_the_moments_have_what_makes_it_hard(kitchen, drawers):
    """Slices, open and shut doors, things shut in, and things in the hand."""
    views = [
        start.view for start in (*kitchen.states.starts.values(), *drawers.states.starts.values())
    ]
    first = kitchen.states.starts[12].view
    assert any(
        key not in first.objects for view in views for key in view.objects if "TomatoSliced" in key
    )
    opened = [item for view in views for item in view.objects.values() if item.is_open]
    assert {item.object_type for item in opened} >= {"Drawer", "Fridge", "Microwave"}
    assert any(view.inventory for view in views)
    for number, opened in ((59, False), (87, True)):
        view = drawers.states.starts[number].view
        (drawer,) = view.objects[FORK].parent_receptacles
        assert (view.objects[drawer].object_type, view.objects[drawer].is_open) == (
            "Drawer",
            opened,
        )


def test_it_can_be_done_again_and_from_any_moment_to_any_other_later_one(kitchen):
    start = start_of(kitchen)
    starts = list(kitchen.states.starts.values())
    kitchen.simulator.rewind(start, exactly=True)
    for start in starts:
        assert transfer(kitchen.simulator, start.view) == []
        assert differences(kitchen.simulator.view, start.view, start.view.inventory) == []


def test_states_are_set_either_way(drawers):
    start = start_of(drawers)
    view = drawers.simulator.rewind(start, exactly=True)
    changed = dict(view.objects)
    for key, item in view.objects.items():
        changes = {}
        if item.object_type in ("Faucet", "CoffeeMachine", "LightSwitch"):
            changes["is_toggled"] = not item.is_toggled
        if item.object_type in ("Plate", "Bowl", "Mug"):
            changes["is_dirty"] = not item.is_dirty
        if item.object_type == "Potato":
            changes["is_cooked"] = True
        if item.object_type == "Cup":
            changes["is_filled_with_liquid"] = True
        if item.object_type == "Drawer":
            changes |= {"openness": 0.5, "is_open": True}
        changed[key] = msgspec.structs.replace(item, **changes)
    wanted = replace(view, received=changed)

    def states(view):
        return {
            key: [getattr(item, state) for state in STATES] for key, item in view.objects.items()
        }

    assert states(wanted) != states(view)
    transfer(drawers.simulator, wanted)
    assert states(drawers.simulator.view) == states(wanted)
    transfer(drawers.simulator, view)
    cooked = {
        key for key, item in changed.items() if item.is_cooked and not view.objects[key].is_cooked
    }
    # Nobody uncooks a potato.
    back = {key: value for key, value in states(view).items() if key not in cooked}
    assert {
        key: value for key, value in states(drawers.simulator.view).items() if key not in cooked
    } == back


def test_what_is_missing_is_named(drawers):
    start = start_of(drawers)
    view = drawers.simulator.rewind(start, exactly=True)
    fork = view.objects[FORK]
    unknown = msgspec.structs.replace(fork, object_id="Elephant|+01.00|+00.00|+02.00")
    wanted = replace(view, received=view.objects | {unknown.object_id: unknown})
    assert transfer(drawers.simulator, wanted) == [unknown.object_id]
    drawers.simulator.step("RemoveFromScene", objectId=fork.object_id)
    assert transfer(drawers.simulator, wanted) == sorted([unknown.object_id, fork.object_id])
    assert transfer(drawers.simulator, view) == [fork.object_id]


def test_an_episode_whose_things_are_missing_counts_for_nobody(drawers):
    start = drawers.states.starts[13]
    unknown = msgspec.structs.replace(
        start.view.objects[start.object_id], object_id="Elephant|+01.00|+00.00|+02.00"
    )
    view = replace(start.view, received=start.view.objects | {unknown.object_id: unknown})
    for changes in ({"object_id": unknown.object_id}, {"receptacle_id": unknown.object_id}):
        missing = replace(start, view=view, **changes)
        real = drawers.states.starts
        drawers.states.starts[13] = missing
        try:
            with pytest.raises(
                InfeasibleError, match=r"^Elephant\|.* cannot be brought to where it was$"
            ):
                drawers.begin(13)
        finally:
            real[13] = start
