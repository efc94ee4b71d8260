"""What the agent sees: objects in the camera's view that nothing hides, near enough to interact with."""

import numpy as np

from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.camera import Camera
from infthor_eval.sim.render.picture import Picture
from infthor_eval.sim.world import World

__all__ = ["enclosures", "least_pixels", "visible_ids"]

_SHARE = 2.5e-5  # of the picture's pixels that must show an object: 2 pixels at 300x300


def visible_ids(world: World, picture: Picture, max_distance: float) -> frozenset[str]:
    """Ids of the objects that AI2-THOR would report as visible.

    Args:
        world: the scene.
        picture: the agent's view, cast without the held object, which hides nothing.
        max_distance: `visibilityDistance`, horizontal metres from the agent to the object's box.
    """
    counts = np.bincount(picture.instances.ravel() + 1, minlength=len(picture.names) + 1)[1:]
    seen = set()
    for index in np.nonzero(counts >= least_pixels(picture.camera))[0]:
        item = world.objects.get(picture.names[index])
        if item is not None and world.reach(item) <= max_distance:
            seen.add(item.object_id)
    if world.held is not None:
        held = world.objects[world.held]
        seen.add(held.object_id)
        seen.update(o.object_id for o in world.descendants(held) if not world.hidden(o))
    return frozenset(seen)


def least_pixels(camera: Camera) -> int:
    """Pixels of a camera's picture that must show an object for it to be visible."""
    return max(1, round(_SHARE * camera.width * camera.height))


def enclosures(world: World, item: SimObject) -> list[SimObject]:
    """What contains the object, and the fixed receptacles whose box its middle is in."""
    point = item.center
    found = list(world.ancestors(item))
    for other in world.objects.values():
        low, high = other.bounds()
        fixed = other.type.receptacle and not other.type.pickupable and other not in found
        if fixed and bool(np.all((point > low - 0.05) & (point < high + 0.05))):
            found.append(other)
    return [o for o in found if o.object_type != "Floor" and o is not item]
