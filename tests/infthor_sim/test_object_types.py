"""A type of object is one record: they fit together, and a new one needs nothing else."""

import numpy as np
import pytest

from infthor_sim.object_types import (
    FORMER_NAMES,
    OBJECT_TYPES,
    ObjectType,
    allowed_in,
    modern_type,
    type_named,
)
from infthor_sim.objects import default_object
from infthor_sim.render.shapes.catalogue import SHAPES, shape

from .harness import Bench

WHISK = ObjectType(
    "Whisk", (0.06, 0.05, 0.28), pickupable=True, mass=0.1, materials=("Metal",),
    categories=("cutlery",)
)  # fmt: skip
CRATE = ObjectType("Crate", (0.4, 0.3, 0.4), receptacle=True, takes=("food", "Whisk"), open_top=1.0)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    for declared in (WHISK, CRATE):
        monkeypatch.setitem(OBJECT_TYPES, declared.name, declared)
    new = Bench.at("kitchen-1", renderInstanceSegmentation=True, size=150)
    return new


def lay_on_table(bench: Bench, object_type: str) -> tuple[str, str]:
    """Puts an object of a new type on the table and keeps the first mug; ids of both."""
    mug = bench.object(bench.first("Mug"))
    table = bench.object(bench.first("DiningTable"))["axisAlignedBoundingBox"]
    middle = {**table["center"], "y": table["center"]["y"] + table["size"]["y"] / 2}
    poses = [
        {"objectName": mug["name"], "position": mug["position"], "rotation": mug["rotation"]},
        {"objectName": f"{object_type}_1", "position": middle, "rotation": {}},
    ]
    bench.ok("SetObjectPoses", objectPoses=poses)
    return bench.first(object_type), bench.first("Mug")


def test_a_record_makes_a_thing_that_is_drawn_picked_up_and_put_where_its_categories_go(bench):
    whisk, mug = lay_on_table(bench, "Whisk")
    item = bench.object(whisk)
    assert item["parentReceptacles"] == [bench.first("DiningTable")]
    assert (item["pickupable"], item["mass"], item["salientMaterials"]) == (True, 0.1, ["Metal"])
    assert list(item["axisAlignedBoundingBox"]["size"].values()) == pytest.approx(WHISK.size)
    bench.stand_before(whisk)
    assert bench.shows(whisk).any()
    bench.ok("PickupObject", whisk)
    assert "cannot be placed" in bench.refused(
        "PutObject", bench.first("Toaster"), forceAction=True
    )
    bench.force("PutObject", mug)
    assert bench.object(whisk)["parentReceptacles"] == [mug]


def test_a_record_makes_a_receptacle_that_takes_what_it_names(bench):
    world = bench.sim.world
    crate = default_object("Crate", world.agent.position * (1, 0, 1))
    world.add(crate)
    whisk, mug = lay_on_table(bench, "Whisk")
    bench.force("PickupObject", mug)
    assert "cannot be placed" in bench.refused("PutObject", crate.object_id, forceAction=True)
    bench.ok("DropHandObject")
    bench.force("PickupObject", whisk)
    bench.force("PutObject", crate.object_id)
    assert bench.object(crate.object_id)["receptacleObjectIds"] == [whisk]
    assert world.objects[whisk].bounds()[0][1] < crate.bounds()[1][1], "it stands inside"


def test_a_type_without_a_look_of_its_own_is_a_box_that_fills_its_size():
    item = default_object("Gizmo", np.zeros(3))
    assert len(shape(item)) == 1
    item.type, item.box_size = WHISK, np.array(WHISK.size)
    (part,) = shape(item)
    assert np.asarray(part.half) * 2 == pytest.approx(WHISK.size)


def test_a_type_without_a_record_is_inert():
    gizmo = type_named("Gizmo")
    assert gizmo == ObjectType("Gizmo")
    assert not gizmo.pickupable
    assert not any(allowed_in("Gizmo", name) or allowed_in(name, "Gizmo") for name in OBJECT_TYPES)


def test_records_name_only_what_there_is():
    words = set(OBJECT_TYPES).union(*(declared.categories for declared in OBJECT_TYPES.values()))
    for declared in OBJECT_TYPES.values():
        assert words.issuperset((*(declared.takes or ()), *declared.refuses)), declared.name
        assert declared.slice_type in {"", *OBJECT_TYPES}
        assert declared.switched_by in {"", *OBJECT_TYPES}
        assert bool(declared.slices) == declared.sliceable == bool(declared.slice_type)
    assert {declared.shape for declared in OBJECT_TYPES.values()} == set(SHAPES)


@pytest.mark.parametrize(
    ("receptacle", "taken", "refused"),
    [
        ("CoffeeMachine", "Mug", "Cup"), ("Toaster", "BreadSliced", "Bread"),
        ("StoveBurner", "Pan", "Plate"),
        ("Microwave", "Potato", "Fork"), ("Fridge", "WineBottle", "Book"),
        ("SinkBasin", "Spoon", "Book"),
        ("Drawer", "Pencil", "Pillow"), ("Pot", "Lettuce", "Bread"),
        ("TowelHolder", "Towel", "HandTowel"),
        ("Sofa", "RemoteControl", "Mug"), ("Safe", "CreditCard", "Laptop"),
        ("DiningTable", "Laptop", "Chair"),
    ],
)  # fmt: skip
def test_receptacles_take_what_ai2thor_documents(receptacle, taken, refused):
    assert allowed_in(taken, receptacle)
    assert not allowed_in(refused, receptacle)


def test_former_names_are_those_of_the_trajectories():
    # The one import of infthor_eval in the simulator's tests: it renames the same types in what it
    # reads, and neither package may import the other's table.
    from infthor_eval.formats import object_ids

    assert object_ids._RENAMED == FORMER_NAMES
    assert {modern_type(name) for name in FORMER_NAMES} <= set(OBJECT_TYPES)
    assert all(modern_type(name) == name for name in OBJECT_TYPES)
