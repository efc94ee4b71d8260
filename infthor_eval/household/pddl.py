"""The planner's operators and problems as PDDL, so that others can verify that plans are optimal.

The domain is STRIPS with types, negative preconditions and action costs: every operator costs one.
PDDL goals refer to objects but tasks to object types, so zero-cost `finish` actions recognise each
task's goal. A problem has all places of the room, without the planner's reductions, and the items
of the task's types.
"""

from collections.abc import Iterable

from infthor_eval.household.affordances import KNIVES, SLICEABLE
from infthor_eval.household.planner import relevant_items
from infthor_eval.household.symbolic import ABSENT, FLOOR, SymbolicRoom, slice_item
from infthor_eval.household.tasks import Task, TaskType

_FINISHES = {
    TaskType.PLACE: "(?i - item ?p - place) (and (target ?i) (goal-place ?p) (in ?i ?p))",
    TaskType.PLACE_TWO: "(?i ?j - item ?p - place) (and (target ?i) (target ?j) (not (= ?i ?j))"
    " (goal-place ?p) (in ?i ?p) (in ?j ?p))",
    TaskType.EXAMINE: "(?i - item ?p - place) (and (target ?i) (holding ?i) (at ?p) (goal-lamp ?p) "
    "(lit ?p))",
    TaskType.CLEAN: "(?i - item ?p - place) (and (target ?i) (goal-place ?p) (in ?i ?p) (clean "
    "?i))",
    TaskType.HEAT: "(?i - item ?p - place) (and (target ?i) (goal-place ?p) (in ?i ?p) (hot ?i))",
    TaskType.COOL: "(?i - item ?p - place) (and (target ?i) (goal-place ?p) (in ?i ?p) (cold ?i))",
    TaskType.STACK: "(?i ?c - item ?p - place) (and (target ?i) (carrier ?c) (goal-place ?p) (in "
    "?i ?c) (in ?c ?p))",
    TaskType.PUT_AWAY: "(?i - item ?p - place) (and (target ?i) (goal-place ?p) (in ?i ?p) "
    "(handempty))",
}

_OPERATORS = (
    ("goto", "(?from ?to - place)", "(at ?from) (not (= ?from ?to))", "(not (at ?from)) (at ?to)"),
    (
        "pickup",
        "(?i - item ?p - place)",
        "(at ?p) (in ?i ?p) (handempty)",
        "(not (in ?i ?p)) (not (handempty)) (holding ?i)",
    ),
    (
        "pickup-from",
        "(?i ?c - item ?p - place)",
        "(at ?p) (in ?c ?p) (in ?i ?c) (handempty)",
        "(not (in ?i ?c)) (not (handempty)) (holding ?i)",
    ),
    (
        "put",
        "(?i - item ?p - place)",
        "(at ?p) (holding ?i) (fits ?i ?p)",
        "(not (holding ?i)) (handempty) (in ?i ?p)",
    ),
    (
        "put-into",
        "(?i ?c - item ?p - place)",
        "(at ?p) (holding ?i) (in ?c ?p) (fits ?i ?c) (not (= ?i ?c))",
        "(not (holding ?i)) (handempty) (in ?i ?c)",
    ),
    (
        "slice",
        "(?i ?s ?t ?k - item ?p - place)",
        "(at ?p) (in ?i ?p) (holding ?k) (knife ?k) (slices ?i ?s ?t)",
        "(not (in ?i ?p)) (in ?s ?p) (in ?t ?p)",
    ),
    (
        "slice-in",
        "(?i ?s ?t ?k ?c - item ?p - place)",
        "(at ?p) (in ?c ?p) (in ?i ?c) (holding ?k) (knife ?k) (slices ?i ?s ?t)",
        "(not (in ?i ?c)) (in ?s ?c) (in ?t ?c)",
    ),
    ("clean", "(?i - item ?p - place)", "(at ?p) (basin ?p) (holding ?i)", "(clean ?i)"),
    (
        "heat",
        "(?i - item ?p - place)",
        "(at ?p) (oven ?p) (holding ?i)",
        "(hot ?i) (not (cold ?i))",
    ),
    (
        "cool",
        "(?i - item ?p - place)",
        "(at ?p) (fridge ?p) (holding ?i)",
        "(cold ?i) (not (hot ?i))",
    ),
    ("toggle", "(?p - place)", "(at ?p) (lamp ?p) (not (lit ?p))", "(lit ?p)"),
)
_APPLIANCES = {"SinkBasin": "basin", "Microwave": "oven", "Fridge": "fridge"}


def _symbol(task_type: TaskType) -> str:
    return task_type.replace(" ", "-")


