"""Kinds of rooms, which logs of simulators have no common name for, and what is in them."""

from collections.abc import Set

# In AI2-THOR's rooms and in ours each of these stands in one kind of room alone.
_MARKS = {
    "Kitchen": {"Fridge", "StoveBurner"},
    "Bedroom": {"Bed"},
    "Bathroom": {"Toilet"},
    "LivingRoom": {"Sofa"},
}
# Types in the rooms of each kind in AI2-THOR.
COMMON_TYPES = {
    "Kitchen": frozenset({
        "Apple", "Book", "Bottle", "Bowl", "Bread", "Cabinet", "CellPhone", "Chair",
        "CoffeeMachine", "CounterTop", "CreditCard", "Cup", "DiningTable", "DishSponge", "Drawer",
        "Egg", "Fork", "Fridge", "GarbageCan", "HousePlant", "Kettle", "Knife", "Ladle", "Lettuce",
        "Microwave", "Mug", "Pan", "Pencil", "PepperShaker", "Plate", "Pot", "Potato",
        "SaltShaker", "SideTable", "Sink", "SoapBottle", "Spatula", "Statue", "Toaster", "Tomato",
        "Vase", "WineBottle",
    }),
    "LivingRoom": frozenset({
        "ArmChair", "Book", "Boots", "Bowl", "Box", "Candle", "CellPhone", "Chair", "CoffeeTable",
        "CreditCard", "Desk", "DeskLamp", "DiningTable", "DogBed", "Drawer", "Dresser",
        "FloorLamp", "GarbageCan", "HousePlant", "KeyChain", "Laptop", "Newspaper", "Ottoman",
        "Painting", "Pencil", "Pillow", "Plate", "RemoteControl", "Safe", "SideTable", "Sofa",
        "Statue", "Television", "TissueBox", "TVStand", "Vase", "Watch", "WateringCan",
    }),
    "Bedroom": frozenset({
        "AlarmClock", "ArmChair", "BaseballBat", "BasketBall", "Bed", "Book", "Boots", "Bowl",
        "Box", "CD", "CellPhone", "Chair", "Cloth", "CreditCard", "Desk", "DeskLamp", "Drawer",
        "Dresser", "Dumbbell", "FloorLamp", "GarbageCan", "HousePlant", "KeyChain", "Laptop",
        "Mirror", "Mug", "Painting", "Pencil", "Pillow", "RemoteControl", "Safe", "SideTable",
        "Sofa", "Statue", "TeddyBear", "Television", "TennisRacket", "TissueBox", "VacuumCleaner",
        "Vase", "Watch",
    }),
    "Bathroom": frozenset({
        "Cabinet", "Candle", "Cloth", "CounterTop", "DishSponge", "Drawer", "GarbageCan",
        "HousePlant", "Mirror", "Painting", "Plunger", "SideTable", "Sink", "SoapBar",
        "SoapBottle", "SprayBottle", "TissueBox", "Toilet", "ToiletPaper", "Towel",
    }),
}  # fmt: skip


def rooms_of(types: Set[str]) -> str:
    """Return the kinds of a scene's rooms by the types in it ("Kitchen"; a house's with commas).

    A room without any mark is a living room. A bedroom with a sofa is a bedroom.
    """
    rooms = [room for room, marks in _MARKS.items() if marks & types]
    if rooms == ["Bedroom", "LivingRoom"]:
        rooms = ["Bedroom"]
    return ", ".join(rooms) or "LivingRoom"
