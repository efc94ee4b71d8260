"""Which of the receptacles that the simulator reports for an object it is directly in or on."""

import math
from collections.abc import Mapping

from infthor_eval.formats.step_log import ObjectState
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import SimulatorView, ThorObject


def contents_of(holder: str, objects: Mapping[str, ThorObject]) -> frozenset[str]:
    """Return the ids of all objects in or on a receptacle, including those in its contents."""
    contents: set[str] = set()
    new = {holder}
    while new:
        # Both directions are read, as either may be missing from the metadata.
        inside = {key for parent in new for key in objects[parent].receptacle_object_ids or ()}
        inside |= {key for key, obj in objects.items() if new & set(obj.parent_receptacles or ())}
        new = (inside & objects.keys()) - contents - {holder}
        contents |= new
    return frozenset(contents)


def is_in(object_id: str, receptacle_id: str, view: SimulatorView) -> bool:
    """Return True if an object is directly in or on a receptacle.

    An object in a bowl is not directly in the cabinet around the bowl. If furniture is nested (a
    drawer in a dresser), every piece that the simulator reports counts.
    """
    obj = view.objects.get(object_id)
    holder = view.objects.get(receptacle_id)
    if obj is None or holder is None:
        return False
    parents = set(obj.parent_receptacles or ())
    in_carrier = any(
        key in view.objects and view.objects[key].pickupable for key in parents - {receptacle_id}
    )
    reported = receptacle_id in parents or object_id in (holder.receptacle_object_ids or ())
    return reported and (holder.pickupable or not in_carrier)


def direct_parent(obj: ThorObject, objects: Mapping[str, ThorObject]) -> str | None:
    """Return the id of an object's innermost receptacle, possibly the floor; None if it has none.

    If several qualify, it is the smallest: planning needs one place even where the report is
    ambiguous.
    """
    parents = [
        objects[key]
        for key in obj.parent_receptacles or ()
        if key in objects and key != obj.object_id
    ]
    if not parents:
        return None
    return min(
        parents, key=lambda parent: (not parent.pickupable, _volume(parent), parent.object_id)
    ).object_id


def logged_parent(state: ObjectState, world: Mapping[str, ObjectState]) -> str | None:
    """Return the innermost receptacle of an object in the step log.

    It is None if the object is held, lies on the floor, or its receptacle is ambiguous: questions
    and summaries must not guess, and a log has no sizes to compare.
    """
    if state.held:
        return None
    parents = [key for key in state.parents if key in world and world[key].type != "Floor"]
    # The innermost one is inside all others. Basins are inside their sinks.
    for key in parents:
        if all(_within(world, key, other) for other in parents if other != key):
            return key
    return None


def _volume(obj: ThorObject) -> float:
    box = obj.axis_aligned_bounding_box
    return math.inf if box is None else box.size.x * box.size.y * box.size.z


def _within(world: Mapping[str, ObjectState], inner: str, outer: str) -> bool:
    if outer in world[inner].parents:
        return True
    one = world[inner].type
    other = world[outer].type
    return canonical_type(one) == canonical_type(other) and one.endswith("Basin")
