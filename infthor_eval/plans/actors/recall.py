"""Going where the log of the history last had an object: acting by memory, without a frame.

The log has types alone. So of several drawers this goes to the nearest, and on a long counter it
may look at the wrong end.
"""

from collections.abc import Sequence

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.household.affordances import KNOWN_TYPES
from infthor_eval.plans.actors.script import read_plan
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.thor.view import SimulatorView, ThorObject


def way_by_memory(
    plan: str, environment: PlanEnvironment, view: SimulatorView, logs: Sequence[ObjectLog]
) -> list[str]:
    """Return the actions to where a plan's object was last seen, or is to be put.

    What it is in is opened. There are none for plans that neither pick up nor put, and where the
    place is not known.

    Args:
        plan: text of the plan.
        environment: the environment, reset to it.
        view: what that shows.
        logs: log of each frame so far.

    Raises:
        SimulatorError: the simulator fails.
    """
    verb, names = read_plan(plan)
    place = None
    if names and verb == "put":
        place = names[-1]
    elif names and verb == "pick up":
        place = last_place(names[0], logs)
    known = [obj for obj in view.objects.values() if _is_named(obj, place)]
    if not known:
        return []
    nearest = min(known, key=lambda obj: (obj.distance, obj.object_id))
    actions = environment.actions_to(nearest.object_id)
    if verb == "pick up" and nearest.openable and not nearest.is_open:
        actions.append(f"OpenObject {nearest.object_type}")
    return actions


def last_place(name: str, logs: Sequence[ObjectLog]) -> str | None:
    """Return the type of the furniture that an object was last seen in or on; None if never."""
    for log in reversed(logs):
        holders = [
            (len(contents), receptacle)
            for receptacle, contents in log.recep_objs.items()
            if name in contents and receptacle in KNOWN_TYPES
        ]
        if holders:
            return min(holders)[1]  # a drawer rather than the dresser that it is in
    return None


def _is_named(obj: ThorObject, name: str | None) -> bool:
    return bool(obj.receptacle) and name in (
        obj.object_type,
        Words.PUBLISHED.name_of(obj.object_id),
    )
