"""What is carried once more, or elsewhere, on logs made by hand."""

import random
from types import SimpleNamespace

import pytest

from infthor_eval.formats.trajectory import (
    ApiAction,
    DiscreteAction,
    ExpertPlan,
    InitAction,
    LowAction,
    Scene,
    Trajectory,
)
from infthor_eval.generation.twins.episode import Episode
from infthor_eval.generation.twins.kinds import KINDS, EditKind
from infthor_eval.thor.view import ThorObject, Vector

from ..questions.logs import history, moved, state

TABLE, DESK = "DiningTable|1|0|0", "Desk|1|0|0"
MUG, BOOK, VASE = "Mug|1|0|0", "Book|1|0|0", "Vase|1|0|0"
PLACES = {key: state(key) for key in (TABLE, DESK)}
IDLE = (("MoveAhead", None, None, {}),) * 3


def thor_object(key):
    object_type = key.partition("|")[0]
    is_place = key in PLACES
    return ThorObject(
        key, object_type, f"{object_type}_1", Vector(), pickupable=not is_place, receptacle=is_place
    )


def episode(places, *events):
    """An episode in which some things are at their places, and the agent can reach all."""
    start = {**PLACES, **{key: state(key, place) for key, place in places.items()}}
    log = history(start, *events, *IDLE)
    low = LowAction(ApiAction("MoveAhead"), 0, DiscreteAction("MoveAhead", {}), None)
    plan = ExpertPlan([low] * (len(log) - 1))
    trajectory = Trajectory(Scene("kitchen-1", InitAction(0.0, 0.9, 0.0)), plan)
    view = SimpleNamespace(objects={key: thor_object(key) for key in start})
    return Episode(trajectory, view, log)


def carried(name, given):
    """What each world of each edit has carried: the object and where it is put, in order."""
    edits = KINDS.load(name, EditKind)().propose(given, random.Random(0))
    return [
        [
            [(api.object_id, api.receptacle_id) for api in actions if api.action == "PutObject"]
            for actions in edit.actions
        ]
        for edit in edits
    ]


def test_what_was_never_moved_is_moved_twice_in_both_worlds():
    edits = carried("count-move", episode({MUG: TABLE, BOOK: TABLE}))
    mug = (MUG, TABLE)
    book = (BOOK, TABLE)
    assert [[mug, mug, mug], [mug, mug, book]] in edits
    assert [[book, book, book], [book, book, mug]] in edits


def test_moves_of_the_episode_count():
    edits = carried("count-move", episode({MUG: DESK, BOOK: TABLE}, *moved(MUG, DESK, TABLE)))
    assert edits == [[[(MUG, TABLE)] * 2, [(MUG, TABLE), (BOOK, TABLE)]]]


def test_things_at_different_places_are_counted_by_place():
    given = episode({MUG: TABLE, BOOK: DESK})
    mug, book = (MUG, TABLE), (BOOK, DESK)
    assert [[mug, book, mug], [mug, book, book]] in carried("count-put", given)
    assert not carried("count-move", given)
    assert not carried("count-put", episode({MUG: TABLE, BOOK: TABLE}))


def test_where_something_was_put_before_there_is_no_further_put_in_both_worlds():
    given = episode({MUG: TABLE, BOOK: DESK, VASE: DESK}, *moved(VASE, DESK, TABLE))
    mug, book = (MUG, TABLE), (BOOK, DESK)
    assert [[book, mug], [book, book]] in carried("count-put", given)


@pytest.mark.parametrize("name", ["count-move", "count-put", "put-target"])
def test_nothing_is_carried_while_the_hand_is_full(name):
    given = episode({MUG: TABLE, BOOK: DESK, VASE: TABLE}, *moved(VASE, TABLE, DESK)[:1])
    assert not carried(name, given)


def test_where_a_thing_is_put_is_an_edit_in_both_worlds():
    given = episode({MUG: TABLE})
    ((first, second),) = carried("put-target", given)
    assert {*first, *second} == {(MUG, TABLE), (MUG, DESK)}
    assert len(first) == len(second) == 1


def test_what_is_needed_later_is_put_nowhere_else():
    later = (*IDLE, *moved(MUG, TABLE, DESK))
    indices = [
        edit.index
        for edit in KINDS.load("put-target", EditKind)().propose(
            episode({MUG: TABLE}, *later), random.Random(0)
        )
    ]
    assert indices
    assert min(indices) >= len(later)


def test_worlds_have_the_same_number_of_actions():
    given = episode({MUG: TABLE, BOOK: TABLE})
    for edit in KINDS.load("count-move", EditKind)().propose(given, random.Random(0)):
        worlds = edit.apply(given, None)
        lengths = {len(world.plan.low_actions) for world in worlds.pair}
        assert lengths == {len(given.trajectory.plan.low_actions) + 6}
        assert worlds.changed == {MUG, BOOK}
