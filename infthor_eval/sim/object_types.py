# ruff: noqa: SIM905 - tables of names read best as words
"""What each AI2-THOR object type can do: the properties the documentation of AI2-THOR lists by type.

Scenes read from recordings bring the flags of their own objects; this table serves procedural scenes, types that a
recording names without describing, and rules that depend on the type (what may be put where, what heats).
"""

from dataclasses import dataclass
from functools import cache

__all__ = ["FOOD", "TYPES", "ObjectType", "object_type"]


@dataclass(frozen=True)
class ObjectType:
    """Capabilities of one object type; the names are those of AI2-THOR's metadata."""

    name: str
    pickupable: bool
    moveable: bool
    receptacle: bool
    openable: bool
    toggleable: bool
    breakable: bool
    fillable: bool
    dirtyable: bool
    usable_up: bool
    cookable: bool
    sliceable: bool
    heat_source: bool
    cold_source: bool
    encloses: bool
    mass: float
    materials: tuple[str, ...]


FOOD = frozenset(
    "Apple AppleSliced Bread BreadSliced Egg EggCracked Lettuce LettuceSliced Potato PotatoSliced Tomato"
    " TomatoSliced".split()
)

_PICKUPABLE = FOOD | frozenset(
    "AlarmClock AluminumFoil BaseballBat BasketBall Book Boots Bottle Bowl Box ButterKnife CD Candle CellPhone Cloth"
    " CreditCard Cup DishSponge Dumbbell Footstool Fork HandTowel Kettle KeyChain Knife Ladle Laptop Mug Newspaper Pan"
    " PaperTowelRoll Pen Pencil PepperShaker Pillow Plate Plunger Pot RemoteControl SaltShaker ScrubBrush SoapBar"
    " SoapBottle Spatula Spoon SprayBottle Statue TableTopDecor TeddyBear TennisRacket TissueBox ToiletPaper Towel"
    " Vase Watch WateringCan WineBottle".split()
)
_MOVEABLE = frozenset(
    "ArmChair Bed Cart Chair CoffeeMachine CoffeeTable DeskLamp Desk Desktop DiningTable DogBed Dresser FloorLamp"
    " GarbageBag GarbageCan HousePlant LaundryHamper Microwave Ottoman RoomDecor Safe ShelvingUnit SideTable Sofa Stool"
    " TVStand Television Toaster VacuumCleaner".split()
)
_RECEPTACLE = frozenset(
    "ArmChair Bathtub BathtubBasin Bed Bowl Box Cabinet Cart Chair CoffeeMachine CoffeeTable CounterTop Cup Desk"
    " DiningTable DogBed Drawer Dresser Floor Footstool Fridge GarbageCan HandTowelHolder LaundryHamper Microwave Mug"
    " Ottoman Pan Plate Pot Safe Shelf SideTable Sink SinkBasin Sofa Stool StoveBurner TVStand Toaster Toilet"
    " ToiletPaperHanger TowelHolder".split()
)
_OPENABLE = frozenset(
    "Blinds Book Box Cabinet Drawer Fridge Kettle Laptop LaundryHamper Microwave Safe ShowerCurtain ShowerDoor"
    " Toilet".split()
)
_ENCLOSING = frozenset("Box Cabinet Drawer Fridge LaundryHamper Microwave Safe".split())
_TOGGLEABLE = frozenset(
    "Candle CellPhone CoffeeMachine DeskLamp Desktop Faucet FloorLamp Laptop LightSwitch Microwave ShowerHead"
    " StoveBurner StoveKnob Television Toaster".split()
)
_BREAKABLE = frozenset(
    "Bottle Bowl CellPhone Cup Desktop Egg Laptop Mirror Mug Plate ShowerDoor ShowerGlass Statue Television Vase Window"
    " WineBottle".split()
)
_FILLABLE = frozenset("Bottle Bowl Cup HousePlant Kettle Mug Pot WateringCan WineBottle".split())
_DIRTYABLE = frozenset("Bed Bowl Cloth Cup Mirror Mug Pan Plate Pot".split())
_USABLE_UP = frozenset("PaperTowelRoll SoapBottle TissueBox ToiletPaper".split())
_COOKABLE = frozenset("BreadSliced EggCracked Potato PotatoSliced".split())
_SLICEABLE = frozenset("Apple Bread Egg Lettuce Potato Tomato".split())
_HEAT = frozenset("CoffeeMachine Microwave StoveBurner Toaster".split())
_OTHER = frozenset(
    "Blinds Curtains Faucet Floor HousePlant LightSwitch Mirror Painting Poster ShowerCurtain ShowerDoor ShowerGlass"
    " ShowerHead StoveKnob Window DoorFrame Doorway".split()
)
_MASS = {
    "Apple": 0.2, "Bread": 0.7, "Lettuce": 0.64, "Potato": 0.18, "Tomato": 0.12, "Egg": 0.01, "Mug": 1.0, "Cup": 0.2,
    "Bowl": 0.47, "Plate": 0.62, "Pot": 0.7, "Pan": 0.7, "Knife": 0.3, "ButterKnife": 0.11, "Fork": 0.06,
    "Spoon": 0.06, "Book": 0.5, "Laptop": 1.8, "Box": 1.0, "Pillow": 1.0, "TeddyBear": 0.3, "CellPhone": 0.18,
    "Microwave": 5.0, "Toaster": 5.0, "CoffeeMachine": 2.0, "GarbageCan": 1.5, "Chair": 10.0, "DiningTable": 20.0,
    "Sofa": 100.0, "Bed": 100.0, "Dresser": 30.0, "Desk": 30.0, "SideTable": 10.0, "CoffeeTable": 14.0,
}  # fmt: skip
_MATERIALS = {
    "Food": FOOD,
    "Metal": frozenset("ButterKnife Fork Knife Ladle Pan Pot Spoon Fridge Microwave Toaster Kettle KeyChain".split()),
    "Ceramic": frozenset("Bowl Mug Plate Statue Vase Toilet Sink SinkBasin".split()),
    "Fabric": frozenset("ArmChair Bed Cloth HandTowel Pillow Sofa TeddyBear Towel Curtains".split()),
    "Wood": frozenset("Cabinet Chair CoffeeTable Desk DiningTable Drawer Dresser Shelf SideTable TVStand".split()),
    "Glass": frozenset("Bottle Cup Window WineBottle Mirror".split()),
    "Paper": frozenset("Book Box Newspaper PaperTowelRoll TissueBox ToiletPaper".split()),
    "Plastic": frozenset("CellPhone Laptop RemoteControl SoapBottle SprayBottle GarbageCan Television".split()),
}

TYPES = _PICKUPABLE | _MOVEABLE | _RECEPTACLE | _OPENABLE | _TOGGLEABLE | _OTHER


@cache
def object_type(name: str) -> ObjectType:
    """Properties of a type; a name that the table lacks is an inert object."""
    return ObjectType(
        name=name,
        pickupable=name in _PICKUPABLE,
        moveable=name in _MOVEABLE,
        receptacle=name in _RECEPTACLE,
        openable=name in _OPENABLE,
        toggleable=name in _TOGGLEABLE,
        breakable=name in _BREAKABLE,
        fillable=name in _FILLABLE,
        dirtyable=name in _DIRTYABLE,
        usable_up=name in _USABLE_UP,
        cookable=name in _COOKABLE,
        sliceable=name in _SLICEABLE,
        heat_source=name in _HEAT,
        cold_source=name == "Fridge",
        encloses=name in _ENCLOSING,
        mass=_MASS.get(name, 0.5 if name in _PICKUPABLE else 0.0),
        materials=tuple(material for material, names in _MATERIALS.items() if name in names),
    )
