"""What the simulator knows of one type of object: a record that declares everything, so that a new type is one entry.

The abilities bear the names of AI2-THOR's documentation. Scenes read from recordings bring the abilities of their own
objects; the record serves procedural scenes, objects that a recording names without describing, and all other rules.
"""

from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import Any

__all__ = ["ObjectType", "Unfolding", "portable"]


@dataclass(frozen=True)
class Unfolding:
    """How opening changes the box of a thing along one of its axes, in proportion to the openness.

    Attributes:
        axis: 0, 1 or 2: across, up, or towards its front.
        stays: the end of the box that stays where it is, -1 or 1; 0: its middle.
        closed: extent when closed, as a share of that when wide open.
        reach: metres that wide opening adds whatever the extent.
    """

    axis: int
    stays: int
    closed: float = 1.0
    reach: float = 0.0

    def extent(self, size: float, before: float, after: float) -> float:
        """Extent in metres at openness `after` of what measures `size` at openness `before`."""
        share = (self.closed + (1 - self.closed) * after) / (self.closed + (1 - self.closed) * before)
        return (size - self.reach * before) * share + self.reach * after


@dataclass(frozen=True)
class ObjectType:
    """One type of object; what is not declared is not so.

    Attributes:
        name: AI2-THOR's `objectType`.
        size: usual width, height and depth in metres, front towards z: medians over AI2-THOR's rooms.
        shape: name of the function in `render/shapes` that draws it.
        categories: what it counts as where receptacles tell what they take.
        takes: categories and types that may be put into or onto it; None: everything that can be picked up.
        refuses: categories and types that may not be.
        encloses: it hides its contents while it is closed.
        support: share of its height at which things stand on it; None: its top.
        space_below: boxes lower than this (metres) are the space above the surface, as recorded counters are.
        centered: its origin is in the middle of its box, not of its underside.
        open_top: share of its width that is open at the top; 0: nothing stands inside its box.
        levels: shares of its height at which things stand inside it.
        overhang: things may stick out beyond its edge however far.
        hinged: it opens a door that stands in the agent's way.
        slides: it slides out with its contents, as drawers do.
        unfolds: how its box changes as it opens, where it has no door and does not slide.
        runs_closed: it must be closed to be switched on, and switched off to be opened.
        switched_by: type of what switches it; it has no switch of its own.
        slice_type: what it falls into when cut.
        slices: into how many, the highest number seen in ALFRED's recordings, or above.
        cracks: it breaks into its slices, which do not count as sliced.
        pours: liquid that it fills the vessels on it with.
        runs_water: it cleans and fills what stands in the basin below it.
        basin: water gathers in it.
        light: brightness of its lamp.
        furniture: recordings of other versions may know it as another type of furniture.
        fitted: it stands inside furniture, whose front it is.
        stacked: others of its type stand right above it.
        cut_out: its plan is cut out where a sink or basin is.
        tall: it stands through counters.
        faces_room: the axes of its box do not tell its front; other things face +z of their own frame.
        flat: its front is its thin side.
        yields: what lies on it tells how high its surface is, as its box does not.
        beyond_room: it reaches beyond the room's walls or floor.
        starts_open: rooms have it open, and its size is measured so.
        stock: loose things that a procedural room puts into or onto it at most; None: it is not even considered.
    """

    name: str
    size: tuple[float, float, float] = (0.3, 0.3, 0.3)
    _: KW_ONLY
    shape: str = "box"
    categories: tuple[str, ...] = ()
    # as AI2-THOR's metadata has it
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
    # what stands in or on it, and where
    takes: tuple[str, ...] | None = None
    refuses: tuple[str, ...] = ()
    encloses: bool = False
    support: float | None = None
    space_below: float = 0.0
    centered: bool = False
    open_top: float = 0.0
    levels: tuple[float, ...] = ()
    overhang: bool = False
    # what it does
    hinged: bool = False
    slides: bool = False
    unfolds: tuple[Unfolding, ...] = ()
    runs_closed: bool = False
    switched_by: str = ""
    slice_type: str = ""
    slices: int = 0
    cracks: bool = False
    pours: str = ""
    runs_water: bool = False
    basin: bool = False
    light: float = 0.0
    # its part in a scene
    furniture: bool = False
    fitted: bool = False
    stacked: bool = False
    cut_out: bool = False
    tall: bool = False
    faces_room: bool = False
    flat: bool = False
    yields: bool = False
    beyond_room: bool = False
    starts_open: bool = False
    stock: int | None = 99

    def __deepcopy__(self, memo: dict[int, Any]) -> "ObjectType":
        """Itself, as nothing changes it: saved states share the records."""
        return self

    def support_height(self, height: float) -> float | None:
        """Height in metres above the underside of a box `height` metres high at which things stand; None: its top."""
        if height < self.space_below:
            return 0.0
        return None if self.support is None else self.support * height

    def counts_as(self, words: tuple[str, ...]) -> bool:
        """Whether one of these words is its name or one of its categories."""
        return self.name in words or any(category in words for category in self.categories)

    def accepts(self, item: "ObjectType") -> bool:
        """Whether AI2-THOR lets an object of type `item` be put into or onto one of this type."""
        if not (self.receptacle and item.pickupable) or item.counts_as(self.refuses):
            return False
        return self.takes is None or item.counts_as(self.takes)


portable = partial(ObjectType, pickupable=True, mass=0.5)
"""A type that can be picked up; half a kilogram unless told."""
