"""What sort of room a scene is, by its name, and which tasks belong in it."""

import re

from infthor_eval.household.affordances import GOALS_BY_ROOM
from infthor_eval.household.tasks import TaskType

__all__ = ["BATHROOM", "scene_type", "usual_tasks"]

BATHROOM = "Bathroom"
_PROCEDURAL = {"kitchen": "Kitchen", "living-room": "LivingRoom", "bedroom": "Bedroom", "bathroom": BATHROOM}
_FLOOR_PLANS = {
    "Kitchen": range(1, 31),
    "LivingRoom": range(201, 231),
    "Bedroom": range(301, 331),
    BATHROOM: range(401, 431),
}


def scene_type(scene: str) -> str | None:
    """The sort of room, in the published tables' words ("LivingRoom"); None of a house and of unknown names."""
    number = re.fullmatch(r"FloorPlan(\d+)", scene)
    if number is not None:
        return next((name for name, numbers in _FLOOR_PLANS.items() if int(number[1]) in numbers), None)
    return _PROCEDURAL.get(scene.rpartition("-")[0])


def usual_tasks(scene: str) -> frozenset[TaskType]:
    """The task types that belong in a scene; all of them where its sort is not known."""
    room = scene_type(scene)
    return frozenset(name for name in TaskType if room is None or room in GOALS_BY_ROOM[name])
