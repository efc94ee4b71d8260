"""A kitchen by hand in which what an action does is said, not simulated."""

from dataclasses import replace

import msgspec

from infthor_eval.household.navigation import GRID, Grid
from infthor_eval.thor.view import AgentPose, Box, Vector
from tests.thor.views import thing, view

SIZE = Box(Vector(), Vector(1.0, 1.0, 1.0))

TABLE = "SideTable|+00.00|+00.00|+00.00"
OTHER_TABLE = "SideTable|+05.00|+00.00|+00.00"
FRIDGE = "Fridge|+01.00|+00.00|+00.00"
MICROWAVE = "Microwave|+02.00|+00.90|+00.00"
BASIN = "Sink|+03.00|+00.80|+00.00|SinkBasin"
FAUCET = "Faucet|+03.00|+01.00|+00.20"
BATHTUB = "Bathtub|+09.00|+00.40|+00.00|BathtubBasin"
TOILET = "Toilet|+08.00|+00.00|+00.00"
BATH_FAUCET = "Faucet|+09.00|+00.80|+00.90"
LAMP = "DeskLamp|+00.10|+01.00|+00.00"
DRAWER = "Drawer|+04.00|+00.50|+00.00"
MUG = "Mug|+00.20|+00.90|+00.00"
CUP = "Cup|+00.30|+00.90|+00.00"
PLATE = "Plate|+00.40|+00.90|+00.00"
APPLE = "Apple|+00.50|+00.90|+00.00"
SLICE_1, SLICE_2 = f"{APPLE}|AppleSliced_1", f"{APPLE}|AppleSliced_2"

_FURNITURE = {
    TABLE: {"receptacle": True},
    OTHER_TABLE: {"receptacle": True},
    FRIDGE: {"receptacle": True, "openable": True},
    MICROWAVE: {"receptacle": True, "openable": True, "toggleable": True},
    BASIN: {"receptacle": True},
    FAUCET: {"toggleable": True},
    BATHTUB: {"receptacle": True},
    BATH_FAUCET: {"toggleable": True},
    TOILET: {"receptacle": True, "openable": True},
    LAMP: {"toggleable": True},
    DRAWER: {"receptacle": True, "openable": True},
}
_THINGS = {
    MUG: {"receptacle": True},
    CUP: {"receptacle": True},
    PLATE: {"receptacle": True},
    APPLE: {"sliceable": True},
    SLICE_1: {},
    SLICE_2: {},
}


def kitchen(
    where=None,
    held=None,
    opened=(),
    on=(),
    hidden=(),
    at=(0, 0),
    facing=0,
    horizon=30.0,
    refused=False,
    without=(),
):
    """The kitchen; everything lies on the first table unless said otherwise.

    Args:
        where: a thing's id to that of what it is in.
        held: id of what is in the hand.
        opened: ids of what is open.
        on: ids of what is switched on.
        hidden: ids of what is not visible.
        at: the agent's cell.
        facing: degrees.
        horizon: degrees downwards.
        refused: whether the action before was.
        without: ids of what is not there.
    """
    parents = dict.fromkeys(_THINGS, TABLE) | (where or {})
    parents.pop(held, None)
    objects = []
    for key, fields in _FURNITURE.items():
        state = {"is_open": key in opened, "is_toggled": key in on, "visible": key not in hidden}
        objects.append(thing(key, **fields, **state, axis_aligned_bounding_box=SIZE))
    for key, fields in _THINGS.items():
        place = {"parent_receptacles": [parents[key]]} if key in parents else {"is_picked_up": True}
        objects.append(thing(key, pickupable=True, **fields, **place, visible=key not in hidden))
    inside = {
        key: [child for child, parent in parents.items() if parent == key]
        for key in [*_FURNITURE, *_THINGS]
    }
    objects = [
        msgspec.structs.replace(item, receptacle_object_ids=inside[item.object_id])
        if item.receptacle
        else item
        for item in objects
        if item.object_id not in without
    ]
    pose = AgentPose(Vector(at[0] * GRID, 0.9, at[1] * GRID), float(facing), horizon)
    view_of_kitchen = view(*objects, inventory=() if held is None else (held,))
    return replace(view_of_kitchen, agent=pose, success=not refused, error="no" if refused else "")


# A corridor ten cells long, in which the agent walks towards greater z.
CORRIDOR = Grid((0.0, z * GRID) for z in range(10))
