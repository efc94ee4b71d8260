# ruff: noqa: SIM905 - tables of names read best as words
"""What stands in procedural kitchens, living rooms, bedrooms and bathrooms."""

from dataclasses import replace

import numpy as np

from infthor_sim.objects import SimObject
from infthor_sim.scenes.roomplan import RoomPlan, name_after, rim_pieces

# of a counter, metres
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


def furnish_kitchen(plan: RoomPlan) -> None:
    """Furnish a room as a kitchen with up to 34 small things."""
    _place_counter(plan)
    _place_table(plan)
    plan.try_against("GarbageCan", plan.shuffle(("x-", "x+", "z-")))
    plan.try_against("HousePlant", plan.shuffle(("x-", "x+", "z-")), (0.34, 0.7, 0.34))
    if plan.random.random() < 0.6:
        plan.try_against("SideTable", plan.shuffle(("x-", "x+", "z-")))
    plan.loose += [*_TOOLS, *plan.shuffle(_MORE)][:34]


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
    _let_in(top, sink, basin)
    faucet = plan.place_against("z+", "Faucet", at, y=_HEIGHT, size=(0.16, 0.28, 0.2), gap=0.04)
    faucet.style = 0
    plan.place_against("z+", "Window", at, y=1.25, size=(_MODULE - 0.04, 0.9, 0.06), gap=-0.02)


def _let_in(top: SimObject, sink: SimObject, basin: SimObject) -> None:
    """Let a sink into a counter, and its basin into the sink."""
    name_after(sink, basin)
    top.pieces = rim_pieces(top, sink)
    sink.pieces = rim_pieces(sink, basin)


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


_ALONG_WALLS = (
    "ArmChair SideTable FloorLamp ShelvingUnit GarbageCan DiningTable Desk Ottoman".split()
)
_IN_LIVING_ROOMS = (
    "Book Book Box CellPhone CreditCard KeyChain Laptop Newspaper Pillow Pillow RemoteControl "
    "Statue"
    " TissueBox Vase Watch WateringCan Candle Plate Bowl Pencil Pen Mug CreditCard KeyChain Vase"
).split()
_SIZES = {"DiningTable": (1.1, 0.75, 0.8), "Desk": (1.2, 0.76, 0.6),
          "ShelvingUnit": (0.9, 1.5, 0.35),
          "SideTable": (0.5, 0.6, 0.4), "FloorLamp": (0.4, 1.6, 0.4)}  # fmt: skip


def furnish_living_room(plan: RoomPlan) -> None:
    """Furnish a room as a living room with up to 24 small things."""
    room = plan.room
    middle = (room.x_min + room.x_max) / 2
    stand = plan.place_against("z+", "TVStand", round(middle, 2), size=(1.4, 0.5, 0.42), gap=0.02)
    _place_drawers(plan, stand.object_id, "z+", middle, (1.4, 0.5, 0.42), 2)
    screen = plan.place_against(
        "z+", "Television", round(middle, 2), y=0.5, size=(1.1, 0.68, 0.2), gap=0.1
    )
    away = room.z_max - screen.box_size[2] - 2.3
    plan.place(
        "Sofa", round(middle, 2), round(max(away, room.z_min + 0.55), 2), 0.0, size=(2.0, 0.85, 0.9)
    )
    plan.place(
        "CoffeeTable",
        round(middle, 2),
        round(max(away, room.z_min + 0.55) + 1.15, 2),
        0.0,
        size=(1.1, 0.42, 0.55),
    )
    sides = ["x-", "x+", "z-"]
    for object_type in _ALONG_WALLS:
        if (
            object_type in {"ArmChair", "FloorLamp", "SideTable", "GarbageCan"}
            or plan.random.random() < 0.5
        ):
            item = plan.try_against(object_type, plan.shuffle(sides), _SIZES.get(object_type))
            if item is not None and object_type == "SideTable":
                _place_lamp(plan, item.center[0], item.center[2], float(item.bounds()[1][1]))
    plan.try_against("HousePlant", sides, (0.4, 0.9, 0.4))
    plan.try_against("Painting", ["z+", "x-", "x+"], (0.9, 0.7, 0.05), y=1.4)
    plan.try_against("Window", ["x+", "x-"], (1.3, 1.3, 0.06), y=0.95)
    plan.loose += plan.shuffle(_IN_LIVING_ROOMS)[:24]


def _place_lamp(plan: RoomPlan, x: float, z: float, y: float) -> None:
    """Put a desk lamp on a piece of furniture."""
    plan.place(
        "DeskLamp", round(float(x), 3), round(float(z), 3), 0.0, y=y, size=(0.22, 0.42, 0.22)
    )


