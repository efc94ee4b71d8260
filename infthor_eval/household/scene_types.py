"""Room types of scenes, by their names, and the task types of each."""

import re

from infthor_eval.household.affordances import GOALS_BY_ROOM
from infthor_eval.household.tasks import SAMPLED, TaskType

__all__ = ["BATHROOM", "scene_type", "usual_tasks"]

BATHROOM = "Bathroom"
_PROCEDURAL = {
    "kitchen": "Kitchen",
    "living-room": "LivingRoom",
    "bedroom": "Bedroom",
    "bathroom": BATHROOM,
}
_FLOOR_PLANS = {
    "Kitchen": range(1, 31),
    "LivingRoom": range(201, 231),
    "Bedroom": range(301, 331),
    BATHROOM: range(401, 431),
}


def scene_type(scene: str) -> str | None:
    """Return a scene's room type in published words ("LivingRoom"); None for houses and others."""
    number = re.fullmatch(r"FloorPlan(\d+)", scene)
    if number is not None:
        return next(
            (name for name, numbers in _FLOOR_PLANS.items() if int(number[1]) in numbers), None
        )
    return _PROCEDURAL.get(scene.rpartition("-")[0])


def usual_tasks(scene: str) -> frozenset[TaskType]:
    """Return the task types drawn from in a scene's room type, or all if that is unknown."""
    room = scene_type(scene)
    return frozenset(name for name in SAMPLED if room is None or room in GOALS_BY_ROOM[name])
