# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Physics actions: most do nothing, as nothing moves between actions."""

from itertools import chain

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError
from infthor_sim.settings import ARM_MODES
from infthor_sim.simulation import Simulation

_LONGEST = 0.05  # seconds of one step of Unity's physics


@action("PausePhysicsAutoSim", "UnpausePhysicsAutoSim", "MakeObjectsStaticKinematicMassThreshold")
def leave_physics(sim: Simulation) -> None:
    """Do nothing: objects lie still, and heavy ones stay in place."""


@action("MakeAllObjectsMoveable", modes=ARM_MODES)
def leave_objects(sim: Simulation) -> None:
    """Do nothing: loose objects give way to the arm."""


@action("ChangeOpenSpeed")
def leave_speed(sim: Simulation, x: float) -> None:
    """Do nothing: what is opened is open at once."""


@action("AdvancePhysicsStep")
def advance_physics(
    sim: Simulation,
    timeStep: float = 0.02,
    simSeconds: float | None = None,
    allowAutoSimulation: bool = False,
) -> None:
    """Check the step and do nothing: a released object has fallen already."""
    if not 0 < timeStep <= _LONGEST:
        raise ActionError(
            "Please use a timeStep between 0.0 and 0.05. Larger timeSteps produce inconsistent "
            "simulation results."
        )


@action("MakeObjectsOfTypeUnbreakable", modes=ARM_MODES)
def make_unbreakable(sim: Simulation, objectType: str) -> None:
    """Let the objects of a type survive every fall."""
    world = sim.world
    for item in chain(
        world.objects.values(), world.disabled.values(), world.templates.get(objectType, ())
    ):
        if item.object_type == objectType:
            item.unbreakable = True


@action("MakeObjectBreakable")
def make_breakable(sim: Simulation, objectId: str) -> None:
    """Let an object break from a far fall again."""
    sim.world.get(objectId).unbreakable = False
