"""What happened in a trajectory and what its frames show, read from the step log."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import ObjectState, Seen, Step, worlds

__all__ = ["DEFAULT_SHARE", "FRAME_PIXELS", "History", "Move", "canonical"]

FRAME_PIXELS = 300 * 300
DEFAULT_SHARE = 0.001  # of the frame: 90 pixels, about a fork on a table an arm's length away
_WHOLE = {"SinkBasin": "Sink", "BathtubBasin": "Bathtub"}


def canonical(kind: str) -> str:
    """The type that people would name: the basin of a sink is the sink."""
    return _WHOLE.get(kind, kind)


@dataclass(frozen=True)
class Move:
    """An object was picked up and put somewhere.

    Attributes:
        item: its id.
        kind: its type.
        origin: id of what it was in or on; None where that is not clear.
        before: the frame before it was picked up.
        target: id of what it was put into or onto.
        after: the frame after it was put.
    """

    item: str
    kind: str
    origin: str | None
    before: int
    target: str
    after: int


class History:
    """The log of one trajectory, for question rules.

    Attributes:
        traj_id: the trajectory's folder.
        steps: the log.
        least: number of pixels from which on an object counts as shown.
    """

    def __init__(self, traj_id: str, steps: list[Step], share: float = DEFAULT_SHARE) -> None:
        """Read a log.

        Args:
            traj_id: the trajectory's folder.
            steps: the log, with the fields that a replay adds.
            share: of the frame's pixels that an object must fill to count as shown.

        Raises:
            DataError: the log is empty or lacks what questions are made from.
        """
        if not steps or any(step.seen is None for step in steps):
            raise DataError(f"{traj_id}: the log does not say what the frames show; replay the trajectory again")
        self.traj_id = traj_id
        self.steps = steps
        self.least = share * FRAME_PIXELS
        self._worlds = list(_snapshots(steps))

    def __len__(self) -> int:
        return len(self.steps)

    def world(self, frame: int) -> dict[str, ObjectState]:
        """The true state of every object at a frame, by id."""
        return self._worlds[frame]

    def seen(self, frame: int) -> dict[str, Seen]:
        """What a frame shows, by id."""
        return self.steps[frame].seen or {}

    def shows(self, frame: int, *ids: str) -> bool:
        """Whether a frame shows all these objects large enough."""
        seen = self.seen(frame)
        return all(key in seen and seen[key].pixels >= self.least for key in ids)

    def parent(self, frame: int, item: str) -> str | None:
        """What an object is directly in or on at a frame; None where it is held, lies on the floor, or it is not
        clear."""
        world = self.world(frame)
        state = world.get(item)
        if state is None or state.held:
            return None
        parents = [key for key in state.parents if key in world and world[key].type != "Floor"]
        # The innermost is in all the others; basins count as their sinks.
        inner = [key for key in parents if all(_within(world, key, other) for other in parents if other != key)]
        return inner[0] if inner else None

    def kinds(self, frame: int) -> set[str]:
        """The types that exist at a frame, as people would name them."""
        return {canonical(state.type) for state in self.world(frame).values() if state.exists}

    @cached_property
    def all_kinds(self) -> frozenset[str]:
        """The types that exist at any time."""
        return frozenset(canonical(state.type) for step in self.steps for state in step.changes.values())

    @cached_property
    def moves(self) -> tuple[Move, ...]:
        """Every time that an object was picked up and put down, in order."""
        found: list[Move] = []
        picked: dict[str, int] = {}
        for frame, step in enumerate(self.steps):
            name = (step.action or "").partition(" ")[0]
            if not step.success or step.target is None:
                continue
            if name == "PickupObject":
                picked[step.target] = frame - 1
            elif name == "PutObject" and step.receptacle is not None and step.target in picked:
                before = picked.pop(step.target)
                kind = self.world(before)[step.target].type
                origin = self.parent(before, step.target)
                found.append(Move(step.target, kind, origin, before, step.receptacle, frame))
        return tuple(found)

    def moves_of(self, item: str) -> tuple[Move, ...]:
        """The moves of one object."""
        return tuple(move for move in self.moves if move.item == item)

    @cached_property
    def handled(self) -> dict[str, set[str]]:
        """The objects that were picked up, by type."""
        found: dict[str, set[str]] = {}
        for frame, step in enumerate(self.steps):
            if step.success and step.target is not None and (step.action or "").startswith("PickupObject"):
                found.setdefault(self.world(frame)[step.target].type, set()).add(step.target)
        return found

    def best_frame(self, item: str) -> int | None:
        """The frame that shows an object largest and whole; None where none shows it large enough."""
        frames = [
            (seen[item].pixels, -frame)
            for frame in range(len(self))
            if item in (seen := self.seen(frame)) and seen[item].pixels >= self.least
        ]
        return -max(frames)[1] if frames else None


def _snapshots(steps: list[Step]) -> Iterator[dict[str, ObjectState]]:
    """The worlds of a log; equal neighbours share one dict."""
    last: dict[str, ObjectState] = {}
    for step, world in zip(steps, worlds(steps), strict=True):
        if step.changes or not last:
            last = {key: state for key, state in world.items() if state.exists}
        yield last


def _within(world: dict[str, ObjectState], inner: str, outer: str) -> bool:
    if outer in world[inner].parents:
        return True
    one, other = world[inner].type, world[outer].type
    return canonical(one) == canonical(other) and one.endswith("Basin")