def _place_drawers(
    plan: RoomPlan, owner_id: str, side: str, at: float, size: tuple[float, float, float], rows: int
) -> None:
    """Fill a chest's front with two columns of drawers; the chest is drawn without a front."""
    owner = next(o for o in plan.objects if o.object_id == owner_id)
    owner.hollow = True
    width, height, depth = size
    rise = (height - 0.1) / rows
    for row in range(rows):
        for column in (-1, 1):
            plan.place_against(
                side, "Drawer", round(at + column * width / 4, 3), y=round(0.04 + row * rise, 3),
                size=(width / 2 - 0.04, rise - 0.02, depth - 0.03), gap=0.035,
            )  # fmt: skip


_IN_BEDROOMS = (
    "AlarmClock AlarmClock BaseballBat BasketBall Book Book Bowl CD CD CellPhone CreditCard "
    "CreditCard KeyChain Laptop"
    " Mug Pen Pencil Pillow Pillow TeddyBear TennisRacket TissueBox Cloth Box"
).split()


def furnish_bedroom(plan: RoomPlan) -> None:
    """Furnish a room as a bedroom with up to 22 small things."""
    room = plan.room
    at = round(room.x_min + 1.75, 2)
    plan.place_against("z+", "Bed", at, size=(1.5, 0.95, 2.0), gap=0.02)
    for side in (-1, 1):
        stand = plan.place_against(
            "z+", "SideTable", round(at + side * 1.05, 2), size=(0.45, 0.55, 0.4), gap=0.03
        )
        if side > 0:
            _place_lamp(plan, stand.center[0], stand.center[2], float(stand.bounds()[1][1]))
    plan.place_against(
        "z+", "Window", round(room.x_max - 0.9, 2), y=1.0, size=(1.0, 1.2, 0.06), gap=-0.02
    )
    where = round((room.z_min + room.z_max) / 2 + 0.2, 2)
    size = (1.2, 0.95, 0.5)
    dresser = plan.place_against("x+", "Dresser", where, size=size, gap=0.02)
    _place_drawers(plan, dresser.object_id, "x+", where, size, 3)
    desk_at = round(room.x_max - 1.2, 2)
    desk = plan.place_against("z-", "Desk", desk_at, size=(1.3, 0.76, 0.6), gap=0.02)
    _place_lamp(plan, desk.center[0] + 0.5, desk.center[2], 0.76)
    plan.place(
        "Chair",
        round(desk_at - 0.1, 2),
        round(room.z_min + 0.95, 2),
        180.0,
        size=(0.42, 0.88, 0.42),
    )
    sides = ["x-", "z-"]
    for object_type, size_of in (
        ("GarbageCan", None),
        ("ArmChair", (0.8, 0.85, 0.8)),
        ("ShelvingUnit", (0.9, 1.5, 0.35)),
    ):
        if object_type != "ArmChair" or plan.random.random() < 0.6:
            plan.try_against(object_type, plan.shuffle(sides), size_of)
    if plan.random.random() < 0.5:
        plan.try_against("Safe", sides, (0.45, 0.45, 0.4))
    plan.try_against("Painting", ["x-", "z-", "x+"], (0.8, 0.6, 0.05), y=1.45)
    plan.loose += plan.shuffle(_IN_BEDROOMS)[:22]


_IN_BATHROOMS = (
    "Candle Candle Cloth Cloth DishSponge SoapBar SoapBar SoapBottle SoapBottle SprayBottle "
    "SprayBottle TissueBox"
    " ToiletPaper ToiletPaper HandTowel Towel"
).split()
_TOP = 0.85  # of the washstand, metres


def furnish_bathroom(plan: RoomPlan) -> None:
    """Furnish a room as a bathroom with up to 16 small things."""
    room = plan.room
    _place_washstand(plan, round(room.x_min + 0.95, 2))
    at = round(room.x_max - 0.6, 2)
    plan.place_against("z+", "Toilet", at, size=(0.45, 0.85, 0.7), gap=0.02)
    plan.place_against(
        "z+", "ToiletPaperHanger", round(at - 0.55, 2), y=0.7, size=(0.23, 0.08, 0.1)
    )
    tub_at = round(room.z_min + 0.95, 2)
    tub = plan.place_against("x+", "Bathtub", tub_at, size=(1.7, 0.5, 0.75), gap=0.02)
    basin = plan.place_against(
        "x+", "BathtubBasin", tub_at, y=0.03, size=(1.55, 0.3, 0.6), gap=0.095
    )
    name_after(tub, basin)
    plan.place_against("x+", "Faucet", tub_at, y=0.52, size=(0.16, 0.2, 0.16), gap=0.02)
    plan.place_against(
        "z-", "TowelHolder", round(room.x_min + 0.7, 2), y=1.3, size=(0.66, 0.04, 0.11)
    )
    plan.place_against(
        "x-", "HandTowelHolder", round(room.z_max - 1.2, 2), y=1.25, size=(0.17, 0.21, 0.05)
    )
    for object_type, size in (
        ("GarbageCan", (0.28, 0.4, 0.28)),
        ("Cart", (0.5, 0.75, 0.35)),
        ("LaundryHamper", (0.4, 0.6, 0.4)),
    ):
        if object_type == "GarbageCan" or plan.random.random() < 0.6:
            plan.try_against(object_type, plan.shuffle(["x-", "z-"]), size)
    plan.try_against("Plunger", ["z+", "x-"], (0.14, 0.5, 0.14))
    plan.try_against("ScrubBrush", ["z+", "x-"], (0.12, 0.45, 0.12))
    plan.try_against("Window", ["z-", "x-"], (0.8, 0.8, 0.06), y=1.35)
    plan.loose += plan.shuffle(_IN_BATHROOMS)[:16]


