"""An episode that twins are made of: a trajectory, its restored start, and what happened in it."""

from dataclasses import dataclass
from functools import cached_property

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.generation.questions import open_state
from infthor_eval.generation.questions.history import ObjectMove, TrajectoryHistory
from infthor_eval.generation.twins.rewriting import first_subgoals, whole_of
from infthor_eval.household.containment import logged_parent
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.view import SimulatorView, ThorObject

# What people would ask about as open or closed, and what can stand open without a hand on it.
ASKED_OPEN = open_state.CONTAINERS | {"Laptop"}


@dataclass(frozen=True)
class Episode:
    """A trajectory with its restored start and the log of its replay.

    Attributes:
        trajectory: the trajectory; the ids in its actions are the simulator's.
        start: the restored scene, before the agent's first action.
        history: what happened, from the log.
        is_whole: False for a stretch of one.
    """

    trajectory: Trajectory
    start: SimulatorView
    history: TrajectoryHistory
    is_whole: bool = True

    def until(self, n_high: int) -> "Episode":
        """Return the episode up to the end of so many sub-goals."""
        trajectory = first_subgoals(self.trajectory, n_high)
        history = self.history.until(len(trajectory.plan.low_actions))
        return Episode(trajectory, self.start, history, is_whole=False)

    @cached_property
    def loose(self) -> tuple[ThorObject, ...]:
        """Objects that can be picked up and stand somewhere alone and empty, by id."""
        states = self.history.states(0)
        holders = {parent for state in states.values() for parent in state.parents}
        return tuple(
            obj
            for key, obj in sorted(self.start.objects.items())
            if obj.pickupable and key not in holders and self.holder(key) is not None
        )

    @cached_property
    def put_targets(self) -> frozenset[str]:
        """Ids of what the agent puts things into or onto."""
        return frozenset(event.receptacle for event in self.history.events if event.receptacle)

    def holder(self, key: str) -> ThorObject | None:
        """Return what an object is directly in or on at the start; None for the floor."""
        states = self.history.states(0)
        parent = logged_parent(states[key], states)
        return None if parent is None else self.start.objects[parent]

    def inside(self, key: str, frame: int = 0) -> frozenset[str]:
        """Return the ids of all that is in or on an object at a frame, however deep."""
        states = self.history.states(frame)
        return frozenset(other for other, state in states.items() if key in state.parents)

    def is_only_one(self, obj: ThorObject) -> bool:
        """Return True if the scene has no other object of the name at the start."""
        return self.history.is_only_one(0, obj.object_id)

    def actions_on(self, key: str) -> list[str]:
        """Return the names of the actions on an object, or on a slice of it, in order."""
        events = self.history.events
        return [event.action for event in events if _is_of(event.target, key)]

    def moves_of(self, key: str) -> list[ObjectMove]:
        """Return the moves of an object and of its slices."""
        return [move for move in self.history.moves if _is_of(move.item, key)]

    def suffix(self, move: ObjectMove) -> str:
        """Return what the type of a moved object has after that of its whole."""
        return "Sliced" if move.object_type.endswith("Sliced") else ""

    def n_handled(self, object_type: str) -> int:
        """Return how many objects of a type the agent acts on."""
        name = canonical_type(object_type)
        events = self.history.events
        heads = {whole_of(event.target) for event in events}
        return sum(canonical_type(head.partition("|")[0]) == name for head in heads)


def _is_of(target: str, key: str) -> bool:
    return target == key or target.startswith(f"{key}|")
