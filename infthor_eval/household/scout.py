"""Finding where to stand so that an object can be seen and acted on.

Candidates come from geometry; whether one does is asked of the simulator itself, by teleporting there and
back. That moves nothing but the agent, so it leaves no trace in a trajectory.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import SimulatorError
from infthor_eval.household.navigation import Grid, GridPose
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.teleport import teleport_call
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector

__all__ = ["CAMERA_HEIGHT", "HORIZON_STEP", "Viewpoint", "find_viewpoint", "grid_pose_of", "reachable_grid"]

CAMERA_HEIGHT = 0.675  # of the camera above the agent's position, metres
HORIZON_STEP = 30
_HORIZONS = (-30, 0, 30, 60)
_REACH = 1.5  # the simulator's visibility distance, metres
_SIDEWAYS = 32.0  # degrees off the camera's axis; half the field of view is 30
_TOO_NEAR = 0.5  # closer than this a door may hit the agent and an object fills the frame
_TRIALS = 30
_PATIENCE = 4  # viewpoints more that are tried for one that has a small object well inside the frame
_MARGIN, _SIDE = 15, 300  # pixels: of the frame's edge, and of the frame
_UNSEEN: dict[str, Any] = {"renderImage": False}  # the id image tells what is in the frame


@dataclass(frozen=True)
class Viewpoint:
    """A stand and the camera's horizon (degrees downwards)."""

    pose: GridPose
    horizon: int


def find_viewpoint(
    simulator: Simulator,
    grid: Grid,
    shown: list[str],
    inside: str | None = None,
    min_pixels: int = 0,
) -> Viewpoint | None:
    """The viewpoint that is the fewest actions away and from which all asked objects are visible.

    One a little farther away is taken where it has an object that can be carried well inside the frame, and not at the
    edge: what is done with it then can be seen.

    Args:
        simulator: its agent is back where it was afterwards.
        grid: the reachable cells.
        shown: ids of the objects that must be visible; the first is what the agent faces.
        inside: id of an object that is hidden in the first and must come into view when that is opened.
        min_pixels: how large the first must appear in the frame.

    Returns:
        None where no candidate does.
    """
    here = simulator.view
    focus = here.objects[inside or shown[0]]
    distances = grid.distances(grid_pose_of(here.agent, grid))
    found, patience = None, _PATIENCE
    for viewpoint in list(_candidates(here, grid, focus, distances))[:_TRIALS]:
        there = _teleport(simulator, grid, here, viewpoint)
        shows = there.success and _shows(there, shown, min_pixels)
        if shows and (inside is None or _comes_into_view(simulator, shown[0], inside, min_pixels)):
            well = inside is not None or not focus.pickupable or _is_well_inside(there, shown[0])
            found = viewpoint if well or found is None else found
            if well:
                break
        patience -= found is not None
        if not patience:
            break
    simulator.query(**teleport_call(here.agent), **_UNSEEN)
    return found


def reachable_grid(simulator: Simulator) -> Grid:
    """The cells that the agent can reach as things are now."""
    positions = simulator.query("GetReachablePositions", **_UNSEEN).result or ()
    return Grid((position["x"], position["z"]) for position in positions)


def grid_pose_of(pose: AgentPose, grid: Grid) -> GridPose:
    """The stand of a pose."""
    return GridPose(grid.cell(pose.position.x, pose.position.z), round(pose.rotation / 90) * 90 % 360)


def _shows(view: SimulatorView, shown: list[str], min_pixels: int) -> bool:
    if not all(key in view.objects and view.objects[key].visible for key in shown):
        return False
    instances = view.instances
    return instances is None or (shown[0] in instances and instances[shown[0]].pixels >= min_pixels)


def _is_well_inside(view: SimulatorView, item: str) -> bool:
    """Whether the frame has an object off its edges."""
    shown = (view.instances or {}).get(item)
    return shown is None or all(_MARGIN <= edge < _SIDE - _MARGIN for edge in shown.box)


def _comes_into_view(simulator: Simulator, holder: str, inside: str, min_pixels: int) -> bool:
    """Whether opening a receptacle shows an object in it, and it can be closed from here; it is closed again."""
    opened = simulator.query("OpenObject", objectId=holder, **_UNSEEN)
    if not opened.success:
        return False
    shown = _shows(opened, [inside], min_pixels)
    if simulator.query("CloseObject", objectId=holder, **_UNSEEN).success:
        return shown
    # Where an open drawer is out of sight it must not stay open: a trajectory has no action that opened it.
    if not simulator.query("CloseObject", objectId=holder, forceAction=True, **_UNSEEN).success:
        raise SimulatorError(f"{holder} was opened to look into it and cannot be closed again; choose another scene")
    return False


def _candidates(
    view: SimulatorView, grid: Grid, focus: ThorObject, distances: dict[GridPose, int]
) -> Iterator[Viewpoint]:
    """Viewpoints from which the object should be in the frame, the nearest to walk to first."""
    target = _middle(focus)
    eye = view.agent.position.y + CAMERA_HEIGHT
    ranked = []
    for stand, length in distances.items():
        flat, aside = _bearing(grid.position(stand.cell), stand.facing, target)
        if flat > _REACH or aside > _SIDEWAYS:
            continue
        down = math.degrees(math.atan2(eye - target.y, max(flat, 0.1)))
        # Worse: standing too near, or the object at the edge of the frame.
        penalty = 4 * (flat < _TOO_NEAR) + aside / 15
        for horizon in sorted(_HORIZONS, key=lambda angle: abs(angle - down))[:2]:
            off = abs(horizon - down)
            turns = abs(horizon - view.agent.horizon) / HORIZON_STEP
            ranked.append((length + turns + penalty + off / 10, stand, horizon))
    for _, stand, horizon in sorted(ranked):
        yield Viewpoint(stand, horizon)


def _bearing(position: tuple[float, float], facing: int, target: Vector) -> tuple[float, float]:
    """Horizontal distance to the target, and how far it is off the agent's axis, degrees."""
    dx, dz = target.x - position[0], target.z - position[1]
    off = (math.degrees(math.atan2(dx, dz)) - facing + 180) % 360 - 180
    return math.hypot(dx, dz), abs(off)


def _middle(item: ThorObject) -> Vector:
    box = item.axis_aligned_bounding_box
    return item.position if box is None else box.center


def _teleport(simulator: Simulator, grid: Grid, here: SimulatorView, viewpoint: Viewpoint) -> SimulatorView:
    x, z = grid.position(viewpoint.pose.cell)
    position = Vector(x, here.agent.position.y, z)
    pose = AgentPose(position, float(viewpoint.pose.facing), float(viewpoint.horizon), here.agent.standing)
    return simulator.query(**teleport_call(pose, force=False), **_UNSEEN)
