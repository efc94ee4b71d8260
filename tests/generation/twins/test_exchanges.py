"""Which objects may exchange places."""

import random

from infthor_eval.generation.twins.exchanges import Move, Swap, Untouched
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.wording import canonical_type


def test_of_a_swap_neither_world_is_the_episode(living_room):
    edits = [*Swap().propose(living_room, random.Random(0))]
    assert edits
    for edit in edits:
        (carried, one), (again, other) = edit.pairs
        assert carried == again
        assert living_room.actions_on(carried.object_id)
        assert not any(living_room.actions_on(obj.object_id) for obj in (one, other))
        assert len({canonical_type(obj.object_type) for obj in edit.objects}) == 3
        # At the place of each is another thing in one world than in the other.
        for obj in edit.objects:
            assert edit.partner(0, obj) != edit.partner(1, obj)


def test_of_a_move_one_world_is_the_episode(living_room):
    for edit in Move().propose(living_room, random.Random(0)):
        own, pair = edit.pairs
        assert own is None
        assert [edit.partner(0, obj) for obj in pair] == [*pair]
        assert [edit.partner(1, obj) for obj in pair] == [*pair[::-1]]


def test_the_reverse_of_each_exchange_could_be_proposed_as_well(living_room):
    rng = random.Random(0)
    pairs = [
        pair for kind in (Move(), Swap(), Untouched()) for pair in kind.pairs(living_room, rng)
    ]
    assert pairs
    places = [(obj, living_room.holder(obj.object_id)) for pair in pairs for obj in pair]
    assert all(goes_into(obj.object_type, place.object_type) for obj, place in places)
    # A simulator puts some things where the published table has none.
    others = [obj for obj in living_room.loose if living_room.holder(obj.object_id)]
    assert any(
        not goes_into(obj.object_type, living_room.holder(obj.object_id).object_type)
        for obj in others
    )
