"""Step logs made by hand: everything is always in sight, unless it is said not to be."""

from infthor_eval.formats.step_log import ObjectInFrame, ObjectLog, ObjectState, Step
from infthor_eval.generation.questions.history import TrajectoryHistory

LOOSE = ("Apple", "Book", "Egg", "Laptop", "Mug", "Pan", "Vase")


def state(key, *parents, **fields):
    return ObjectState(key.partition("|")[0], parents, **fields)


def history(start, *events, boxes=None):
    """A history.

    Args:
        start: the states at first, by id.
        events: of each later frame the action, its target, its receptacle, and the states that
            changed.
        boxes: of some frames the boxes of some objects.
    """
    steps, ids = [], list(start)
    object_log = ObjectLog(visible=[key.partition("|")[0] for key in ids], pickupable=list(LOOSE))
    for number, (action, target, receptacle, changes) in enumerate(
        [(None, None, None, start), *events]
    ):
        instances = {key: ObjectInFrame(400, (100, 100, 120, 120), True) for key in ids}
        instances |= {
            key: ObjectInFrame(400, box, True) for key, box in (boxes or {}).get(number, {}).items()
        }
        steps.append(
            Step(
                number,
                f"{number:09d}.png",
                max(0, number - 1),
                object_log,
                action,
                target=target,
                receptacle=receptacle,
                seen=instances,
                changes=changes,
            )
        )
    return TrajectoryHistory("made", steps)


def moved(key, origin, target):
    """Two events: an object is picked up from one and put into another receptacle."""
    return (
        ("PickupObject", key, None, {key: state(key, held=True)}),
        ("PutObject", key, target, {key: state(key, target)}),
    )
