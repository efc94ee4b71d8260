"""Object presence: "Is there any mug in this room?", "Have you seen a mug?"

The clue of a yes-question is the frame that shows such an object best. A no-question names a type
that the scene does not have, or, in the second form, one that no frame shows, and that is not
easily mistaken for one that is there. The type is one of other rooms of the same kind in the set,
so that neither its name nor a look at the room gives the answer away, or another that is common in
AI2-THOR's rooms of the kind if there are few of these. No frame is evidence for an absence, so its
clue is that of a yes-question, of one on a thing to carry if it names one itself: place in the
trajectory, hand and what is in view then do not tell yes from no, nor does the number of frames.

In a house of several rooms "this room" would be ambiguous, so only the second form is used.
"""

import random
from collections.abc import Iterable, Iterator

from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.rooms import COMMON_TYPES, rooms_of
from infthor_eval.household.affordances import STOWABLE
from infthor_eval.household.wording import noun, with_article

QUESTION_TYPE = "object_presence"
_IN_ROOM = "Is there any {} in this room?"
_SEEN = "Have you seen {}?"
_FEW = 8  # with fewer types of other rooms, AI2-THOR's are added

# Never in questions: structures, parts, and types that people would not call by these names.
_UNASKED = frozenset({
    "Floor", "Wall", "Ceiling", "Window", "Door", "Doorway", "DoorFrame", "StoveBurner",
    "StoveKnob", "LightSwitch", "Faucet", "ShowerHead", "ShowerGlass", "ShowerDoor", "Undefined",
    "Shelf", "ShelvingUnit", "Stool", "Curtains", "Blinds", "ToiletPaperHanger", "TowelHolder",
    "HandTowelHolder", "TargetCircle", "Cart", "Desktop", "RoomDecor",
})  # fmt: skip
_SIMILAR_TYPES = (
    {"Cup", "Mug", "Vase"},
    {"Cup", "Bowl"},
    {"Pen", "Pencil"},
    {"Knife", "ButterKnife"},
    {"Fork", "Spoon"},
    {"Spoon", "Spatula", "Ladle"},
    {"Bottle", "WineBottle", "SoapBottle", "SprayBottle"},
    {"Bottle", "Vase"},
    {"Sofa", "ArmChair"},
    {"ArmChair", "Chair"},
    {"Ottoman", "Footstool"},
    {"Desk", "DiningTable", "CoffeeTable", "SideTable", "CounterTop", "TVStand"},
    {"Drawer", "Dresser", "Cabinet"},
    {"Towel", "HandTowel", "Cloth"},
    {"Pot", "Pan"},
    {"Pot", "Kettle"},
    {"DeskLamp", "FloorLamp"},
    {"Apple", "Tomato"},
    {"Potato", "Egg"},
    {"Apple", "Potato"},
    {"SaltShaker", "PepperShaker"},
    {"Television", "Laptop"},
    {"Book", "Newspaper"},
    {"Painting", "Poster"},
    {"CellPhone", "RemoteControl"},
    {"CellPhone", "CreditCard"},
    {"ToiletPaper", "PaperTowelRoll"},
    {"SoapBar", "DishSponge"},
    {"Plunger", "ScrubBrush"},
    {"BasketBall", "Apple"},
)


def yes_questions(history: TrajectoryHistory) -> Iterator[Candidate]:
    """Yield the yes-questions, each with the frame that shows such an object best."""
    for object_type, frame in _best_frames(history).items():
        yield from _questions(_forms(history), object_type, frame, "yes")


def no_questions(
    history: TrajectoryHistory, vocabulary: frozenset[str], rng: random.Random
) -> Iterator[Candidate]:
    """Yield no-questions, with yes-questions' clues, on types of `vocabulary` that are absent."""
    best = _best_frames(history)
    absent = _other_types(history, vocabulary, history.all_object_types)
    for object_type in sorted(absent | _other_types(history, vocabulary, history.types_in_frames)):
        forms = _forms(history) if object_type in absent else (_SEEN,)
        is_carried = object_type in STOWABLE
        alike = [frame for name, frame in best.items() if (name in STOWABLE) == is_carried]
        yield from _questions(forms, object_type, rng.choice(alike or [0]), "no")


def _best_frames(history: TrajectoryHistory) -> dict[str, int]:
    """Return by nameable type, in order, the frame that shows one best."""
    best = history.best_frames.items()
    return {object_type: frame for object_type, frame in best if _is_nameable(object_type)}


def _forms(history: TrajectoryHistory) -> tuple[str, ...]:
    """Return the forms that suit the scene."""
    return (_SEEN,) if history.has_rooms else (_IN_ROOM, _SEEN)


def _questions(
    forms: Iterable[str], object_type: str, frame: int, answer: str
) -> Iterator[Candidate]:
    words = noun(object_type)
    for form in forms:
        name = with_article(words) if form == _SEEN else words
        yield Candidate(
            QUESTION_TYPE,
            form,
            (name,),
            (frame,),
            (answer,),
            (object_type,),
            absence=answer == "no",
        )


def _other_types(
    history: TrajectoryHistory, vocabulary: frozenset[str], there: frozenset[str]
) -> set[str]:
    """Return the vocabulary's types that are not there, nor like one that is; more if few."""
    rooms = rooms_of(history.all_object_types).split(", ")
    common = (
        frozenset[str]().union(*map(COMMON_TYPES.__getitem__, rooms)) - history.all_object_types
    )
    excluded = there | _similar_types(there)
    own = set(filter(_is_nameable, vocabulary - excluded))
    others = set(filter(_is_nameable, common - excluded))
    return own if len(own) >= _FEW else own | others


def _similar_types(there: frozenset[str]) -> set[str]:
    """Return the types that people may take for one that is there."""
    return {name for group in _SIMILAR_TYPES if group & there for name in group}


def is_clear_absence(object_type: str, there: frozenset[str]) -> bool:
    """Return True if a type can be asked for, and is neither there nor like one that is."""
    return _is_nameable(object_type) and object_type not in there | _similar_types(there)


def _is_nameable(object_type: str) -> bool:
    return object_type not in _UNASKED and not object_type.endswith(("Basin", "Sliced", "Cracked"))
