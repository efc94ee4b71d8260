"""What an object is directly in or on, of all the receptacles that the simulator names for it."""

import math
from collections.abc import Mapping

from infthor_eval.formats.step_log import ObjectState
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["contents_of", "direct_parent", "is_in", "logged_parent"]


def contents_of(holder: str, objects: Mapping[str, ThorObject]) -> frozenset[str]:
    """Ids of what is in or on a receptacle, and of what is in or on that."""
    found: set[str] = set()
    new = {holder}
    while new:
        inside = {key for parent in new for key in objects[parent].receptacle_object_ids or ()}
        inside |= {key for key, item in objects.items() if new & set(item.parent_receptacles or ())}
        new = (inside & objects.keys()) - found - {holder}
        found |= new
    return frozenset(found)


def is_in(wanted: str, receptacle_id: str, view: SimulatorView) -> bool:
    """Whether an object lies in or on a receptacle itself.

    In a bowl that stands in it is not in it; of furniture within furniture, each that the simulator names will do.
    """
    item, holder = view.objects.get(wanted), view.objects.get(receptacle_id)
    if item is None or holder is None:
        return False
    parents = set(item.parent_receptacles or ())
    carried = any(key in view.objects and view.objects[key].pickupable for key in parents - {receptacle_id})
    named = receptacle_id in parents or wanted in (holder.receptacle_object_ids or ())
    return named and (holder.pickupable or not carried)


def direct_parent(item: ThorObject, objects: Mapping[str, ThorObject]) -> str | None:
    """The innermost receptacle that an object is in or on, by its id; the floor may be it.

    Where several could be, it is the smallest: who plans or acts must take the object for somewhere.
    """
    parents = [objects[key] for key in item.parent_receptacles or () if key in objects and key != item.object_id]
    if not parents:
        return None
    return min(parents, key=lambda parent: (not parent.pickupable, _volume(parent), parent.object_id)).object_id


def logged_parent(state: ObjectState, world: Mapping[str, ObjectState]) -> str | None:
    """The same of an object in the step log; None where it is held, lies on the floor, or it is not clear.

    Who tells what was seen must not guess, and a log has no sizes to guess by.
    """
    if state.held:
        return None
    parents = [key for key in state.parents if key in world and world[key].type != "Floor"]
    # The innermost is in all the others; basins count as their sinks.
    inner = [key for key in parents if all(_within(world, key, other) for other in parents if other != key)]
    return inner[0] if inner else None


def _volume(item: ThorObject) -> float:
    box = item.axis_aligned_bounding_box
    return math.inf if box is None else box.size.x * box.size.y * box.size.z


def _within(world: Mapping[str, ObjectState], inner: str, outer: str) -> bool:
    if outer in world[inner].parents:
        return True
    one, other = world[inner].type, world[outer].type
    return canonical_type(one) == canonical_type(other) and one.endswith("Basin")
