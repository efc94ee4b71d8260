# ruff: noqa: SIM905 - tables of names read best as words
"""What may be put where: AI2-THOR's rules of object types and receptacle types."""

from infthor_eval.sim.object_types import FOOD, object_type

__all__ = ["allowed_in"]

_CUTLERY = frozenset("ButterKnife Fork Knife Ladle Spatula Spoon".split())
_DISHES = frozenset("Bowl Cup Mug Pan Plate Pot".split())
_SMALL = frozenset(
    "CD Candle CellPhone Cloth CreditCard DishSponge Egg KeyChain Pen Pencil PepperShaker RemoteControl SaltShaker"
    " SoapBar Watch".split()
)
_BATHROOM = frozenset(
    "Candle Cloth DishSponge HandTowel SoapBar SoapBottle SprayBottle TissueBox ToiletPaper Towel".split()
)
_LOUNGE = frozenset(
    "AlarmClock BaseballBat BasketBall Book Box CD CellPhone Cloth CreditCard KeyChain Laptop Newspaper Pillow"
    " RemoteControl TeddyBear TennisRacket TissueBox Towel".split()
)
_SMALL_FOOD = FOOD - {"Bread", "Lettuce"}

_ONLY: dict[str, frozenset[str]] = {
    "CoffeeMachine": frozenset({"Mug"}),
    "Toaster": frozenset({"BreadSliced"}),
    "StoveBurner": frozenset({"Kettle", "Pan", "Pot"}),
    "ToiletPaperHanger": frozenset({"ToiletPaper"}),
    "TowelHolder": frozenset({"Towel"}),
    "HandTowelHolder": frozenset({"HandTowel"}),
    "LaundryHamper": frozenset({"Cloth", "HandTowel", "Towel"}),
    "Microwave": FOOD | frozenset("Bowl ButterKnife Cup Knife Mug Plate".split()),
    "Fridge": FOOD | _DISHES | frozenset("Bottle ButterKnife Knife WineBottle".split()),
    "SinkBasin": FOOD | _DISHES | _CUTLERY | frozenset(
        "Bottle Cloth DishSponge HandTowel Kettle SoapBar SoapBottle WineBottle".split()
    ),
    "BathtubBasin": frozenset("Cloth DishSponge HandTowel SoapBar SoapBottle Towel".split()),
    "Toilet": _BATHROOM,
    "Mug": _CUTLERY | {"Pen", "Pencil"},
    "Cup": _CUTLERY | {"Pen", "Pencil"},
    "Bowl": FOOD | _CUTLERY | _SMALL,
    "Plate": FOOD | _CUTLERY | _SMALL | {"TissueBox", "Mug", "Cup"},
    "Pan": _SMALL_FOOD | _CUTLERY | _SMALL | {"Lettuce"},
    "Pot": _SMALL_FOOD | _CUTLERY | _SMALL | {"Lettuce"},
    "ArmChair": _LOUNGE,
    "Bed": _LOUNGE,
    "Chair": _LOUNGE,
    "DogBed": _LOUNGE,
    "Footstool": _LOUNGE,
    "Ottoman": _LOUNGE,
    "Sofa": _LOUNGE,
    "Stool": _LOUNGE,
    "Box": _SMALL | frozenset("AlarmClock Book Bowl Cup Mug Newspaper Statue Vase".split()),
    "Safe": _SMALL | frozenset("Statue Vase Book".split()),
    "Floor": frozenset(),
    "Bathtub": frozenset(),
}  # fmt: skip
_ONLY["Sink"] = _ONLY["SinkBasin"]
_TOO_BIG_TO_STORE = frozenset("BaseballBat BasketBall Box Laptop Pillow TeddyBear TennisRacket".split())
_CLOSED_STORES = frozenset({"Cabinet", "Drawer", "GarbageCan"})


def allowed_in(item: str, receptacle: str) -> bool:
    """Whether AI2-THOR lets an object of type `item` be put into or onto a receptacle of type `receptacle`."""
    only = _ONLY.get(receptacle)
    if only is not None:
        return item in only
    if receptacle in _CLOSED_STORES and item in _TOO_BIG_TO_STORE:
        return False
    return object_type(receptacle).receptacle and object_type(item).pickupable
