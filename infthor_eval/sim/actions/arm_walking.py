# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""How the arm agents walk and turn: in small steps, with their arm, until something is in the way."""

from collections.abc import Callable

import numpy as np

from infthor_eval.sim.actions.arm_motion import follow, place_text, the_arm, turn_text
from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.arm.paths import STEP, shares
from infthor_eval.sim.arm.sweep import Stance, stance
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import Array, yaw_matrix
from infthor_eval.sim.obstacles import blocking_object, nearest_name
from infthor_eval.sim.simulation import Simulation
from infthor_eval.sim.world import World

__all__: list[str] = []

_ARMS = ("arm", "stretch")
_TURN_STEP = 1.15  # degrees: Unity's radian a second in a fiftieth of one
_MOST = 2000  # steps of one walk: 40 m
_SIDES = {"Ahead": (1.0, 0.0), "Back": (-1.0, 0.0), "Right": (0.0, 1.0), "Left": (0.0, -1.0)}


@action("MoveAgent", modes=_ARMS)
def move_agent(
    sim: Simulation,
    ahead: float = 0.0,
    right: float = 0.0,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Walk, metres ahead and to the right at once."""
    if ahead == 0 and right == 0:
        raise ActionError("Must specify ahead or right!")
    now = stance(sim.world, the_arm(sim))
    way = yaw_matrix(now.yaw) @ np.array([right, 0.0, ahead])
    distance = float(np.linalg.norm(way))
    if distance > _MOST * STEP:
        raise ActionError(f"The agent walks at most {_MOST * STEP:g} m at once, not {distance:.4g}")
    path = [Stance(now.position + way * share, now.yaw, now.pose) for share in shares(distance, STEP)]
    met = _body_contact(sim.world, [s.position for s in path])
    follow(sim, path, place_text(now.position + way), returnToStart, met)


def _body_contact(world: World, places: list[Array]) -> tuple[int, str] | None:
    """The first of some places at which the agent cannot be, and what is there.

    From where it cannot be either, as after a forced teleport, it may walk to where it can.
    """
    stood = world.nav.stands(world.agent.position[0], world.agent.position[2])
    for step, place in enumerate(places):
        obstacle = blocking_object(world, place)
        stands = obstacle is None and world.nav.stands(place[0], place[2])
        if not stands and (stood or step == len(places) - 1):
            return step, obstacle or nearest_name(world, place)
        stood = stood or stands
    return None


def _walker(side: tuple[float, float]) -> Callable[..., None]:
    def walk(
        sim: Simulation,
        moveMagnitude: float | None = None,
        objectId: str | None = None,
        maxAgentsDistance: float = -1.0,
        forceAction: bool = False,
        manualInteract: bool = False,
        allowAgentsToIntersect: bool = False,
        speed: float = 1.0,
        returnToStart: bool = True,
        disableRendering: bool = True,
    ) -> None:
        size = sim.settings.grid_size if moveMagnitude is None else moveMagnitude
        move_agent(sim, side[0] * size, side[1] * size, speed, returnToStart, disableRendering)

    return walk


for _name, _side in _SIDES.items():
    action(f"Move{_name}", modes=_ARMS)(_walker(_side))


@action("RotateAgent", modes=_ARMS)
def rotate_agent(
    sim: Simulation,
    degrees: float,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn clockwise, degrees, the shortest way."""
    now = stance(sim.world, the_arm(sim))
    way = (degrees + 180.0) % 360.0 - 180.0
    end = round((now.yaw + way) % 360.0, 6) % 360.0
    yaws = [(now.yaw + way * share) % 360.0 for share in shares(abs(way), _TURN_STEP)[:-1]]
    path = [Stance(now.position, yaw, now.pose) for yaw in (*yaws, end)]
    follow(sim, path, turn_text(yaw_matrix(end)), returnToStart)


def _turner(sign: float) -> Callable[..., None]:
    def turn(
        sim: Simulation,
        degrees: float | None = None,
        manualInteract: bool = False,
        forceAction: bool = False,
        speed: float = 1.0,
        waitForFixedUpdate: bool = False,
        returnToStart: bool = True,
        disableRendering: bool = True,
    ) -> None:
        amount = sim.settings.rotate_step if degrees is None else degrees
        rotate_agent(sim, sign * amount, speed, waitForFixedUpdate, returnToStart, disableRendering)

    return turn


for _name, _sign in (("RotateRight", 1.0), ("RotateLeft", -1.0)):
    action(_name, modes=_ARMS)(_turner(_sign))
