"""The state of one scene: its objects, its agent, and which object contains which."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from infthor_sim.agent import Agent, Grip
from infthor_sim.arm.arm import Arm
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, aabb_gap, euler_matrix, matrix_euler
from infthor_sim.objects import SimObject
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.pictures.appearance import Appearance

__all__ = ["FLOOR_STYLES", "RoomShell", "Wall", "World"]

FLOOR_STYLES = ("wood", "tiles", "carpet")
# where AI2-THOR has its agent's hand, in the camera's frame
_HAND = Grip(np.array([0.0, -0.16, 0.38]), np.eye(3))


@dataclass(frozen=True)
class Wall:
    """A stretch of wall from (x0, z0) to (x1, z1), metres, between two heights."""

    x0: float
    z0: float
    x1: float
    z1: float
    bottom: float
    top: float
    style: int = 0


@dataclass(frozen=True)
class RoomShell:
    """The shell of one room: a rectangular floor, ceiling and walls, metres.

    Attributes:
        x_min, x_max: west and east edge of the floor.
        z_min, z_max: south and north edge.
        height: height of the ceiling.
        floor: height of the floor.
        floor_style: one of `FLOOR_STYLES`.
        style: index that varies the colour of the walls.
        walled: it has walls along all its edges; False if the world lists its walls one by one.
        openings: doorways, as (side "x-", "x+", "z-" or "z+", from, to).
    """

    x_min: float
    x_max: float
    z_min: float
    z_max: float
    height: float = 2.6
    floor: float = 0.0
    floor_style: str = "wood"
    style: int = 0
    walled: bool = True
    openings: tuple[tuple[str, float, float], ...] = ()


@dataclass
class World:
    """A scene as it is now.

    Attributes:
        scene: name of the scene.
        objects: objects by id, in the order of the metadata.
        nav: cells where the agent can stand.
        seed: seed of the scene's random numbers.
        held: id of the object in the agent's hand; None for an empty hand.
        version: number that grows with every change; cached views compare it.
        coarse: the shapes of its furniture are only known as boxes, as in recordings.
        walls: walls of rooms that are not `walled`.
        open_at_start: ids of the objects that are open in the recording; its cells already go
            around them.
        templates: copies of the loose objects as the scene first had them, by type.
        grip: pose of the held object in the camera's frame; None for the usual one after a pick-up.
        hand: pose of the hand in the camera's frame; the held object keeps its place in it.
        arm: the agent's arm; None for an agent that holds things in front of its camera.
        disabled: objects that are out of the scene until they are enabled again, by id.
        appearance: randomized looks.
        standing_height: height in metres of the agent's position on the floor.
    """

    scene: str
    objects: dict[str, SimObject]
    rooms: tuple[RoomShell, ...]
    nav: NavGrid
    agent: Agent
    seed: int = 0
    held: str | None = None
    version: int = 0
    coarse: bool = False
    walls: tuple[Wall, ...] = ()
    open_at_start: frozenset[str] = frozenset()
    templates: dict[str, list[SimObject]] = field(default_factory=dict)
    grip: Grip | None = None
    hand: Grip = _HAND
    arm: Arm | None = None
    disabled: dict[str, SimObject] = field(default_factory=dict)
    appearance: Appearance = field(default_factory=Appearance)
    standing_height: float = field(init=False)

    def __post_init__(self) -> None:
        self.standing_height = float(self.agent.position[1])

    def get(self, object_id: str) -> SimObject:
        """Return the object with this id.

        Raises:
            ActionError: there is none.
        """
        item = self.objects.get(object_id)
        if item is None:
            raise ActionError(
                f"objectId: {object_id} is not the objectId on any object in the scene!"
            )
        return item

    def mark_changed(self, *changed: SimObject) -> None:
        """Record that the view and these objects changed; with none, that only the view did."""
        # Objects take the world's number. So no two states under one id ever have the same version,
        # not even when a new object gets the id of a removed one, and caches by id and version are
        # safe.
        self.version += 1
        for item in changed:
            item.version = self.version

    def add(self, item: SimObject) -> None:
        """Add an object; its id must be new."""
        self.objects[item.object_id] = item
        self.mark_changed(item)

    def remove(self, item: SimObject) -> None:
        """Take an object out of the scene; its contents stay where they are, without a parent."""
        self.detach(item)
        for content in self.children(item):
            content.parent = None
            self.mark_changed(content)
        if self.held == item.object_id:
            self._empty_hand()
        if self.arm is not None:
            self.arm.let_go(item.object_id)
            for content_id in item.contents:
                self.arm.held_contents.pop(content_id, None)
        del self.objects[item.object_id]
        self.mark_changed()

    def attach(self, item: SimObject, receptacle: SimObject) -> None:
        """Put `item` among the contents of `receptacle`."""
        self.detach(item)
        item.parent = receptacle.object_id
        receptacle.contents.append(item.object_id)
        self.mark_changed(item, receptacle)

    def detach(self, item: SimObject) -> None:
        """Take `item` out of whatever contains it."""
        if self.arm is not None:
            self.arm.held_contents.pop(item.object_id, None)
        if item.parent is not None:
            receptacle = self.objects[item.parent]
            receptacle.contents.remove(item.object_id)
            item.parent = None
            self.mark_changed(item, receptacle)

    def rename(self, new_ids: Mapping[str, str]) -> None:
        """Give objects other ids (new by old), with all that names them; ids stay unique."""

        def new(old: str) -> str:
            return new_ids.get(old, old)

        for item in self.objects.values():
            item.object_id = new(item.object_id)
            item.parent = None if item.parent is None else new(item.parent)
            item.contents = [new(content) for content in item.contents]
            item.controls = tuple(new(controlled) for controlled in item.controls)
        self.objects = {item.object_id: item for item in self.objects.values()}
        self.held = None if self.held is None else new(self.held)
        if self.arm is not None:
            self.arm.held = {new(old): grip for old, grip in self.arm.held.items()}
            inside = self.arm.held_contents
            self.arm.held_contents = {new(old): grip for old, grip in inside.items()}
        finishes = self.appearance.finishes
        self.appearance.finishes = {new(old): finish for old, finish in finishes.items()}
        self.mark_changed(*self.objects.values())

    def children(self, item: SimObject) -> list[SimObject]:
        """Return what `item` contains directly."""
        return [self.objects[content] for content in item.contents]

    def descendants(self, item: SimObject) -> Iterator[SimObject]:
        """Yield everything inside or on `item`, at any depth."""
        # Not recursive: recorded poses can pile up a thousand plates.
        rest = self.children(item)[::-1]
        while rest:
            part = rest.pop()
            yield part
            rest += self.children(part)[::-1]

    def ancestors(self, item: SimObject) -> Iterator[SimObject]:
        """Yield what contains `item`, from the nearest outwards."""
        while item.parent is not None:
            item = self.objects[item.parent]
            yield item

    def shift(self, items: Iterable[SimObject], offset: Array) -> None:
        """Move objects, and all they contain, by `offset` metres (3,)."""
        for item in items:
            for part in (item, *self.descendants(item)):
                part.position = part.position + offset
                self.mark_changed(part)

    def carry(self, keep_grip: bool = False) -> None:
        """Move what the agent holds, and all it contains, along with the agent.

        Args:
            keep_grip: leave the object as it was moved in the hand; else the hand returns to its
                usual place.
        """
        if not keep_grip:
            self.grip = None
            self.hand = _HAND
        if self.held is not None:
            self.set_pose(self.objects[self.held], *self._held_pose(self.objects[self.held]))
        if self.arm is not None:
            wrist = self.arm.wrist(self.agent)
            # Contents have grips of their own: an arm tilts what it holds, which `set_pose` would
            # not do to contents.
            for object_id, grip in self.arm.grips():
                item = self.objects[object_id]
                item.position, item.rotation = (
                    wrist.point(grip.offset),
                    matrix_euler(wrist.turn @ grip.turn),
                )
                self.mark_changed(item)

    def held_ids(self) -> list[str]:
        """Return the ids of what the agent holds in its hand or with its arm, without contents."""
        by_arm = [] if self.arm is None else list(self.arm.held)
        return by_arm if self.held is None else [self.held, *by_arm]

    def _held_pose(self, item: SimObject) -> tuple[Array, Array]:
        if self.grip is None:  # upright, turned with the agent, the middle of its box at the hand
            turn = np.array([item.rotation[0], self.agent.yaw, item.rotation[2]])
            hand = self.agent.camera_position() + self.agent.camera_matrix() @ _HAND.offset
            return hand - euler_matrix(turn) @ item.box_center, turn
        camera = self.agent.camera_matrix()
        return self.agent.camera_position() + camera @ self.grip.offset, matrix_euler(
            camera @ self.grip.turn
        )

    def release(self) -> None:
        """Let go of everything that the agent holds; it stays where it is."""
        for object_id in self.held_ids():
            self.let_go(self.objects[object_id])

    def let_go(self, item: SimObject) -> None:
        """Let go of one object, if it is held, with its contents; it stays where it is."""
        if item.object_id == self.held:
            self._empty_hand()
        if self.arm is not None:
            for part in (item, *self.descendants(item)):
                part.state.picked_up = part.state.picked_up and part.object_id not in self.arm.held
                self.arm.let_go(part.object_id)
        item.state.picked_up = False
        self.mark_changed(item)

    def _empty_hand(self) -> None:
        self.held = self.grip = None
        self.hand = _HAND

    def move_hand(self, hand: Grip) -> None:
        """Move the hand to a pose in the camera's frame, with what it holds."""
        assert self.held is not None
        item = self.objects[self.held]
        camera = self.agent.camera_matrix()
        offset = (
            camera.T @ (item.position - self.agent.camera_position())
            + hand.offset
            - self.hand.offset
        )
        self.grip = Grip(offset, hand.turn @ self.hand.turn.T @ camera.T @ item.matrix)
        self.hand = hand
        self.carry(keep_grip=True)

    def set_pose(self, item: SimObject, position: Array, rotation: Array) -> None:
        """Move and turn an object; its contents keep their places in it."""
        # Positions of contents follow the whole rotation, their own rotations only its yaw: they
        # stay upright in a bowl that is tilted.
        turn = euler_matrix(rotation) @ item.matrix.T
        yaw = float(rotation[1] - item.rotation[1])
        pivot = item.position.copy()
        for part in self.descendants(item):
            part.position = position + turn @ (part.position - pivot)
            part.rotation = np.array(
                [part.rotation[0], (part.rotation[1] + yaw) % 360, part.rotation[2]]
            )
            self.mark_changed(part)
        item.position, item.rotation = (
            np.asarray(position, dtype=float),
            np.asarray(rotation, dtype=float),
        )
        self.mark_changed(item)

    def keep_templates(self) -> None:
        """Keep copies of loose objects, for SetObjectPoses after they are removed."""
        self.templates = {}
        for item in self.objects.values():
            if item.type.pickupable:
                self.templates.setdefault(item.object_type, []).append(
                    item.duplicate(item.object_id)
                )

    def is_hidden(self, item: SimObject) -> bool:
        """Return whether the object is inside something closed."""
        return any(outer.type.encloses and outer.type.openable and outer.state.openness == 0
                   for outer in self.ancestors(item))  # fmt: skip

    def distance(self, item: SimObject) -> float:
        """Return metres from the agent to the object's origin, as the metadata reports it."""
        return float(np.linalg.norm(item.position - self.agent.position))

    def reach(self, item: SimObject) -> float:
        """Return horizontal metres from the agent to the nearest point of the object's box."""
        low, high = item.bounds()
        return aabb_gap(self.agent.position[[0, 2]], low[[0, 2]], high[[0, 2]])

    def scene_bounds(self) -> tuple[Array, Array]:
        """Return the low and high corner of the box around all rooms, metres."""
        low = [
            min(r.x_min for r in self.rooms),
            min(r.floor for r in self.rooms),
            min(r.z_min for r in self.rooms),
        ]
        high = [
            max(r.x_max for r in self.rooms),
            max(r.height for r in self.rooms),
            max(r.z_max for r in self.rooms),
        ]
        return np.array(low), np.array(high)
