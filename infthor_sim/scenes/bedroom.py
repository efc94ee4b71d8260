# ruff: noqa: SIM905 - tables of names read best as words
"""Procedural bedrooms: a bed, a dresser, a desk with a chair, and small things."""

from infthor_sim.scenes.living_room import place_drawers, place_lamp
from infthor_sim.scenes.roomplan import RoomPlan

_LOOSE = (
    "AlarmClock AlarmClock BaseballBat BasketBall Book Book Bowl CD CD CellPhone CreditCard "
    "CreditCard KeyChain Laptop"
    " Mug Pen Pencil Pillow Pillow TeddyBear TennisRacket TissueBox Cloth Box"
).split()


def furnish_bedroom(plan: RoomPlan, loose: int = 22) -> None:
    """Furnish a room as a bedroom with up to `loose` small things."""
    room = plan.room
    at = round(room.x_min + 1.75, 2)
    plan.place_against("z+", "Bed", at, size=(1.5, 0.95, 2.0), gap=0.02)
    for side in (-1, 1):
        stand = plan.place_against(
            "z+", "SideTable", round(at + side * 1.05, 2), size=(0.45, 0.55, 0.4), gap=0.03
        )
        if side > 0:
            place_lamp(plan, stand.center[0], stand.center[2], float(stand.bounds()[1][1]))
    plan.place_against(
        "z+", "Window", round(room.x_max - 0.9, 2), y=1.0, size=(1.0, 1.2, 0.06), gap=-0.02
    )
    where = round((room.z_min + room.z_max) / 2 + 0.2, 2)
    size = (1.2, 0.95, 0.5)
    dresser = plan.place_against("x+", "Dresser", where, size=size, gap=0.02)
    place_drawers(plan, dresser.object_id, "x+", where, size, 3)
    desk_at = round(room.x_max - 1.2, 2)
    desk = plan.place_against("z-", "Desk", desk_at, size=(1.3, 0.76, 0.6), gap=0.02)
    place_lamp(plan, desk.center[0] + 0.5, desk.center[2], 0.76)
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
    plan.loose += plan.shuffle(_LOOSE)[:loose]
