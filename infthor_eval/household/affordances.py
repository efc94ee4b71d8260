"""Which objects people put where, and what can be done to them: what makes a task sensible.

Narrower than what AI2-THOR allows: it would take a statue into the sink basin. Types are AI2-THOR's.
"""

__all__ = [
    "CLEANABLE",
    "COOLABLE",
    "HEATABLE",
    "KNIVES",
    "LIGHTS",
    "MOVABLE_RECEPTACLES",
    "SLICEABLE",
    "base_type",
    "goes_into",
    "preposition",
]

SLICEABLE = frozenset({"Apple", "Bread", "Lettuce", "Potato", "Tomato"})
KNIVES = frozenset({"ButterKnife", "Knife"})
LIGHTS = frozenset({"DeskLamp", "FloorLamp"})
MOVABLE_RECEPTACLES = frozenset({"Bowl", "Box", "Cup", "Mug", "Pan", "Plate", "Pot"})

_FOOD = SLICEABLE | {"Egg"}
_CUTLERY = frozenset({"ButterKnife", "Fork", "Knife", "Ladle", "Spatula", "Spoon"})
_DISHES = frozenset({"Bowl", "Cup", "Mug", "Pan", "Plate", "Pot"})
_BOTTLES = frozenset({"Bottle", "WineBottle"})
_SPICES = frozenset({"PepperShaker", "SaltShaker"})
_DESK = frozenset(
    {
        "AlarmClock",
        "Book",
        "Box",
        "Candle",
        "CD",
        "CellPhone",
        "CreditCard",
        "KeyChain",
        "Laptop",
        "Newspaper",
        "Pen",
        "Pencil",
        "RemoteControl",
        "Statue",
        "TissueBox",
        "Vase",
        "Watch",
        "WateringCan",
    }
)
_LOUNGE = frozenset(
    {"BaseballBat", "BasketBall", "Book", "Box", "CellPhone", "Laptop", "Newspaper", "Pillow", "RemoteControl"}
    | {"TeddyBear", "TennisRacket"}
)
_BATH = frozenset({"Candle", "Cloth", "DishSponge", "SoapBar", "SoapBottle", "SprayBottle", "TissueBox", "ToiletPaper"})
_SMALL = frozenset({"CD", "CellPhone", "CreditCard", "KeyChain", "Pen", "Pencil", "RemoteControl", "Watch"})
_KITCHEN = _FOOD | _CUTLERY | _DISHES | _BOTTLES | _SPICES | {"DishSponge", "Kettle", "SoapBottle", "PaperTowelRoll"}
_SURFACE = _KITCHEN | _DESK | _BATH

_GOES: dict[str, frozenset[str]] = {
    "ArmChair": _LOUNGE,
    "BathtubBasin": frozenset({"Cloth", "DishSponge", "SoapBar"}),
    "Bed": _LOUNGE,
    "Bowl": _FOOD | {"Fork", "Spoon"} | _SMALL,
    "Box": _SMALL | {"AlarmClock", "Book", "Candle", "Statue"},
    "Cabinet": _DISHES | _BOTTLES | _SPICES | _BATH,
    "Cart": _BATH,
    "CoffeeMachine": frozenset({"Mug"}),
    "CoffeeTable": _DESK | _DISHES,
    "CounterTop": _KITCHEN | _BATH,
    "Cup": frozenset({"Fork", "Pen", "Pencil", "Spoon"}),
    "Desk": _DESK | {"Mug"},
    "DiningTable": _SURFACE,
    "Drawer": _CUTLERY | _SMALL | _BATH | {"Book"},
    "Dresser": _DESK,
    "Fridge": _FOOD | _BOTTLES | {"Bowl", "Cup", "Mug", "Pan", "Plate", "Pot"},
    "GarbageCan": _FOOD | {"CreditCard", "Newspaper", "Pen", "Pencil", "PaperTowelRoll", "TissueBox", "ToiletPaper"},
    "Microwave": (_FOOD - {"Bread", "Lettuce"}) | {"Cup", "Mug", "Plate"},
    "Mug": frozenset({"Fork", "Pen", "Pencil", "Spoon"}),
    "Ottoman": _LOUNGE,
    "Pan": _FOOD - {"Bread"} | {"Spatula"},
    "Plate": _FOOD | {"Fork", "Spoon", "Knife", "ButterKnife"},
    "Pot": _FOOD - {"Bread"} | {"Ladle", "Spoon"},
    "Safe": _SMALL,
    "Shelf": _DESK | _DISHES | _BATH | _SPICES | _BOTTLES,
    "SideTable": _DESK | _DISHES | _BATH | _FOOD,
    "SinkBasin": _DISHES | _CUTLERY | _FOOD | {"Cloth", "DishSponge", "SoapBar"},
    "Sofa": _LOUNGE,
    "StoveBurner": frozenset({"Kettle", "Pan", "Pot"}),
    "TVStand": _DESK,
    "Toilet": frozenset({"Candle", "SoapBar", "SoapBottle", "SprayBottle", "TissueBox", "ToiletPaper"}),
}

CLEANABLE = _DISHES | _CUTLERY | (_FOOD - {"Bread", "Egg"}) | {"Cloth", "DishSponge", "Kettle", "SoapBar"}
HEATABLE = _GOES["Microwave"]
COOLABLE = _GOES["Fridge"] - {"Bottle"}

_INSIDE = frozenset(
    {"BathtubBasin", "Bowl", "Box", "Cabinet", "Cup", "Drawer", "Fridge", "GarbageCan", "LaundryHamper"}
    | {"Microwave", "Mug", "Pan", "Pot", "Safe", "Sink", "SinkBasin"}
)


def base_type(object_type: str) -> str:
    """The type of the whole of which an object may be a slice ("AppleSliced" to "Apple")."""
    return object_type.removesuffix("Sliced")


def goes_into(item: str, receptacle: str) -> bool:
    """Whether it is sensible to put an object of type `item` into or onto a receptacle of type
    `receptacle`."""
    return base_type(item) in _GOES.get(receptacle, frozenset())


def preposition(receptacle: str) -> str:
    """ "in" or "on", as fits the receptacle type."""
    return "in" if receptacle in _INSIDE else "on"
