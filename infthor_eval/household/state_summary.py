"""The state of the room and the agent in words, restricted to what the agent has seen.

Models that get text instead of all frames read it: the place where each seen object was seen last,
what is open or switched on, and what the agent holds.
"""

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states
from infthor_eval.household.affordances import preposition
from infthor_eval.household.containment import logged_parent
from infthor_eval.household.wording import noun, with_article

_SURROUNDINGS = frozenset({"Floor", "Wall", "Ceiling"})


def state_summaries(steps: list[Step], at: set[int]) -> dict[int, str]:
    """Return summaries after the low-level actions of some indices, from the log of a replay."""
    known: dict[str, tuple[ObjectState, str | None]] = {}
    summaries: dict[int, str] = {}
    for step, world in zip(steps, iter_object_states(steps), strict=True):
        held = [noun(state.type) for state in world.values() if state.held and state.exists]
        for key in step.seen or {}:
            if world[key].type not in _SURROUNDINGS:
                known[key] = (world[key], _logged_receptacle(world, world[key]))
        for key in [key for key in known if not world[key].exists or world[key].held]:
            del known[key]
        if step.step in at and step.action is not None:
            summaries[step.step] = _summary(known, held)
    return summaries


def _summary(known: dict[str, tuple[ObjectState, str | None]], held: list[str]) -> str:
    sentences = [
        f"You are holding {' and '.join(map(with_article, held))}."
        if held
        else "Your hands are free."
    ]
    inside: dict[str, list[str]] = {}
    for state, receptacle in known.values():
        if receptacle is not None:
            inside.setdefault(receptacle, []).append(noun(state.type))
    for receptacle in sorted(inside):
        contents = ", ".join(with_article(name) for name in sorted(inside[receptacle]))
        sentences.append(f"You saw {contents} {preposition(receptacle)} the {noun(receptacle)}.")
    opened = sorted({noun(state.type) for state, _ in known.values() if state.is_open})
    lit = sorted(
        {
            noun(state.type)
            for state, _ in known.values()
            if state.is_on and state.type.endswith("Lamp")
        }
    )
    sentences += [f"Open: {', '.join(opened)}."] if opened else []
    sentences += [f"Switched on: {', '.join(lit)}."] if lit else []
    return " ".join(sentences)


def _logged_receptacle(world: dict[str, ObjectState], state: ObjectState) -> str | None:
    """Return the type of the receptacle that an object is directly in or on."""
    parent = logged_parent(state, world)
    return None if parent is None else world[parent].type
