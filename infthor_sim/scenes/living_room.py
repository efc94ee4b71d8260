# ruff: noqa: SIM905 - tables of names read best as words
"""Procedural living rooms: sofa, low table, television, shelves and lamps along the walls."""

from infthor_sim.scenes.roomplan import RoomPlan

_ALONG_WALLS = (
    "ArmChair SideTable FloorLamp ShelvingUnit GarbageCan DiningTable Desk Ottoman".split()
)
_LOOSE = (
    "Book Book Box CellPhone CreditCard KeyChain Laptop Newspaper Pillow Pillow RemoteControl "
    "Statue"
    " TissueBox Vase Watch WateringCan Candle Plate Bowl Pencil Pen Mug CreditCard KeyChain Vase"
).split()


def furnish_living_room(plan: RoomPlan, loose: int = 24) -> None:
    """Furnish a room as a living room with up to `loose` small things."""
    room = plan.room
    middle = (room.x_min + room.x_max) / 2
    stand = plan.place_against("z+", "TVStand", round(middle, 2), size=(1.4, 0.5, 0.42), gap=0.02)
    place_drawers(plan, stand.object_id, "z+", middle, (1.4, 0.5, 0.42), 2)
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
                place_lamp(plan, item.center[0], item.center[2], float(item.bounds()[1][1]))
    plan.try_against("HousePlant", sides, (0.4, 0.9, 0.4))
    plan.try_against("Painting", ["z+", "x-", "x+"], (0.9, 0.7, 0.05), y=1.4)
    plan.try_against("Window", ["x+", "x-"], (1.3, 1.3, 0.06), y=0.95)
    plan.loose += plan.shuffle(_LOOSE)[:loose]


_SIZES = {"DiningTable": (1.1, 0.75, 0.8), "Desk": (1.2, 0.76, 0.6),
          "ShelvingUnit": (0.9, 1.5, 0.35),
          "SideTable": (0.5, 0.6, 0.4), "FloorLamp": (0.4, 1.6, 0.4)}  # fmt: skip


def place_lamp(plan: RoomPlan, x: float, z: float, y: float) -> None:
    """Put a desk lamp on a piece of furniture."""
    plan.place(
        "DeskLamp", round(float(x), 3), round(float(z), 3), 0.0, y=y, size=(0.22, 0.42, 0.22)
    )


def place_drawers(
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
