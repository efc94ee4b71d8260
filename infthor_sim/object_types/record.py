"""The record of one type of object, which declares everything the simulator knows of it.

Abilities have the names of AI2-THOR's documentation. Recorded scenes override them with those of
their own objects. The record serves procedural scenes, objects that a recording names without
describing, and all other rules.
"""

from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import Any

PLAIN_BOX = "box"
"""The shape of types that name none: a box as large as they are."""


@dataclass(frozen=True)
class Unfolding:
    """A change of an object's box along one of its axes, in proportion to the openness.

    Attributes:
        axis: 0, 1 or 2: across, up, or towards the front.
        stays: end of the box that stays in place, -1 or 1; 0: its middle.
        closed: extent when closed, as a share of that when wide open.
        reach: metres that wide opening adds, whatever the extent.
    """

    axis: int
    stays: int
    closed: float = 1.0
    reach: float = 0.0

    def extent(self, size: float, before: float, after: float) -> float:
        """Return metres at openness `after` of what measures `size` at openness `before`."""
        share = (self.closed + (1 - self.closed) * after) / (
            self.closed + (1 - self.closed) * before
        )
        return (size - self.reach * before) * share + self.reach * after


@dataclass(frozen=True)
class ObjectType:
    """One type of object; the defaults are those of a thing without abilities.

    Attributes:
        name: AI2-THOR's `objectType`.
        size: usual width, height and depth in metres, front towards z: medians over AI2-THOR's
            rooms.
        shape: name of the function in `render/shapes` that draws it.
        categories: categories that receptacles may name in `takes` and `refuses`.
        takes: categories and types that may be put into or onto it; None: everything that can be
            picked up.
        refuses: categories and types that may not be.
        encloses: it hides its contents while it is closed.
        support: share of its height at which things stand on it; None: its top.
        area: part of its box, seen from above, on which things stand: x0, z0, x1, z1 as shares of
            its half extents, -1 to 1 in its own frame; None: all of it.
        handled: a handle sticks out at one end of its longer side; the rest is as long as it is
            wide.
        space_below: boxes lower than this (metres) are the space above the surface, as recorded
            counters are.
        centered: its origin is in the middle of its box, not of its underside.
        open_top: share of its width that is open at the top; 0: nothing stands inside its box.
        levels: shares of its height at which things stand inside it.
        overhang: things may stick out beyond its edge any distance.
        hinged: it opens a door that can block the agent.
        in_doorway: it fills a doorway of a wall; what is hinged of it takes floor, open or closed.
        slides: it slides out with its contents, as drawers do.
        unfolds: changes of its box with opening, for types without door or drawer.
        lid: length of a lid that is hinged at its back and stands up when open, as a share of its
            depth; 0: no lid.
        runs_closed: it must be closed to be switched on, and switched off to be opened.
        switched_by: type of the object that switches it; it has no switch of its own.
        slice_type: type of its slices.
        slices: number of its slices: the highest number seen in ALFRED's recordings, or above.
        cracks: it breaks into its slices, which do not count as sliced.
        pours: liquid that it fills vessels on it with.
        runs_water: it cleans and fills what stands in the basin below it.
        basin: water gathers in it.
        light: brightness of its lamp.
        furniture: recordings of other versions may know it as another type of furniture.
        built_in: it is part of a piece of furniture, as its door, drawer or shelf.
        stacked: others of its type are right above it.
        has_cutouts: sinks and basins are cut out of it.
        tall: it reaches from the floor through counters.
        faces_room: its front cannot be told from the axes of its box; other types face +z of their
            own frame.
        flat: its front is its thin side.
        infer_support: its surface height is inferred from what lies on it, as its box includes
            backs and the like.
        beyond_room: it reaches beyond the room's walls or floor.
        starts_open: rooms have it open, and its size is measured open.
        capacity: loose objects that a procedural room puts into or onto it at most; None: it is
            never considered.
    """

    name: str
    size: tuple[float, float, float] = (0.3, 0.3, 0.3)
    _: KW_ONLY
    shape: str = PLAIN_BOX
    categories: tuple[str, ...] = ()
    # abilities, as in AI2-THOR's metadata
    pickupable: bool = False
    moveable: bool = False
    receptacle: bool = False
    openable: bool = False
    toggleable: bool = False
    breakable: bool = False
    fillable: bool = False
    dirtyable: bool = False
    usable_up: bool = False
    cookable: bool = False
    sliceable: bool = False
    heat_source: bool = False
    cold_source: bool = False
    mass: float = 0.0
    materials: tuple[str, ...] = ()
    # as a receptacle
    takes: tuple[str, ...] | None = None
    refuses: tuple[str, ...] = ()
    encloses: bool = False
    support: float | None = None
    area: tuple[float, float, float, float] | None = None
    handled: bool = False
    space_below: float = 0.0
    centered: bool = False
    open_top: float = 0.0
    levels: tuple[float, ...] = ()
    overhang: bool = False
    # behaviour
    hinged: bool = False
    in_doorway: bool = False
    slides: bool = False
    unfolds: tuple[Unfolding, ...] = ()
    lid: float = 0.0
    runs_closed: bool = False
    switched_by: str = ""
    slice_type: str = ""
    slices: int = 0
    cracks: bool = False
    pours: str = ""
    runs_water: bool = False
    basin: bool = False
    light: float = 0.0
    # in scenes
    furniture: bool = False
    built_in: bool = False
    stacked: bool = False
    has_cutouts: bool = False
    tall: bool = False
    faces_room: bool = False
    flat: bool = False
    infer_support: bool = False
    beyond_room: bool = False
    starts_open: bool = False
    capacity: int | None = 99

    def __deepcopy__(self, memo: dict[int, Any]) -> "ObjectType":
        """Return the record itself: it is never changed, so saved states can share it."""
        return self

    def support_height(self, height: float) -> float | None:
        """Return the height at which things stand above a box's underside; None: its top."""
        if height < self.space_below:
            return 0.0
        return None if self.support is None else self.support * height

    def counts_as(self, words: tuple[str, ...]) -> bool:
        """Return whether one of these words is its name or one of its categories."""
        return self.name in words or any(category in words for category in self.categories)

    def accepts(self, item: "ObjectType") -> bool:
        """Return whether AI2-THOR lets a type `item` be put into or onto this one."""
        if not (self.receptacle and item.pickupable) or item.counts_as(self.refuses):
            return False
        return self.takes is None or item.counts_as(self.takes)


portable = partial(ObjectType, pickupable=True, mass=0.5)
"""A type that can be picked up, by default of half a kilogram."""
