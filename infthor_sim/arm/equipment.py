"""The agent's camera and arm in each agent mode."""

from infthor_sim.agent import CAMERA_HEIGHT, CROUCH
from infthor_sim.arm.arm import Arm
from infthor_sim.arm.holding import drop_all
from infthor_sim.arm.kinova import Kinova
from infthor_sim.arm.rig import Rig
from infthor_sim.arm.stretch import Stretch
from infthor_sim.physics.falling import let_fall
from infthor_sim.world import World

__all__ = ["equip"]

_RIGS: dict[str, type[Kinova] | type[Stretch]] = {"arm": Kinova, "stretch": Stretch}
# metres, from Unity's sources; other modes have the usual camera
_EYES = {"stretch": (0.00192, 0.5447, 0.06788)}


def equip(world: World, agent_mode: str) -> None:
    """Give an agent the camera and the resting arm of an agent mode; what it held falls."""
    if world.arm is not None:
        drop_all(world, world.arm)
    rig: Rig | None = _RIGS[agent_mode]() if agent_mode in _RIGS else None
    if rig is not None and world.agent.held is not None:
        held = world.objects[world.agent.held]
        world.let_go(held)
        let_fall(world, held, held.center)
    world.arm = None if rig is None else Arm(rig, rig.rest())
    world.agent.eye = _EYES.get(agent_mode, (0.0, CAMERA_HEIGHT, 0.0))
    world.agent.crouch = 0.0 if agent_mode in _EYES else CROUCH
    world.mark_changed()
