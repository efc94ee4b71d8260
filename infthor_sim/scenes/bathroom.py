# ruff: noqa: SIM905 - tables of names read best as words
"""Procedural bathrooms: a washstand, a toilet, a tub, towel rails and small things."""

from infthor_sim.scenes.roomplan import RoomPlan, name_after, rim_pieces

_LOOSE = (
    "Candle Candle Cloth Cloth DishSponge SoapBar SoapBar SoapBottle SoapBottle SprayBottle "
    "SprayBottle TissueBox"
    " ToiletPaper ToiletPaper HandTowel Towel"
).split()
_TOP = 0.85  # of the washstand, metres


def furnish_bathroom(plan: RoomPlan, loose: int = 16) -> None:
    """Furnish a room as a bathroom with up to `loose` small things."""
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
    plan.loose += plan.shuffle(_LOOSE)[:loose]


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
    name_after(sink, basin)
    top.pieces, sink.pieces = rim_pieces(top, sink), rim_pieces(sink, basin)
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
