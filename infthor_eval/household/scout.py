"""Finding poses from which an object is visible and can be acted on.

Candidates come from geometry. The simulator then tests them: the agent is teleported there and
back, which moves nothing else and is not part of the trajectory.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import SimulatorError
from infthor_eval.household.navigation import Grid, GridPose
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector, teleport_call

CAMERA_HEIGHT = 0.675  # height of the camera above the agent's position, metres
HORIZON_STEP = 30  # degrees
_HORIZONS = (-30, 0, 30, 60)
_REACH = 1.5  # the simulator's visibility distance, metres
_SIDEWAYS = 32.0  # maximum angle from the camera's axis, degrees; half the field of view is 30
_TOO_NEAR = 0.5  # metres; closer, a door may hit the agent, and an object fills the frame
_MAX_TRIALS = 30
# Trials after the first success, for a viewpoint with the object well inside the frame.
_EXTRA_TRIALS = 4
# margin and width of the frame, pixels
_MARGIN = 15
_SIDE = 300
# The instance image is enough to tell what is in the frame.
_NO_IMAGE: dict[str, Any] = {"renderImage": False}


@dataclass(frozen=True)
class Viewpoint:
    """A pose on the grid, and the camera's angle below the horizon in degrees."""

    pose: GridPose
    horizon: int


def find_viewpoint(
    simulator: Simulator,
    grid: Grid,
    targets: list[str],
    inside: str | None = None,
    min_pixels: int = 0,
) -> Viewpoint | None:
    """Return the viewpoint with the fewest actions to it from which all given objects are visible.

    For an object that can be picked up, a slightly farther viewpoint is preferred if it has the
    object well inside the frame, and not at its edge: the frame then shows what is done with it.

    Args:
        simulator: the simulator; its agent returns to its pose.
        grid: the reachable cells.
        targets: ids of the objects that must be visible; the agent faces the first.
        inside: id of an object hidden in the first one, which must become visible when that is
            opened.
        min_pixels: minimum size of the first object in the frame, pixels.

    Returns:
        The viewpoint, or None if no candidate qualifies.
    """
    start = simulator.view
    focus = start.objects[inside or targets[0]]
    distances = grid.distances(grid_pose_of(start.agent, grid))
    best = None
    trials_left = _EXTRA_TRIALS
    for viewpoint in list(_candidates(start, grid, focus, distances))[:_MAX_TRIALS]:
        view = view_from(simulator, grid, start, viewpoint)
        qualifies = view.success and _shows(view, targets, min_pixels)
        if qualifies and (
            inside is None or _comes_into_view(simulator, targets[0], inside, min_pixels)
        ):
            needs_margin = inside is None and focus.pickupable
            is_clear = not needs_margin or _is_well_inside(view, targets[0])
            best = viewpoint if is_clear or best is None else best
            if is_clear:
                break
        trials_left -= best is not None
        if not trials_left:
            break
    simulator.query(**teleport_call(start.agent), **_NO_IMAGE)
    return best


def reachable_grid(simulator: Simulator) -> Grid:
    """Return the cells that the agent can reach in the current state."""
    positions = simulator.query("GetReachablePositions", **_NO_IMAGE).result or ()
    return Grid((position["x"], position["z"]) for position in positions)


def grid_pose_of(pose: AgentPose, grid: Grid) -> GridPose:
    """Return the nearest pose on the grid."""
    return GridPose(
        grid.cell(pose.position.x, pose.position.z), round(pose.rotation / 90) * 90 % 360
    )


def _shows(view: SimulatorView, targets: list[str], min_pixels: int) -> bool:
    if not all(key in view.objects and view.objects[key].visible for key in targets):
        return False
    if view.instances is None:
        return True
    return targets[0] in view.instances and view.instances[targets[0]].pixels >= min_pixels


def _is_well_inside(view: SimulatorView, object_id: str) -> bool:
    """Return True if an object does not touch the margin of the frame."""
    instance = (view.instances or {}).get(object_id)
    return instance is None or all(_MARGIN <= edge < _SIDE - _MARGIN for edge in instance.box)


def _comes_into_view(simulator: Simulator, holder: str, inside: str, min_pixels: int) -> bool:
    """Open and close a receptacle; return True if the object in it was seen and it closed."""
    view = simulator.query("OpenObject", objectId=holder, **_NO_IMAGE)
    if not view.success:
        return False
    is_visible = _shows(view, [inside], min_pixels)
    if simulator.query("CloseObject", objectId=holder, **_NO_IMAGE).success:
        return is_visible
    # An open drawer can be out of view, and then cannot be closed normally. It must not stay open,
    # as the trajectory has no action that opened it.
    if not simulator.query("CloseObject", objectId=holder, forceAction=True, **_NO_IMAGE).success:
        raise SimulatorError(
            f"{holder} was opened to look into it and cannot be closed again; choose another scene"
        )
    return False


def _candidates(
    view: SimulatorView, grid: Grid, focus: ThorObject, distances: dict[GridPose, int]
) -> Iterator[Viewpoint]:
    """Yield viewpoints with the object in the frame, those with the fewest actions first."""
    box = focus.axis_aligned_bounding_box
    target = focus.position if box is None else box.center
    eye = view.agent.position.y + CAMERA_HEIGHT
    ranked = []
    for pose, length in distances.items():
        distance, sideways = _bearing(grid.position(pose.cell), pose.facing, target)
        if distance > _REACH or sideways > _SIDEWAYS:
            continue
        down = math.degrees(math.atan2(eye - target.y, max(distance, 0.1)))
        # Penalties, in numbers of actions, for standing too near and for an object off the centre
        # of the frame.
        penalty = 4 * (distance < _TOO_NEAR) + sideways / 15
        for horizon in sorted(_HORIZONS, key=lambda angle: abs(angle - down))[:2]:
            off = abs(horizon - down)
            turns = abs(horizon - view.agent.horizon) / HORIZON_STEP
            ranked.append((length + turns + penalty + off / 10, pose, horizon))
    for _, pose, horizon in sorted(ranked):
        yield Viewpoint(pose, horizon)


def _bearing(position: tuple[float, float], facing: int, target: Vector) -> tuple[float, float]:
    """Return the horizontal distance to the target (metres), and its angle from the agent's heading
    (degrees)."""
    dx, dz = target.x - position[0], target.z - position[1]
    angle = (math.degrees(math.atan2(dx, dz)) - facing + 180) % 360 - 180
    return math.hypot(dx, dz), abs(angle)


def view_from(
    simulator: Simulator,
    grid: Grid,
    start: SimulatorView,
    viewpoint: Viewpoint,
    rendering: Mapping[str, Any] = _NO_IMAGE,
) -> SimulatorView:
    """Teleport the agent, and return what it sees, without the image unless `rendering` has it."""
    x, z = grid.position(viewpoint.pose.cell)
    position = Vector(x, start.agent.position.y, z)
    pose = AgentPose(
        position, float(viewpoint.pose.facing), float(viewpoint.horizon), start.agent.standing
    )
    return simulator.query(**teleport_call(pose, force=False), **rendering)
