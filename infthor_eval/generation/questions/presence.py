"""Object presence: "Is there any mug in this room?", "Have you seen a mug?"

A yes-question carries the frame of the first sighting. A no-question names a type that nowhere exists in the
trajectory's scene and is not easily taken for one that does: one that other trajectories of the set have, so that its
name does not give the answer away, and where there are few of these, another of AI2-THOR's. No frame proves an absence,
so it carries a sampled frame instead of evidence: one, as a yes-question has one, because else the number of frames
would give the answer away.

In a house of several rooms nobody could say which one "this room" is, and only the second form is asked.
"""

import random
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.household.wording import noun, with_article

__all__ = ["QUESTION_TYPE", "absent_types", "present_types"]

QUESTION_TYPE = "object_presence"
_FEW = 8  # types of other trajectories below which AI2-THOR's join them
_BUSY = 3  # objects that a sampled frame shows at least, where the trajectory has such frames

# Not asked about: surroundings, parts, and what people would not call by that name.
_UNASKED = frozenset(
    {"Floor", "Wall", "Ceiling", "Window", "Door", "Doorway", "DoorFrame", "StoveBurner", "StoveKnob", "LightSwitch"}
    | {"Faucet", "ShowerHead", "ShowerGlass", "ShowerDoor", "Undefined", "Shelf", "ShelvingUnit", "Stool", "Curtains"}
    | {"Blinds", "ToiletPaperHanger", "TowelHolder", "HandTowelHolder", "TargetCircle", "Cart", "Desktop", "RoomDecor"}
)
_COMMON = frozenset(
    {"AlarmClock", "Apple", "ArmChair", "BaseballBat", "BasketBall", "Bed", "Book", "Boots", "Bottle", "Bowl", "Box"}
    | {"Bread", "Cabinet", "Candle", "CellPhone", "Chair", "Cloth", "CoffeeMachine", "CoffeeTable", "CounterTop", "CD"}
    | {"CreditCard", "Cup", "Desk", "DeskLamp", "DiningTable", "DishSponge", "DogBed", "Drawer", "Dresser", "Dumbbell"}
    | {"Egg", "FloorLamp", "Fork", "Fridge", "GarbageCan", "HousePlant", "Kettle", "KeyChain", "Knife", "Ladle"}
    | {"Laptop", "Lettuce", "Microwave", "Mirror", "Mug", "Newspaper", "Ottoman", "Painting", "Pan", "Pencil"}
    | {"PepperShaker", "Pillow", "Plate", "Plunger", "Pot", "Potato", "RemoteControl", "Safe", "SideTable", "Sink"}
    | {"SoapBar", "SoapBottle", "Sofa", "Spatula", "SprayBottle", "Statue", "TeddyBear", "Television", "TennisRacket"}
    | {"TissueBox", "Toaster", "Toilet", "ToiletPaper", "Tomato", "Towel", "TVStand", "VacuumCleaner", "Vase", "Watch"}
    | {"WateringCan", "WineBottle"}
)
_TAKEN_FOR_EACH_OTHER = (
    {"Cup", "Mug", "Bowl", "Vase"},
    {"Pen", "Pencil"},
    {"Knife", "ButterKnife", "Fork", "Spoon", "Spatula", "Ladle"},
    {"Bottle", "WineBottle", "SoapBottle", "SprayBottle", "Vase"},
    {"Sofa", "ArmChair", "Ottoman", "Chair", "Footstool"},
    {"Desk", "DiningTable", "CoffeeTable", "SideTable", "CounterTop", "TVStand"},
    {"Drawer", "Dresser", "Cabinet", "Safe"},
    {"Towel", "HandTowel", "Cloth"},
    {"Pot", "Pan", "Kettle"},
    {"DeskLamp", "FloorLamp"},
    {"Apple", "Tomato", "Potato", "Egg"},
    {"SaltShaker", "PepperShaker"},
    {"Television", "Laptop"},
    {"Book", "Newspaper", "Painting", "Poster", "Box"},
    {"CellPhone", "RemoteControl", "CreditCard"},
    {"ToiletPaper", "PaperTowelRoll", "TissueBox"},
    {"SoapBar", "DishSponge"},
    {"Plunger", "ScrubBrush"},
    {"BasketBall", "Apple"},
)


def present_types(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yes-questions, each with the first frame that shows such an object."""
    first: dict[str, int] = {}
    for frame in range(len(history)):
        world = history.world(frame)
        for key in history.seen(frame):
            if key in world and history.shows(frame, key):
                first.setdefault(world[key].type, frame)
    for object_type, frame in sorted(first.items()):
        if _asked(object_type):
            yield from _asking(history, object_type, frame, "yes")


def absent_types(history: TrajectoryHistory, vocabulary: frozenset[str], rng: random.Random) -> Iterator[Candidate]:
    """No-questions on types that the scene does not have.

    Args:
        history: the trajectory.
        vocabulary: types of the whole set.
        rng: samples the frames.
    """
    frames = [frame for frame in range(len(history)) if _shown(history, frame) >= _BUSY] or [0]
    types = _missing(history, vocabulary)
    if len(types) < _FEW:
        types |= _missing(history, _COMMON)
    for object_type in sorted(types):
        frame = rng.choice(frames)
        yield from _asking(history, object_type, frame, "no")


def _asking(history: TrajectoryHistory, object_type: str, frame: int, answer: str) -> Iterator[Candidate]:
    """The forms that suit the scene."""
    words = noun(object_type)
    of_a_room = () if history.has_rooms else (("Is there any {} in this room?", words),)
    for form, name in (*of_a_room, ("Have you seen {}?", with_article(words))):
        yield Candidate(QUESTION_TYPE, form, (name,), (frame,), (answer,), (object_type,), absence=answer == "no")


def _missing(history: TrajectoryHistory, vocabulary: frozenset[str]) -> set[str]:
    there = history.all_object_types
    alike = set().union(*(group for group in _TAKEN_FOR_EACH_OTHER if group & there))
    return {object_type for object_type in vocabulary - there - alike if _asked(object_type)}


def _shown(history: TrajectoryHistory, frame: int) -> int:
    return sum(seen.pixels >= history.least for seen in history.seen(frame).values())


def _asked(object_type: str) -> bool:
    return object_type not in _UNASKED and not object_type.endswith(("Basin", "Sliced", "Cracked"))
