# ruff: noqa: SIM905 - tables of names read best as words
"""Usual sizes of object types, and how high things stand on them: medians over the rooms of AI2-THOR.

Serves procedural scenes, houses whose assets are unknown, and objects that a recording names without describing.
"""

import numpy as np

from infthor_eval.sim.geometry import Array, object_id
from infthor_eval.sim.object_types import object_type
from infthor_eval.sim.objects import SimObject

__all__ = ["SIZES", "default_object", "style_of", "support_height"]

# width, height, depth in metres, front towards z
SIZES: dict[str, tuple[float, float, float]] = {
    "AlarmClock": (0.19, 0.18, 0.10), "AluminumFoil": (0.24, 0.04, 0.06), "Apple": (0.12, 0.12, 0.12),
    "AppleSliced": (0.03, 0.11, 0.11), "ArmChair": (0.86, 0.91, 0.84), "BaseballBat": (0.10, 0.10, 0.85),
    "BasketBall": (0.24, 0.24, 0.24), "Bathtub": (1.35, 0.60, 1.78), "BathtubBasin": (1.20, 0.42, 1.02),
    "Bed": (1.40, 0.92, 2.34), "Blinds": (1.01, 0.20, 0.03), "Book": (0.22, 0.03, 0.30),
    "Boots": (0.28, 0.52, 0.23), "Bottle": (0.11, 0.25, 0.11), "Bowl": (0.19, 0.09, 0.19),
    "Box": (0.43, 0.29, 0.43), "Bread": (0.16, 0.14, 0.30), "BreadSliced": (0.03, 0.14, 0.14),
    "ButterKnife": (0.02, 0.01, 0.27), "CD": (0.10, 0.005, 0.10), "Cabinet": (0.37, 0.66, 0.40),
    "Candle": (0.05, 0.13, 0.05), "Cart": (0.60, 0.80, 0.40), "CellPhone": (0.08, 0.01, 0.16),
    "Chair": (0.47, 0.95, 0.54), "Cloth": (0.21, 0.02, 0.18), "CoffeeMachine": (0.44, 0.44, 0.44),
    "CoffeeTable": (1.14, 0.44, 0.70), "CounterTop": (0.95, 0.02, 1.35), "CreditCard": (0.09, 0.005, 0.05),
    "Cup": (0.11, 0.14, 0.11), "Curtains": (0.96, 2.17, 0.19), "Desk": (1.60, 0.80, 0.66),
    "DeskLamp": (0.28, 0.44, 0.29), "Desktop": (0.88, 0.58, 0.27), "DiningTable": (1.45, 0.78, 0.92),
    "DishSponge": (0.07, 0.03, 0.14), "DogBed": (0.99, 0.18, 0.83), "Doorway": (1.00, 2.10, 0.15),
    "Drawer": (0.49, 0.19, 0.38), "Dresser": (1.52, 0.97, 0.53), "Dumbbell": (0.13, 0.13, 0.33),
    "Egg": (0.07, 0.07, 0.07), "EggCracked": (0.09, 0.03, 0.09), "Faucet": (0.27, 0.21, 0.24),
    "Floor": (4.98, 0.44, 5.09), "FloorLamp": (0.52, 1.88, 0.51), "Footstool": (0.28, 0.31, 0.28),
    "Fork": (0.03, 0.02, 0.25), "Fridge": (1.00, 1.86, 0.72), "GarbageBag": (0.51, 0.56, 0.52),
    "GarbageCan": (0.42, 0.55, 0.35), "HandTowel": (0.13, 0.40, 0.04),
    "HandTowelHolder": (0.17, 0.21, 0.05), "HousePlant": (0.34, 0.65, 0.36), "Kettle": (0.20, 0.19, 0.21),
    "KeyChain": (0.13, 0.01, 0.07), "Knife": (0.05, 0.01, 0.33), "Ladle": (0.09, 0.12, 0.27),
    "Laptop": (0.40, 0.30, 0.30), "LaundryHamper": (0.66, 0.88, 0.51), "Lettuce": (0.18, 0.21, 0.25),
    "LettuceSliced": (0.04, 0.18, 0.18), "LightSwitch": (0.12, 0.15, 0.02), "Microwave": (0.61, 0.35, 0.36),
    "Mirror": (0.54, 0.85, 0.07), "Mug": (0.11, 0.10, 0.09), "Newspaper": (0.33, 0.03, 0.13),
    "Ottoman": (0.85, 0.43, 0.52), "Painting": (0.88, 0.81, 0.09), "Pan": (0.28, 0.05, 0.43),
    "PaperTowelRoll": (0.08, 0.21, 0.07), "Pen": (0.01, 0.01, 0.20), "Pencil": (0.01, 0.01, 0.18),
    "PepperShaker": (0.07, 0.11, 0.07), "Pillow": (0.42, 0.14, 0.34), "Plate": (0.24, 0.02, 0.24),
    "Plunger": (0.15, 0.54, 0.15), "Poster": (0.62, 0.71, 0.09), "Pot": (0.29, 0.16, 0.31),
    "Potato": (0.08, 0.08, 0.12), "PotatoSliced": (0.02, 0.07, 0.08), "RemoteControl": (0.07, 0.02, 0.22),
    "RoomDecor": (0.33, 1.45, 0.40), "Safe": (0.50, 0.51, 0.56), "SaltShaker": (0.07, 0.11, 0.07),
    "ScrubBrush": (0.13, 0.48, 0.13), "Shelf": (0.51, 0.23, 0.29), "ShelvingUnit": (0.94, 1.48, 0.38),
    "ShowerCurtain": (0.43, 1.94, 0.37), "ShowerDoor": (0.07, 1.96, 0.82),
    "ShowerGlass": (1.16, 1.92, 1.30), "ShowerHead": (0.20, 1.41, 0.25), "SideTable": (0.62, 0.67, 0.37),
    "Sink": (0.66, 0.16, 0.50), "SinkBasin": (0.53, 0.13, 0.35), "SoapBar": (0.05, 0.02, 0.09),
    "SoapBottle": (0.12, 0.24, 0.10), "Sofa": (2.47, 0.94, 0.93), "Spatula": (0.06, 0.02, 0.30),
    "Spoon": (0.04, 0.02, 0.21), "SprayBottle": (0.03, 0.25, 0.11), "Statue": (0.21, 0.34, 0.15),
    "Stool": (0.36, 0.76, 0.31), "StoveBurner": (0.22, 0.02, 0.22), "StoveKnob": (0.07, 0.08, 0.07),
    "TVStand": (1.20, 0.73, 0.60), "TableTopDecor": (0.40, 0.14, 0.31), "TeddyBear": (0.53, 0.57, 0.40),
    "Television": (1.13, 0.81, 0.31), "TennisRacket": (0.26, 0.04, 0.68), "TissueBox": (0.20, 0.15, 0.10),
    "Toaster": (0.22, 0.21, 0.36), "Toilet": (0.53, 1.04, 0.97), "ToiletPaper": (0.10, 0.12, 0.08),
    "ToiletPaperHanger": (0.23, 0.08, 0.10), "Tomato": (0.12, 0.10, 0.13),
    "TomatoSliced": (0.02, 0.10, 0.11), "Towel": (0.41, 0.59, 0.04), "TowelHolder": (0.66, 0.04, 0.11),
    "VacuumCleaner": (0.36, 1.01, 0.31), "Vase": (0.18, 0.24, 0.18), "Watch": (0.08, 0.04, 0.05),
    "WateringCan": (0.15, 0.19, 0.27), "Window": (1.04, 1.55, 0.11), "WineBottle": (0.09, 0.33, 0.09),
}  # fmt: skip
_DEFAULT = (0.3, 0.3, 0.3)
_SUPPORT = {
    "ArmChair": 0.48, "Bed": 0.6, "Chair": 0.5, "CoffeeMachine": 0.13, "HandTowelHolder": -1.59, "Shelf": 0.0,
    "Sofa": 0.47, "Stool": 1.0, "ToiletPaperHanger": -0.35, "TowelHolder": -13.0, "Toaster": 0.85, "Cabinet": 0.01,
    "SinkBasin": 0.01, "BathtubBasin": 0.01,
}  # fmt: skip
_CENTERED = frozenset(
    "Apple BasketBall Blinds Bread Cabinet Drawer Egg Lettuce LightSwitch Mirror Painting Potato Poster Tomato"
    " Window".split()
)


def support_height(kind: str, height: float) -> float | None:
    """Height in metres above the underside of a box `height` metres high at which things stand; None: its top."""
    if kind == "CounterTop":
        return 0.0 if height < 0.1 else None
    share = _SUPPORT.get(kind)
    return None if share is None else share * height


def style_of(name: str) -> int:
    """A number that is always the same for the same name; it varies colours."""
    return sum(ord(letter) * (index + 1) for index, letter in enumerate(name))


def default_object(kind: str, position: Array, yaw: float = 0.0, size: Array | None = None) -> SimObject:
    """An object of the usual size; its origin is in its middle for fruit and wall things, else in its underside."""
    box = np.array(SIZES.get(kind, _DEFAULT)) if size is None else np.asarray(size, dtype=float)
    found = object_id(kind, position)
    return SimObject(
        object_id=found,
        name=f"{kind}_{style_of(found):08x}",
        kind=object_type(kind),
        position=np.asarray(position, dtype=float).copy(),
        rotation=np.array([0.0, yaw % 360.0, 0.0]),
        box_center=np.zeros(3) if kind in _CENTERED else np.array([0.0, box[1] / 2, 0.0]),
        box_size=box,
        support=support_height(kind, float(box[1])),
        style=style_of(found),
    )
