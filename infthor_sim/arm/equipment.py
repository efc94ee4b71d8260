"""The agent's camera and arm in each agent mode."""

from typing import NamedTuple

from infthor_sim.agent import CAMERA_HEIGHT, CROUCH, MAX_DOWN
from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import drop_all
from infthor_sim.arm.kinova import Kinova
from infthor_sim.arm.rig import Rig
from infthor_sim.arm.stretch import Stretch
from infthor_sim.physics.falling import let_fall
from infthor_sim.settings import LOCOBOT
from infthor_sim.world import World

_RIGS: dict[str, type[Kinova] | type[Stretch]] = {"arm": Kinova, "stretch": Stretch}


class _Camera(NamedTuple):
    """The camera of an agent mode, from Unity's sources.

    Attributes:
        eye: position relative to the agent's (right, up, ahead), metres.
        crouch: metres that crouching lowers it.
        max_down: degrees that it tilts below the horizon at most.
    """

    eye: tuple[float, float, float]
    crouch: float
    max_down: float


_USUAL = _Camera((0.0, CAMERA_HEIGHT, 0.0), CROUCH, MAX_DOWN)
_CAMERAS = {
    "stretch": _Camera((0.00192, 0.5447, 0.06788), 0.0, MAX_DOWN),
    LOCOBOT: _Camera((0.0, -0.0312, 0.0), 0.0, 30.0),
}


def equip(world: World, agent_mode: str) -> None:
    """Give an agent the camera and the resting arm of an agent mode; what it held falls."""
    if world.arm is not None:
        drop_all(world, world.arm)
    rig: Rig | None = _RIGS[agent_mode]() if agent_mode in _RIGS else None
    if (rig is not None or agent_mode == LOCOBOT) and world.agent.held is not None:
        held = world.objects[world.agent.held]
        world.let_go(held)
        let_fall(world, held, held.center)
    world.arm = None if rig is None else Arm(rig, rig.rest())
    camera = _CAMERAS.get(agent_mode, _USUAL)
    world.agent.eye, world.agent.crouch, world.agent.max_down = camera
    world.mark_changed()