def _place_washstand(plan: RoomPlan, at: float) -> None:
    width = 1.5
    top = plan.place_against(
        "z+", "CounterTop", at, y=_TOP - 0.04, size=(width, 0.04, 0.55), gap=0.01
    )
    top.support = None
    sink = plan.place_against("z+", "Sink", at, y=_TOP - 0.15, size=(0.5, 0.152, 0.4), gap=0.08)
    basin = plan.place_against(
        "z+", "SinkBasin", at, y=_TOP - 0.149, size=(0.44, 0.144, 0.34), gap=0.1
    )
    _let_in(top, sink, basin)
    plan.place_against("z+", "Faucet", at, y=_TOP, size=(0.14, 0.2, 0.16), gap=0.03)
    plan.place_against("z+", "Mirror", at, y=1.2, size=(1.0, 0.8, 0.04))
    for column in (-1, 0, 1):
        cabinet = plan.place_against(
            "z+",
            "Cabinet",
            round(at + column * width / 3, 3),
            y=0.1,
            size=(width / 3 - 0.004, 0.705, 0.5),
            gap=0.01,
        )
        cabinet.hollow = column == 0  # the sink hangs in it
        cabinet.hinge = 1 if column > 0 else -1


# Of rugs, metres: width and length, and how far their middle lies from the room's towards z+.
_RUGS = {"kitchen": (1.7, 0.7, 0.55), "living-room": (2.4, 1.7, -0.2), "bedroom": (1.5, 1.1, -0.3),
         "bathroom": (1.1, 0.7, 0.1)}  # fmt: skip
# Of pictures, metres: so thin that they take no floor from the agent.
_PICTURES = ((0.9, 0.65, 0.02), (0.55, 0.75, 0.02), (0.6, 0.5, 0.02))
_PICTURE_Y = (1.45, 1.4, 1.5)
_WALL_EACH = 2.2  # metres of wall for each picture
_SPACING = np.array([0.3, 0.03, 0.3])  # around a picture, metres
_ENTRANCE = (0.96, 2.06, 0.5)  # of a door, and of the floor before it, metres


def decorate(plan: RoomPlan, room_type: str) -> None:
    """Hang pictures by the length of the walls, lay a rug, and give a room without doors one.

    All this is drawn from random numbers of its own: furniture stays where it is without it, and so
    do loose objects but those that would reach into a picture.
    """
    plan.random, furnishing = plan.random.spawn(1)[0], plan.random
    _lay_rug(plan, *_RUGS[room_type])
    if not plan.room.openings:
        _give_door(plan)
    for side in ("x-", "x+", "z-", "z+"):
        start, end = plan.span(side)
        for _ in range(int((end - start) / _WALL_EACH)):
            index = int(plan.random.integers(len(_PICTURES)))
            picture = plan.try_against(
                "Painting", [side], _PICTURES[index], _PICTURE_Y[index], _SPACING
            )
            if picture is not None:
                picture.style = int(plan.random.integers(1000))
    plan.random = furnishing


def _lay_rug(plan: RoomPlan, width: float, length: float, away: float) -> None:
    room = plan.room
    x = (room.x_min + room.x_max) / 2
    z = (room.z_min + room.z_max) / 2 + away
    rug = (x - width / 2, x + width / 2, z - length / 2, z + length / 2)
    plan.room = replace(room, rug=rug)


def _give_door(plan: RoomPlan) -> None:
    """Draw a door on a wall where nothing stands before it; a full room has none."""
    width, height, depth = _ENTRANCE
    for side in plan.shuffle(("z-", "x-", "x+")):
        for at in plan.places(side, width):
            before = plan.space_before(side, at - width / 2, at + width / 2, depth, (0.01, height))
            if plan.is_clear(*before):
                plan.reserved.append(before)
                plan.room = replace(plan.room, door=(side, at))
                return
