# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Physics actions of ManipulaTHOR scripts: most do nothing, as nothing moves between actions."""

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError
from infthor_sim.settings import ARM_MODES
from infthor_sim.simulation import Simulation

_LONGEST = 0.05  # seconds of one step of Unity's physics


@action("PausePhysicsAutoSim", "UnpausePhysicsAutoSim", "MakeAllObjectsMoveable", modes=ARM_MODES)
def leave_physics(sim: Simulation) -> None:
    """Do nothing: objects lie still, and loose ones give way to the arm."""


@action("AdvancePhysicsStep", modes=ARM_MODES)
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
    """Let objects of a type survive every fall from now on."""
    sim.world.unbreakable.add(objectType)