def _build_domain() -> str:
    lines = [
        "(define (domain household)",
        " (:requirements :strips :typing :negative-preconditions :equality :action-costs)",
        " (:types item place - thing)",
        " (:predicates (at ?p - place) (holding ?i - item) (handempty) (in ?i - item ?t - thing)",
        "  (fits ?i - item ?t - thing) (knife ?i - item) (slices ?i ?s ?t - item)",
        "  (basin ?p - place) (oven ?p - place) (fridge ?p - place) (lamp ?p - place) (lit ?p - "
        "place)",
        "  (clean ?i - item) (hot ?i - item) (cold ?i - item)",
        "  (target ?i - item) (carrier ?i - item) (goal-place ?p - place) (goal-lamp ?p - place)",
        *(f"  (asked-{_symbol(task_type)})" for task_type in TaskType),
        "  (done))",
        " (:functions (total-cost) - number)",
    ]
    for name, parameters, condition, effect in _OPERATORS:
        lines.append(f" (:action {name} :parameters {parameters}")
        lines.append(f"  :precondition (and {condition})")
        lines.append(f"  :effect (and {effect} (increase (total-cost) 1)))")
    for task_type, finish in _FINISHES.items():
        parameters, _, condition = finish.partition(") (and")
        lines.append(f" (:action finish-{_symbol(task_type)} :parameters {parameters})")
        lines.append(f"  :precondition (and (asked-{_symbol(task_type)}){condition}")
        lines.append("  :effect (and (done) (increase (total-cost) 0)))")
    return "\n".join([*lines, ")", ""])


DOMAIN = _build_domain()


def problem(task: Task, room: SymbolicRoom, name: str = "task") -> str:
    """Return a task in a room's current state as a PDDL problem for `DOMAIN`."""
    items = sorted(relevant_items(task, room))
    where = dict(room.start.where)
    on_floor = [item for item in items if where[item] == FLOOR]
    names = {key: f"p{number}" for number, key in enumerate(sorted(room.places))}
    names |= {key: f"i{number}" for number, key in enumerate(items)}
    # An item on the floor has a place of its own. "nowhere" is where the agent starts if it is at
    # no place.
    places = (
        [names[key] for key in sorted(room.places)]
        + [f"floor-{names[key]}" for key in on_floor]
        + ["nowhere"]
    )
    comments = [f" ; {short} {key}" for key, short in names.items()]
    facts = [
        *_state(room, items, names),
        *_rules(task, room, items, names),
        *_goal(task, room, items, names),
    ]
    lines = [
        f"(define (problem {name})",
        " (:domain household)",
        *comments,
        f" (:objects {' '.join(names[key] for key in items)} - item {' '.join(places)} - place)",
        " (:init (= (total-cost) 0)",
        *(f"  ({fact})" for fact in facts),
        " )",
        " (:goal (done))",
        " (:metric minimize (total-cost)))",
        "",
    ]
    return "\n".join(lines)


def _state(room: SymbolicRoom, items: list[str], names: dict[str, str]) -> Iterable[str]:
    start = room.start
    yield f"at {names[start.at]}" if start.at in names else "at nowhere"
    yield "handempty" if start.held is None else f"holding {names[start.held]}"
    for item, parent in start.where:
        if item in names and parent == FLOOR:
            yield f"in {names[item]} floor-{names[item]}"
        elif item in names and parent != ABSENT and parent in names:
            yield f"in {names[item]} {names[parent]}"
    yield from (f"lit {names[lamp]}" for lamp in sorted(start.lit))
    yield from (f"clean {names[item]}" for item in items if item in start.clean)


def _rules(
    task: Task, room: SymbolicRoom, items: list[str], names: dict[str, str]
) -> Iterable[str]:
    holders = [key for key in sorted(names) if key in room.receptacles]
    for item in items:
        object_type = room.types[item]
        for holder in holders:
            usable = holder in room.places or room.types[holder] == task.movable
            if usable and holder != item and room.fits(item, holder):
                yield f"fits {names[item]} {names[holder]}"
        if object_type in KNIVES and task.sliced:
            yield f"knife {names[item]}"
        if object_type in SLICEABLE and object_type == task.pickup and task.sliced:
            yield f"slices {names[item]} {names[slice_item(item, 1)]} {names[slice_item(item, 2)]}"
    for place in sorted(room.places):
        if room.types[place] in _APPLIANCES:
            yield f"{_APPLIANCES[room.types[place]]} {names[place]}"
        if room.types[place] == task.light:
            yield f"lamp {names[place]}"


def _goal(task: Task, room: SymbolicRoom, items: list[str], names: dict[str, str]) -> Iterable[str]:
    yield f"asked-{_symbol(task.task_type)}"
    yield from (f"target {names[item]}" for item in items if room.types[item] in task.targets)
    yield from (f"carrier {names[item]}" for item in items if room.types[item] == task.movable)
    for place in sorted(room.places):
        if room.types[place] == task.receptacle:
            yield f"goal-place {names[place]}"
        if room.types[place] == task.light:
            yield f"goal-lamp {names[place]}"
