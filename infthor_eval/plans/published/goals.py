"""Goals of tasks as the published functions test them (`env/tasks.py`), by the task's type.

They differ from ALFRED's, which `household.goals` tests: no lamp is ever asked for, so that looking
at an object in light never counts; objects are told apart by the first part of their ids, so that
no slice is ever asked for by its type; the basin of a sink is found in tasks of two objects alone.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import TaskInfo
from infthor_eval.thor.view import ThorObject


@dataclass(frozen=True)
class Treated:
    """Ids of washed, heated and cooled objects. In the published script all stay empty."""

    cleaned: Collection[str] = frozenset()
    heated: Collection[str] = frozenset()
    cooled: Collection[str] = frozenset()


@dataclass(frozen=True)
class Scene:
    """What goals are tested on: objects by id, ids of held ones, and what was done to objects."""

    objects: Mapping[str, ThorObject]
    held: tuple[str, ...]
    treated: Treated

    def named(
        self, name: str | None, has_property: Callable[[ThorObject], bool]
    ) -> list[ThorObject]:
        """Return the objects of a name that have a property."""
        return [
            candidate
            for candidate in self.objects.values()
            if Words.PUBLISHED.name_of(candidate.object_id) == name and has_property(candidate)
        ]


def _pickupable(thor_object: ThorObject) -> bool:
    return bool(thor_object.pickupable)


def _receptacle(thor_object: ThorObject) -> bool:
    return bool(thor_object.receptacle)


def _inside(target: ThorObject, receptacles: Iterable[ThorObject]) -> bool:
    return bool(_filled([target], receptacles))


def _filled(targets: Sequence[ThorObject], receptacles: Iterable[ThorObject]) -> list[ThorObject]:
    """Return the receptacles with any of the objects in them."""
    ids = {target.object_id for target in targets}
    return [each for each in receptacles if ids & set(each.receptacle_object_ids or ())]


def _targets(info: TaskInfo, scene: Scene) -> tuple[list[ThorObject], list[ThorObject], int]:
    """Return a task's objects, its receptacles, and the number of slices that it lacks."""
    targets = scene.named(info.pickup, _pickupable)
    n_slices = sum("Sliced" in target.object_id for target in targets)
    if info.pickup is None:
        raise TypeError("the task names no object")
    lacking = max(0, 1 - n_slices) if "Sliced" in info.pickup else 0
    return targets, scene.named(info.receptacle, _receptacle), lacking


def _place(info: TaskInfo, scene: Scene) -> bool:
    targets, receptacles, lacking = _targets(info, scene)
    return not lacking and any(_inside(target, receptacles) for target in targets)


def _place_two(info: TaskInfo, scene: Scene) -> bool:
    targets, receptacles, _ = _targets(info, scene)
    if not receptacles and info.receptacle == "SinkBasin":
        receptacles = scene.named("Sink", _receptacle)
    if "Sliced" in str(info.pickup) and sum("Sliced" in target.object_id for target in targets) < 2:
        return False
    ids = {target.object_id for target in targets}
    contents = [set(receptacle.receptacle_object_ids or ()) for receptacle in receptacles]
    return any(len(ids & inside) >= 2 for inside in contents)


def _look_in_light(info: TaskInfo, scene: Scene) -> bool:
    _targets(info, scene)  # which raises for a task without an object
    return False


def _place_treated(
    chosen: Callable[[Treated], Collection[str]],
) -> Callable[[TaskInfo, Scene], bool]:
    def holds(info: TaskInfo, scene: Scene) -> bool:
        targets, receptacles, lacking = _targets(info, scene)
        ready = [target for target in targets if target.object_id in chosen(scene.treated)]
        return not lacking and any(_inside(target, receptacles) for target in ready)

    return holds


def _place_with_movable(info: TaskInfo, scene: Scene) -> bool:
    targets, receptacles, lacking = _targets(info, scene)
    carriers = scene.named(info.movable, _pickupable)
    filled = _filled(targets, carriers)
    there = any(_inside(carrier, receptacles) for carrier in carriers)
    ids = {receptacle.object_id for receptacle in receptacles}
    stacked = any(ids & set(carrier.parent_receptacles or ()) for carrier in filled)
    return not lacking and bool(filled) and there and stacked


def _put(info: TaskInfo, scene: Scene) -> bool:
    """Whether anything of a name lies in anything of another, and the hand is empty.

    This is what is put away after a task.
    """
    wanted = {info.pickup, info.movable}
    receptacles = [] if scene.held else scene.named(info.receptacle, _receptacle)
    inside = (key for receptacle in receptacles for key in receptacle.receptacle_object_ids or ())
    return any(Words.PUBLISHED.name_of(key) in wanted for key in inside)


_GOALS: Mapping[str, Callable[[TaskInfo, Scene], bool]] = {
    "pick_and_place_simple": _place,
    "pick_two_obj_and_place": _place_two,
    "look_at_obj_in_light": _look_in_light,
    "pick_clean_then_place_in_recep": _place_treated(lambda treated: treated.cleaned),
    "pick_heat_then_place_in_recep": _place_treated(lambda treated: treated.heated),
    "pick_cool_then_place_in_recep": _place_treated(lambda treated: treated.cooled),
    "pick_and_place_with_movable_recep": _place_with_movable,
    "put_object": _put,
}


def goal_holds(info: TaskInfo, scene: Scene) -> bool:
    """Return whether a task's goal holds; KeyError if its name (with blanks or "_") is unknown."""
    return _GOALS[info.goal.replace(" ", "_")](info, scene)
