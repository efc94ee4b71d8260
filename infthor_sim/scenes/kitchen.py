# ruff: noqa: SIM905 - tables of names read best as words
"""Procedural kitchens: a counter with sink, stove and appliances, a table with chairs."""

import numpy as np

from infthor_sim.objects import SimObject
from infthor_sim.scenes.roomplan import RoomPlan, name_after, rim_pieces

# of the counter, metres
_HEIGHT = 0.92
_DEPTH = 0.65
_MODULE = 0.6  # width of a part of the counter, metres
_FRONT = _MODULE - 0.004  # width of its doors and drawers: a hairline between neighbours
_APPLIANCES = (
    ("Microwave", (0.52, 0.32, 0.4)),
    ("CoffeeMachine", (0.25, 0.36, 0.3)),
    ("Toaster", (0.2, 0.2, 0.3)),
)
_TOOLS = (
    "Apple Bread ButterKnife Bowl Cup DishSponge Egg Fork Knife Lettuce Mug Pan PepperShaker Plate "
    "Pot Potato"
    " SaltShaker SoapBottle Spatula Spoon Tomato Cup Mug Plate Bowl Apple Potato Tomato".split()
)
_MORE = (
    "Bottle Book Kettle Ladle Mug PaperTowelRoll Plate Statue Vase WineBottle Spoon Fork Egg Bowl"
).split()


def furnish_kitchen(plan: RoomPlan, loose: int = 34) -> None:
    """Furnish a room as a kitchen with up to `loose` small things."""
    _place_counter(plan)
    _place_table(plan)
    plan.try_against("GarbageCan", plan.shuffle(("x-", "x+", "z-")))
    plan.try_against("HousePlant", plan.shuffle(("x-", "x+", "z-")), (0.34, 0.7, 0.34))
    if plan.random.random() < 0.6:
        plan.try_against("SideTable", plan.shuffle(("x-", "x+", "z-")))
    plan.loose += [*_TOOLS, *plan.shuffle(_MORE)][:loose]


def _place_counter(plan: RoomPlan) -> None:
    """Put a fridge and a counter of modules along the z+ wall, with cabinets above."""
    start, end = plan.span("z+")
    plan.place_against("z+", "Fridge", start + 0.5, size=(0.9, 1.85, 0.75), gap=0.02)
    first = start + 1.0
    count = int((end - first) // _MODULE)
    sink = int(plan.random.integers(1, count - 1)) if count > 3 else 1
    stove = (sink + 2) % count if count > 3 else count - 1
    stove = stove if abs(stove - sink) > 1 else (sink - 2) % count
    top = plan.place_against(
        "z+",
        "CounterTop",
        first + count * _MODULE / 2,
        y=_HEIGHT - 0.04,
        size=(count * _MODULE, 0.04, _DEPTH),
    )
    top.support = None
    for index in range(count):
        at = first + (index + 0.5) * _MODULE
        _place_lower_cabinet(plan, at, index, drawer=index != sink)
        if index == sink:
            _place_sink(plan, top, at)
        elif index == stove:
            _place_stove(plan, at)
        if index not in (sink, stove):
            upper = plan.place_against("z+", "Cabinet", at, y=1.5, size=(_FRONT, 0.65, 0.35))
            upper.hinge = 1 if index % 2 else -1
    free = [i for i in range(count) if i not in (sink, stove)]
    for (object_type, size), index in zip(_APPLIANCES, plan.random.permutation(free), strict=False):
        plan.place_against(
            "z+", object_type, first + (int(index) + 0.5) * _MODULE, y=_HEIGHT, size=size, gap=0.08
        )


def _place_lower_cabinet(plan: RoomPlan, at: float, index: int, drawer: bool) -> None:
    top = _HEIGHT - 0.05
    if drawer:
        plan.place_against("z+", "Drawer", at, y=top - 0.178, size=(_FRONT, 0.176, _DEPTH - 0.06))
        top -= 0.182
    cabinet = plan.place_against(
        "z+", "Cabinet", at, y=0.1, size=(_FRONT, top - 0.102, _DEPTH - 0.06)
    )
    cabinet.hinge = 1 if index % 2 else -1
    cabinet.hollow = not drawer  # the sink hangs in it


def _place_sink(plan: RoomPlan, top: SimObject, at: float) -> None:
    sink = plan.place_against("z+", "Sink", at, y=_HEIGHT - 0.17, size=(0.56, 0.172, 0.46), gap=0.1)
    basin = plan.place_against(
        "z+", "SinkBasin", at, y=_HEIGHT - 0.169, size=(0.5, 0.164, 0.38), gap=0.12
    )
    name_after(sink, basin)
    faucet = plan.place_against("z+", "Faucet", at, y=_HEIGHT, size=(0.16, 0.28, 0.2), gap=0.04)
    faucet.style = 0
    top.pieces, sink.pieces = rim_pieces(top, sink), rim_pieces(sink, basin)
    plan.place_against("z+", "Window", at, y=1.25, size=(_MODULE - 0.04, 0.9, 0.06), gap=-0.02)


def _place_stove(plan: RoomPlan, at: float) -> None:
    burners = []
    for dx in (-0.14, 0.14):
        for gap in (0.06, 0.34):
            burners.append(
                plan.place_against(
                    "z+", "StoveBurner", at + dx, y=_HEIGHT, size=(0.22, 0.015, 0.22), gap=gap
                )
            )
    for index, burner in enumerate(burners):
        knob = plan.place_against(
            "z+",
            "StoveKnob",
            at - 0.21 + 0.14 * index,
            y=_HEIGHT - 0.045,
            size=(0.05, 0.05, 0.04),
            gap=_DEPTH - 0.01,
        )
        knob.controls = (burner.object_id,)


def _place_table(plan: RoomPlan) -> None:
    """Put a dining table with two chairs into a corner away from the counter, clear of doorways."""
    room = plan.room
    length = round(float(plan.random.uniform(1.1, 1.4)), 2)
    z = room.z_min + length / 2 + 0.15
    for side in plan.shuffle(("x-", "x+")):
        inward = 1.0 if side == "x-" else -1.0
        x = (room.x_min if side == "x-" else room.x_max) + 0.5 * inward
        ends = np.array(
            [[x - 0.45 * inward, 0.0, z - length / 2], [x + 0.95 * inward, 1.0, z + length / 2]]
        )
        if plan.is_clear(ends.min(axis=0), ends.max(axis=0)):
            plan.place("DiningTable", x, z, 90.0, size=(length, 0.78, 0.85))
            for share in (-0.25, 0.25):
                yaw = 270.0 if side == "x-" else 90.0
                plan.place(
                    "Chair",
                    x + 0.65 * inward,
                    round(z + share * length, 2),
                    yaw,
                    size=(0.42, 0.9, 0.45),
                )
            return
