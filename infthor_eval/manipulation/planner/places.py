"""Places in or on a receptacle, and whether a released object would come to rest there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.geometry import Corners, middle_of, point_of, size_of
from infthor_eval.manipulation.planner.linkage import Array, Parts
from infthor_eval.thor.view import SimulatorView, ThorObject

# Types of receptacles that are entered from the front.
ENTERED = {"Fridge", "Microwave", "Cabinet", "Safe", "CoffeeMachine", "Shelf", "ShelvingUnit"}
_SPACING = 0.05  # metres between places if there is only one
_SUNK = 0.05  # metres that an object may be below its places, as boxes are inexact
_LEVEL = 0.01  # metres within which places are on one board
_BREADTH = 0.05  # metres from the foremost places to the opening
_THIN = 0.05  # metres above its topmost places from which a receptacle has a roof
_SHRUNK = 0.9  # of the held object's box, whose outermost corners may stick out
# radius in units of the spacing, and the number of places within it around an inner one
_FIRM = 1.1
_WHOLE = 4.0
_BESIDE = 0.5  # occupancy of a place at which another object would be touched
_OVER = 0.75  # distance to a place, in units of the spacing, within which a point is over the board


@dataclass(frozen=True)
class Places:
    """Points at which things can stand in or on a receptacle.

    Attributes:
        points: positions, metres (n, 3).
        spacing: distance from one to the next, metres.
        top: top of the receptacle's box, metres.
        entered: whether it is entered from the front, so that it may have a roof.
    """

    points: Array
    spacing: float
    top: float
    entered: bool = False

    @property
    def heights(self) -> list[float]:
        """Heights of the boards, ascending."""
        return sorted(set(np.round(self.points[:, 1], 3).tolist()))

    def level(self, height: float) -> Array:
        """Return the places of one board (n, 3)."""
        chosen: Array = self.points[np.abs(self.points[:, 1] - height) < _LEVEL]
        return chosen

    def is_roofed(self, height: float) -> bool:
        """Return whether the receptacle extends over the places of one of its boards."""
        return height < self.heights[-1] - _LEVEL or (self.entered and self.top > height + _THIN)

    def ceiling(self, height: float) -> float:
        """Return the height of the ceiling over a board: the next board, or the top."""
        above = [other for other in self.heights if other > height + _LEVEL]
        return above[0] if above else self.top


@dataclass(frozen=True)
class Entry:
    """An opening at the front of a receptacle.

    Attributes:
        axis: axis along which one leaves it: 0 for x, 2 for z.
        sign: direction along that axis.
        position: coordinate of the opening on that axis, metres.
    """

    axis: int
    sign: int
    position: float

    def vector_out(self, metres: float) -> Array:
        """Return a vector out of the opening (3,)."""
        vector = np.zeros(3)
        vector[self.axis] = self.sign * metres
        return vector


def places_of(environment: ArmEnvironment, receptacle: ThorObject) -> Places | None:
    """Return a receptacle's places, as the simulator reports them; None if it has none."""
    answer = environment.query(
        "GetSpawnCoordinatesAboveReceptacle", objectId=receptacle.object_id, anywhere=True
    )
    if not answer:
        return None
    points = np.array([(place["x"], place["y"], place["z"]) for place in answer], dtype=float)
    top = middle_of(receptacle)[1] + size_of(receptacle)[1] / 2
    return Places(points, _spacing(points), top, is_entered(receptacle))


def _spacing(points: Array) -> float:
    """Return the metres from a place to the next one of the same board."""
    board = points[np.abs(points[:, 1] - points[0, 1]) < _LEVEL]
    apart = np.linalg.norm(board[1:] - board[0], axis=1)
    apart = apart[apart > _LEVEL]
    return float(apart.min()) if len(apart) else _SPACING


def is_entered(receptacle: ThorObject) -> bool:
    """Return whether objects are brought into a receptacle from its front."""
    return receptacle.object_type in ENTERED


