"""Room types of scenes, by their names."""

import re

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
