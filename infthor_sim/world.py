"""The state of one scene: its objects, its agents, and which object contains which."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from infthor_sim.agent import HAND_AT_REST, Agent, Grip
from infthor_sim.arm.arm import Arm
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, aabb_gap, euler_matrix, matrix_euler
from infthor_sim.objects import SimObject
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.pictures.appearance import Appearance

FLOOR_STYLES = ("wood", "tiles", "carpet")


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
        door: a closed door that is only drawn, as in AI2-THOR's rooms: its side and middle.
        rug: what is drawn of a rug: x_min, x_max, z_min, z_max.
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
    door: tuple[str, float] | None = None
    rug: tuple[float, float, float, float] | None = None


@dataclass
class World:
    """A scene as it is now.

    Attributes:
        scene: name of the scene.
        objects: objects by id, in the order of the metadata.
        nav: cells where an agent can stand.
        floor: all cells that are free of walls and furniture, of which doors take some; None where
            no door is.
        agents: its agents, in the order of their ids.
        active: id of the agent that acts, or whose part of a reply is made.
        seed: seed of the scene's random numbers.
        version: number that grows with every change; cached views compare it.
        version_around: the version since which nothing changed but the pose of what the only agent
            carries in its hand.
        coarse: the shapes of its furniture are only known as boxes, as in recordings.
        walls: walls of rooms that are not `walled`.
        open_at_start: ids of the objects that are open in the recording; its cells already go
            around them.
        templates: copies of the loose objects as the scene first had them, by type.
        keeps_ids: objects keep their ids, which are not made of positions, as in ProcTHOR's houses.
        arm: the arm of the only agent; None for agents that hold things in front of their camera.
        disabled: objects that are out of the scene until they are enabled again, by id.
        appearance: randomized looks.
        standing_height: height in metres of the agent's position on the floor.
    """

    scene: str
    objects: dict[str, SimObject]
    rooms: tuple[RoomShell, ...]
    nav: NavGrid
    agents: list[Agent]
    active: int = 0
    seed: int = 0
    version: int = 0
    version_around: int = 0
    coarse: bool = False
    floor: NavGrid | None = None
    walls: tuple[Wall, ...] = ()
    open_at_start: frozenset[str] = frozenset()
    templates: dict[str, list[SimObject]] = field(default_factory=dict)
    keeps_ids: bool = False
    arm: Arm | None = None
    disabled: dict[str, SimObject] = field(default_factory=dict)
    appearance: Appearance = field(default_factory=Appearance)
    standing_height: float = field(init=False)

    def __post_init__(self) -> None:
        self.standing_height = float(self.agent.position[1])

    @property
    def agent(self) -> Agent:
        """The active agent."""
        return self.agents[self.active]

    def others(self) -> list[tuple[int, Agent]]:
        """Return the ids of the agents that are not active, and the agents."""
        return [(index, a) for index, a in enumerate(self.agents) if index != self.active]

    def get(self, object_id: str) -> SimObject:
        """Return the object with this id."""
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
        self.version_around = self.version
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
        self._take_out_of_hands(item)
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
        for agent in self.agents:
            agent.held = None if agent.held is None else new(agent.held)
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
        """Move what the active agent holds, and all it contains, along with it.

        Args:
            keep_grip: leave the object as it was moved in the hand; else the hand returns to its
                usual place.
        """
        agent = self.agent
        if not keep_grip:
            agent.grip = None
            agent.hand = HAND_AT_REST
        if agent.held is not None:
            item = self.objects[agent.held]
            around = self.version_around
            self.set_pose(item, *self._held_pose(item))
            if len(self.agents) == 1:  # another one sees it move
                self.version_around = around
        if self.arm is not None:
            wrist = self.arm.wrist(agent)
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
        """Return the ids of what agents hold in their hands or with an arm, without contents."""
        in_hands = [agent.held for agent in self.agents if agent.held is not None]
        return in_hands if self.arm is None else [*in_hands, *self.arm.held]

    def _held_pose(self, item: SimObject) -> tuple[Array, Array]:
        agent = self.agent
        camera = agent.camera_matrix()
        if agent.grip is None:  # upright, turned with the agent, its origin at the hand
            hand = agent.camera_position() + camera @ HAND_AT_REST.offset
            return hand, np.array([0.0, agent.yaw, 0.0])
        return agent.camera_position() + camera @ agent.grip.offset, matrix_euler(
            camera @ agent.grip.turn
        )

    def release(self) -> None:
        """Let go of everything that the active agent holds; it stays where it is."""
        held = [] if self.arm is None else list(self.arm.held)
        if self.agent.held is not None:
            held.append(self.agent.held)
        for object_id in held:
            self.let_go(self.objects[object_id])

    def let_go(self, item: SimObject) -> None:
        """Let go of one object, if it is held, with its contents; it stays where it is."""
        self._take_out_of_hands(item)
        if self.arm is not None:
            for part in (item, *self.descendants(item)):
                part.state.picked_up = part.state.picked_up and part.object_id not in self.arm.held
                self.arm.let_go(part.object_id)
        item.state.picked_up = False
        self.mark_changed(item)

    def _take_out_of_hands(self, item: SimObject) -> None:
        for agent in self.agents:
            if agent.held == item.object_id:
                agent.empty_hand()

    def move_hand(self, hand: Grip) -> None:
        """Move the active agent's hand to a pose in the camera's frame, with what it holds."""
        agent = self.agent
        assert agent.held is not None
        item = self.objects[agent.held]
        camera = agent.camera_matrix()
        offset = (
            camera.T @ (item.position - agent.camera_position()) + hand.offset - agent.hand.offset
        )
        agent.grip = Grip(offset, hand.turn @ agent.hand.turn.T @ camera.T @ item.matrix)
        agent.hand = hand
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
        """Return metres from the active agent to an object's origin, as the metadata has it."""
        return float(np.linalg.norm(item.position - self.agent.position))

    def reach(self, item: SimObject) -> float:
        """Return level metres from the active agent to the nearest point of an object's box."""
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