def entry_of(view: SimulatorView, receptacle: ThorObject, places: Places) -> Entry | None:
    """Return the opening of a receptacle that is entered from the front; None for others.

    The metadata have no direction of it. An open door extends the box on that side, so the box's
    middle is off the places' middle towards the opening. A receptacle without a door is open
    towards the agent.
    """
    if not is_entered(receptacle):
        return None
    low = places.points.min(axis=0)
    high = places.points.max(axis=0)
    towards = middle_of(receptacle) if receptacle.openable else point_of(view.agent.position)
    way = np.array(towards) - (low + high) / 2
    axis = 0 if abs(way[0]) > abs(way[2]) else 2
    sign = 1 if way[axis] > 0 else -1
    return Entry(axis, sign, float((high if sign > 0 else low)[axis]) + sign * _BREADTH)


def others_on(view: SimulatorView, receptacle: ThorObject, held: str) -> list[ThorObject]:
    """Return loose objects that may be in or on a receptacle, not the held one or its holders."""
    around = {
        name
        for name, other in view.objects.items()
        if receptacle.object_id in (other.receptacle_object_ids or ())
    }
    apart = {held, receptacle.object_id, *around, *(receptacle.parent_receptacles or ())}
    return [other for name, other in view.objects.items() if name not in apart and other.pickupable]


def support(held: Parts, places: Places) -> Array:
    """Return the share (n,) of held boxes (n, 1) over a board below; 0 if the middle is not."""
    corners = held.axes[:, 0].transpose(0, 2, 1)[:, None] @ (_CORNERS * held.half)[..., None]
    spots = (held.center + _SHRUNK * corners[..., 0])[:, :, [0, 2]]
    bottom = held.center[:, 0, 1] - (np.abs(held.axes[:, 0, :, 1]) * held.half[:, 0]).sum(axis=1)
    supported = np.zeros(len(spots))
    for height in places.heights:
        above = bottom > height
        if places.is_roofed(height):
            above &= bottom < places.ceiling(height)
        if above.any():
            board = places.level(height)[:, [0, 2]]
            apart = np.linalg.norm(spots[above][:, :, None] - board, axis=-1).min(axis=-1)
            on = apart <= _OVER * places.spacing
            supported[above] = np.where(on[:, 0], on.mean(axis=1), supported[above])
    return supported


_CORNERS: Array = np.array(
    [(0, 0, 0), *((x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))], dtype=float
)


def occupancy(held: Parts, places: Places, others: Sequence[Corners]) -> Array:
    """Return how much (n,) a place is occupied: 1 if the middle falls on an object, 1/2 beside it.

    Args:
        held: box of the held object in some poses (n, 1).
        others: boxes of objects that may stand there, or be over it; one that begins below the
            places is not on them.
    """
    if not others:
        return np.zeros(len(held.center))
    low = np.array([box.low for box in others])
    high = np.array([box.high for box in others])
    extent = (np.abs(held.axes[:, 0]) * held.half[:, 0, :, None]).sum(axis=-2)
    middle = held.center[:, 0]
    bottom = middle[:, 1] - extent[:, 1]
    top = middle[:, 1] + extent[:, 1]
    grounds = np.array(places.heights)
    ground = np.where(grounds <= bottom[:, None], grounds, -np.inf).max(axis=1)[:, None]
    level = (
        (low[:, 1] <= top[:, None]) & (high[:, 1] > ground + _LEVEL) & (low[:, 1] > ground - _SUNK)
    )
    apart = np.maximum(low - middle[:, None], middle[:, None] - high)[:, :, [0, 2]]
    over = level & (apart <= 0).all(axis=-1)
    beside = level & (apart <= extent[:, None, [0, 2]]).all(axis=-1)
    occupied: Array = np.maximum(over.any(axis=1) * 1.0, beside.any(axis=1) * _BESIDE)
    return occupied


def firmness(held: Parts, places: Places) -> Array:
    """Return how far (n,) the held object's middle is from the boards' edge, from 0 to 1."""
    middles = held.center[:, 0]
    apart = np.abs(middles[:, None, [0, 2]] - places.points[None, :, [0, 2]])
    near = np.linalg.norm(apart, axis=-1) <= _FIRM * places.spacing
    around = near.sum(axis=1) / len(places.heights)
    firm: Array = np.minimum(around, _WHOLE) / _WHOLE
    return firm
