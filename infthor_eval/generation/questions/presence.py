"""Object presence: "Is there any mug in this room?", "Have you seen a mug?"

The clue of a yes-question is the first frame that shows such an object. A no-question names a type that the scene does
not have and that is not easily mistaken for one that it has. The type is one of other trajectories in the set, so that
its name does not give the answer away, or another of AI2-THOR's if there are few of these. No frame is evidence for an
absence, so its clue is a sampled frame. It has one, like a yes-question, or the number of frames would give the answer
away.

In a house of several rooms "this room" would be ambiguous, so only the second form is used.
"""

import random
from collections.abc import Iterator

from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.household.wording import noun, with_article

__all__ = ["QUESTION_TYPE", "no_questions", "yes_questions"]

QUESTION_TYPE = "object_presence"
_FEW = 8  # with fewer types of other trajectories, AI2-THOR's are added
_BUSY = 3  # minimum number of objects in a sampled frame, if the trajectory has such frames

# Never in questions: structures, parts, and types that people would not call by these names.
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
_SIMILAR_TYPES = (
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


def yes_questions(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the yes-questions, each with the first frame that shows such an object."""
    first: dict[str, int] = {}
    for frame in range(len(history)):
        states = history.states(frame)
        for key in history.objects_in_frame(frame):
            if key in states and history.shows(frame, key):
                first.setdefault(states[key].type, frame)
    for object_type, frame in sorted(first.items()):
        if _is_nameable(object_type):
            yield from _all_forms(history, object_type, frame, "yes")


def no_questions(history: TrajectoryHistory, vocabulary: frozenset[str], rng: random.Random) -> Iterator[Candidate]:
    """Yield no-questions with random frames on types of the whole set, `vocabulary`, that the scene does not have."""
    frames = [frame for frame in range(len(history)) if _is_busy(history, frame)] or [0]
    types = _absent_types(history, vocabulary)
    if len(types) < _FEW:
        types |= _absent_types(history, _COMMON)
    for object_type in sorted(types):
        yield from _all_forms(history, object_type, rng.choice(frames), "no")


def _all_forms(history: TrajectoryHistory, object_type: str, frame: int, answer: str) -> Iterator[Candidate]:
    """Yield the question in the forms that suit the scene."""
    words = noun(object_type)
    room_form = () if history.has_rooms else (("Is there any {} in this room?", words),)
    for form, name in (*room_form, ("Have you seen {}?", with_article(words))):
        yield Candidate(QUESTION_TYPE, form, (name,), (frame,), (answer,), (object_type,), absence=answer == "no")


def _absent_types(history: TrajectoryHistory, vocabulary: frozenset[str]) -> set[str]:
    existing = history.all_object_types
    similar = set().union(*(group for group in _SIMILAR_TYPES if group & existing))
    return {object_type for object_type in vocabulary - existing - similar if _is_nameable(object_type)}


def _is_busy(history: TrajectoryHistory, frame: int) -> bool:
    return sum(history.shows(frame, key) for key in history.objects_in_frame(frame)) >= _BUSY


def _is_nameable(object_type: str) -> bool:
    return object_type not in _UNASKED and not object_type.endswith(("Basin", "Sliced", "Cracked"))
