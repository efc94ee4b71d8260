"""One object of the world: its pose, its box and its state."""

from dataclasses import dataclass, field, replace

import numpy as np

from infthor_sim.geometry import Array, corners, euler_matrix, object_id
from infthor_sim.object_types import ObjectType, type_named
from infthor_sim.physics.footprints import Rect

DOOR_SWING = 85.0  # degrees that a door opens
DRAWER_SLIDE = 0.8  # share of its depth that a drawer comes out
_DOUBLE = 1.5  # metres: wider doorways have two leaves
WALL = 0.02  # thickness in metres of the sides and floors of hollow things


@dataclass
class SimObjectState:
    """What actions change about an object but its pose; names are as in AI2-THOR's metadata."""

    openness: float = 0.0
    toggled: bool = False
    broken: bool = False
    fill_liquid: str | None = None
    dirty: bool = False
    used_up: bool = False
    cooked: bool = False
    sliced: bool = False
    picked_up: bool = False
    temperature: str = "RoomTemp"


@dataclass(eq=False)
class SimObject:
    """An object, its pose and its state.

    Attributes:
        object_id: id; it stays the same when the object moves, though it names the first position.
        name: AI2-THOR's name of the object, unlike the id not made of its position.
        type: record of the object's type.
        position: origin of the object in the world, metres (3,).
        rotation: Unity's Euler angles in degrees (3,).
        box_center: centre of the box in the object's own frame, metres (3,).
        box_size: extents of the box in the object's own frame, metres (3,).
        asset_id: AI2-THOR's name of the model; empty for procedural objects.
        front: yaw in degrees of the object's front relative to its own frame; doors and drawers
            open that way.
        support: height in metres above the bottom of the box where things stand on it; None: the
            top of the box.
        hinge: -1 or 1, the side of the door's hinge seen from the front; 0 without a hinge.
        pieces: rectangles that the object covers seen from above, metres from the box's middle in
            the object's own frame; empty if it covers its whole box.
        hollow: its front is drawn open, as drawers or doors that are separate objects fill it.
        style: index that varies colours between objects of one type.
        parent: id of the receptacle that contains it.
        controls: ids of the objects that its switch controls, as a knob its burner.
        contents: ids of the objects that it contains directly.
        unbreakable: no fall breaks it.
        version: number of its last change, see `World.mark_changed`.
    """

    object_id: str
    name: str
    type: ObjectType
    position: Array
    rotation: Array
    box_center: Array
    box_size: Array
    asset_id: str = ""
    front: float = 0.0
    support: float | None = None
    hinge: int = 0
    pieces: tuple[Rect, ...] = ()
    hollow: bool = False
    style: int = 0
    parent: str | None = None
    controls: tuple[str, ...] = ()
    state: SimObjectState = field(default_factory=SimObjectState)
    contents: list[str] = field(default_factory=list)
    unbreakable: bool = False
    version: int = 0
    _bounds: tuple[bytes, Array, Array] | None = field(default=None, init=False, repr=False)

    @property
    def object_type(self) -> str:
        """Name of the type."""
        return self.type.name

    @property
    def matrix(self) -> Array:
        """Rotation matrix (3, 3) of the object."""
        return euler_matrix(self.rotation)

    @property
    def center(self) -> Array:
        """Centre of the box in the world, metres (3,)."""
        return self.position + self.matrix @ self.box_center

    @property
    def front_size(self) -> Array:
        """Width, height and depth of the box seen from its front, metres (3,)."""
        return self.box_size[[2, 1, 0]] if round(self.front / 90) % 2 else self.box_size

    @property
    def leaf_sides(self) -> tuple[int, ...]:
        """The sides that leaves of its door hang at, -1 and 1 seen from its front."""
        if self.type.in_doorway and self.front_size[0] > _DOUBLE:
            return (-1, 1)
        return (self.hinge or -1,)

    def oriented_corners(self) -> Array:
        """Return the 8 corners (8, 3) of the box, turned with the object."""
        return corners(self.center, self.box_size, self.matrix)

    def bounds(self) -> tuple[Array, Array]:
        """Return the low and high corner of the axis-aligned box in the world, metres."""
        # Nearly every rule asks for bounds, and poses are replaced in many places. The arrays'
        # bytes are the key, so that no setter can be forgotten.
        key = b"".join(
            a.tobytes() for a in (self.position, self.rotation, self.box_center, self.box_size)
        )
        if self._bounds is None or self._bounds[0] != key:
            points = self.oriented_corners()
            self._bounds = (key, points.min(axis=0), points.max(axis=0))
        return self._bounds[1], self._bounds[2]

    def surface_height(self) -> float:
        """Return the world height in metres of the surface that things stand on."""
        low, high = self.bounds()
        return float(high[1] if self.support is None else low[1] + self.support)

    @property
    def floors(self) -> tuple[float, ...]:
        """Heights above its box's underside at which contents stand in it, metres, lowest first.

        Placement and drawing both take them from here. Empty if nothing stands inside.
        """
        height = float(self.box_size[1])
        if self.type.levels:
            return tuple(share * height for share in self.type.levels)
        if self.type.open_top:  # a vessel: its only surface is its bottom
            return (max(min(WALL, height * 0.3), self.support or 0.0),)
        return ()

    def place_bottom(self, point: Array) -> None:
        """Move the object: the middle of its box's underside to `point` (world, metres)."""
        low, high = self.bounds()
        middle = (low + high) / 2
        self.position = self.position + np.array(
            [point[0] - middle[0], point[1] - low[1], point[2] - middle[2]]
        )

    def duplicate(self, object_id: str) -> "SimObject":
        """Return a copy with its own state, another id, and neither parent nor contents."""
        return replace(
            self,
            object_id=object_id,
            position=self.position.copy(),
            rotation=self.rotation.copy(),
            state=replace(self.state),
            contents=[],
            parent=None,
        )


def style_of(name: str) -> int:
    """Return a number that varies colours; always the same for the same name."""
    return sum(ord(letter) * (index + 1) for index, letter in enumerate(name))


def default_object(
    object_type: str, position: Array, yaw: float = 0.0, size: Array | None = None
) -> SimObject:
    """Return an object of its type's usual size, or of another."""
    declared = type_named(object_type)
    box = np.array(declared.size if size is None else size, dtype=float)
    new_id = object_id(object_type, position)
    return SimObject(
        object_id=new_id,
        name=f"{object_type}_{style_of(new_id):08x}",
        type=declared,
        position=np.asarray(position, dtype=float).copy(),
        rotation=np.array([0.0, yaw % 360.0, 0.0]),
        box_center=np.zeros(3) if declared.centered else np.array([0.0, box[1] / 2, 0.0]),
        box_size=box,
        support=declared.support_height(float(box[1])),
        style=style_of(new_id),
        state=SimObjectState(openness=1.0 if declared.starts_open else 0.0),
    )
